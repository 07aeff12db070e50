"""What rows read: files, held for the rows that come after, with the photos that are in them."""

from __future__ import annotations

import threading
from functools import cached_property
from hashlib import sha256
from typing import TYPE_CHECKING

from relit.batch import places
from relit.batch.jobs import File
from relit.batch.stamps import Stamp, stamp_of
from relit.batch.stores import path_of
from relit.photo.atomic_files import NamedBytes
from relit.photo.photo import Photo
from relit.photo.pixels import check_pixels
from relit.photo.reading import read_image
from relit.runtime.memo import remembered

if TYPE_CHECKING:
    from collections.abc import Sequence

_MOST_BYTES = 64_000_000  # held beside those of the row under way: some 300 photos of 256²


class Content:
    """What a file holds.

    Parameters
    ----------
    place : str
    stamp : tuple of (int, int) or None
        Of the file before it was read.
    data : bytes

    Attributes
    ----------
    file : File
    """

    def __init__(self, place: str, stamp: Stamp | None, data: bytes) -> None:
        self._place, self.data = place, data
        self.file = File(sha256(data).hexdigest(), stamp)

    @cached_property
    def photo(self) -> Photo:
        """The photo that is in it, decoded when first asked for; nobody may change it.

        Raises
        ------
        ImageError
            If there is none, or it is of no use.
        """
        photo = read_image(NamedBytes(self._place, self.data))
        check_pixels(photo.pixels, self._place)
        return photo

    @property
    def size(self) -> int:
        """Bytes that it takes."""
        decoded = vars(self).get("photo")
        return len(self.data) + (decoded.pixels.nbytes if decoded else 0)


class Shelf:
    """The files that were read last.

    Those of one row are there for the next: rows that share a target mostly follow each other.

    Parameters
    ----------
    most_bytes : int
        How much they may hold, besides those of the row under way; what was not asked for longest goes
        first.
    """

    def __init__(self, most_bytes: int = _MOST_BYTES) -> None:
        self._most_bytes = most_bytes
        self._held: dict[str, Content] = {}  # the latest last
        self._lock = threading.Lock()  # workers of a cluster may have several threads

    def read(self, wanted: Sequence[str]) -> dict[str, Content]:
        """Return what files hold, by their places; files that are as they were are not read again.

        Raises
        ------
        ImageError, OptionError
            As `places.read_bytes`.
        """
        found = {place: self._one(place) for place in wanted}
        with self._lock:
            others = {place: held for place, held in self._held.items() if place not in found}
            total = sum(held.size for held in others.values())
            for place in list(others):
                if total <= self._most_bytes:
                    break
                total -= others.pop(place).size
            self._held = others | found
        return found

    def _one(self, place: str) -> Content:
        # Stamped first: what changes while it is read does not count as known the next time.
        stamp = stamp_of(place)
        with self._lock:
            held = self._held.get(place)
        if held is not None and stamp is not None and held.file.stamp == stamp:
            return held
        # What is far away is fetched for all processes; files of this machine lie in its memory anyway.
        if stamp is None or path_of(place) is not None:
            return Content(place, stamp, places.read_bytes(place))
        return Content(place, stamp, fetch(place, stamp))


@remembered
def fetch(place: str, stamp: Stamp) -> bytes:  # noqa: ARG001 (tells a keeper what is the same)
    """Return what is at a URL and has this stamp."""
    return places.read_bytes(place)


#: Of this process.
SHELF = Shelf()
