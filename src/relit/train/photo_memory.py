"""What was found out about the photos that were relit last: another light on one of them is quicker."""

from __future__ import annotations

from contextlib import contextmanager
from hashlib import blake2b
from typing import TYPE_CHECKING

from relit.runtime.lru import LRU
from relit.runtime.memo import OF_ONE_CALL, Memo

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from relit.face.landmarks import Landmarks
    from relit.photo.photo import Photo

_EACH = 2  # results of a step: that of the photo, and that of its last reference


class PhotoMemory:
    """A `Memo` for each of the last photos; a pickled one comes back empty.

    Parameters
    ----------
    most_bytes : int
        How much they may hold together; those of the photos not relit for longest are forgotten. One of 256²
        takes 19 MB.
    """

    def __init__(self, most_bytes: int = 150_000_000) -> None:
        self._most_bytes = most_bytes
        self._memos: LRU[bytes, Memo] = LRU(most_bytes, _arrays_of)

    @contextmanager
    def open(self, photo: Photo, landmarks: Landmarks) -> Iterator[None]:
        """Let the steps of this thread know what was found out about a photo, and keep what they find."""
        content = blake2b(photo.pixels.tobytes())
        content.update(landmarks.points.tobytes())
        key = content.digest()
        memo = self._memos.get(key) or Memo(OF_ONE_CALL, _EACH)
        with memo.open():
            yield
        if memo.size <= self._most_bytes:
            self._memos.put(key, memo)  # which has grown
        else:
            self._memos.pop(key)


def _arrays_of(memo: Memo) -> Mapping[int, int]:
    return memo.arrays
