"""What rows read: files, held for the rows that come after, with the photos that are in them."""

from __future__ import annotations

from functools import cached_property
from hashlib import sha256
from typing import TYPE_CHECKING

from relit.batch import places
from relit.batch.jobs import File
from relit.face.detect import detect_landmarks
from relit.photo.atomic_files import NamedBytes
from relit.photo.photo import Photo
from relit.photo.pixels import check_pixels
from relit.photo.reading import read_image
from relit.runtime.lru import LRU
from relit.runtime.memo import remembered

if TYPE_CHECKING:
    from collections.abc import Sequence

    from relit.face.landmarks import Landmarks

_MOST_BYTES = 64_000_000  # some 300 photos of 256²; those of the row under way stay in any case


class Content:
    """What a file holds: its bytes, what tells them from others, and the photo in them."""

    def __init__(self, place: str, version: str | None, data: bytes) -> None:
        self._place, self.data = place, data
        self.file = File(sha256(data).hexdigest(), version)

    @cached_property
    def photo(self) -> Photo:
        """The photo, decoded when first asked for; nobody may change it."""
        photo = read_image(NamedBytes(self._place, self.data))
        check_pixels(photo.pixels, self._place)
        return photo

    @cached_property
    def face(self) -> Landmarks:
        """Where the largest face is, looked for when first asked."""
        return detect_landmarks(self.photo.pixels, name=self._place)

    @property
    def sizes(self) -> dict[int, int]:
        """Bytes that it takes, as `LRU` counts them."""
        decoded = vars(self).get("photo")
        return {id(self): len(self.data) + (decoded.pixels.nbytes if decoded else 0)}


class Shelf:
    """The files that were read last: rows that share a target mostly follow each other."""

    def __init__(self, most_bytes: int = _MOST_BYTES) -> None:
        self._held: LRU[str, Content] = LRU(most_bytes, lambda content: content.sizes)

    def read(self, wanted: Sequence[str]) -> dict[str, Content]:
        """Return what files hold, by their places; files that are as they were are not read again."""
        found = {place: self._one(place) for place in wanted}
        for place, content in found.items():
            self._held.put(place, content, *found)
        return found

    def _one(self, place: str) -> Content:
        # The version first: what changes while it is read does not count as known the next time.
        version = places.version_of(place)
        held = self._held.get(place)
        if held is not None and version is not None and held.file.version == version:
            return held
        # What is far away is fetched for all processes; files of this machine lie in its memory anyway.
        if version is None or places.path_of(place) is not None:
            return Content(place, version, places.read_bytes(place))
        return Content(place, version, fetch(place, version))


@remembered
def fetch(place: str, version: str) -> bytes:  # noqa: ARG001 (tells a keeper what is the same)
    """Return what is at a URL in this version."""
    return places.read_bytes(place)


#: Of this process.
SHELF = Shelf()
