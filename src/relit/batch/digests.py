"""Texts by the million, as 8 bytes each."""

from __future__ import annotations

from hashlib import blake2b
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from array import array

    from numpy.typing import NDArray


def short_digest(text: str) -> int:
    """Return 8 bytes that stand for a text."""
    return int.from_bytes(blake2b(text.encode("utf-8", "surrogatepass"), digest_size=8).digest())


class Digests:
    """A set of 8-byte digests that takes no more than these."""

    def __init__(self, values: NDArray[np.uint64]) -> None:
        self.values = values  # sorted

    def __contains__(self, digest: int) -> bool:
        """Return whether it is one of them."""
        at = int(np.searchsorted(self.values, np.uint64(digest)))
        return at < len(self.values) and int(self.values[at]) == digest


def repeated(digests: array[int]) -> Digests:
    """Return those that occur more than once.

    Examples
    --------
    >>> from array import array
    >>> 3 in repeated(array("Q", [3, 1, 3])), 1 in repeated(array("Q", [3, 1, 3]))
    (True, False)
    """
    values, counts = np.unique(np.frombuffer(digests, np.uint64), return_counts=True)
    return Digests(values[counts > 1])


def of_several(names: array[int], things: array[int]) -> Digests:
    """Return the names that belong to more than one thing."""
    pairs = np.stack([np.frombuffer(names, np.uint64), np.frombuffer(things, np.uint64)], axis=1)
    values, counts = np.unique(np.unique(pairs, axis=0)[:, 0], return_counts=True)
    return Digests(values[counts > 1])
