"""Where a film is cut: its colours are of a sudden others, and stay so."""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING

import cv2
import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

_BINS = 4  # of each of red, green and blue
_SIZE = (64, 36)  # px that a frame is reduced to
#: Of a histogram, how much is elsewhere after a cut, at least.
JUMP = 0.3
_ABOVE = 3.0  # how much more than from frame to frame nearby
_AROUND = 8  # frames on each side that count as nearby


def signature(pixels: NDArray[np.uint8]) -> NDArray[np.float32]:
    """Return how the colours of a frame are spread, in each third of its width; all add up to 1."""
    small = cv2.resize(pixels, _SIZE, interpolation=cv2.INTER_AREA)
    # Between two bins a colour counts for both, or a little noise would move much.
    parts = []
    for part in np.array_split(small, 3, axis=1):
        values = part.reshape(-1, 3).astype(np.float32) * ((_BINS - 1) / 255)
        low = np.minimum(values.astype(np.int64), _BINS - 2)
        share = values - low
        counts = np.zeros(_BINS**3)
        for corner in np.ndindex(2, 2, 2):
            weight = np.prod(np.where(corner, share, 1 - share), axis=1)
            place = ((low + corner) * (_BINS**2, _BINS, 1)).sum(axis=1)
            counts += np.bincount(place, weight, _BINS**3)
        parts.append(counts / (3 * len(values)))
    return np.concatenate(parts).astype(np.float32)


def apart(one: NDArray[np.float32], other: NDArray[np.float32]) -> float:
    """Return how much of a signature is elsewhere in another, 0 to 1."""
    return float(np.abs(one - other).sum() / 2)


def find_cuts(signatures: NDArray[np.float32]) -> list[int]:
    """Return the numbers of the frames that a shot begins with, but for the first.

    A flash is no cut: the frames after it are as those before.

    Examples
    --------
    >>> red, blue = np.eye(2, 9, dtype=np.float32)
    >>> find_cuts(np.stack([red] * 5 + [blue] * 4)), find_cuts(np.stack([red] * 5 + [blue] + [red] * 5))
    ([5], [])
    """
    signatures = np.asarray(signatures, np.float32)
    steps = np.array([apart(*pair) for pair in itertools.pairwise(signatures)])
    cuts: list[int] = []
    for number in np.flatnonzero(steps > JUMP).tolist():
        near = np.r_[steps[max(number - _AROUND, 0) : number], steps[number + 1 : number + 1 + _AROUND]]
        calm = not near.size or steps[number] > _ABOVE * float(np.median(near))
        if calm and not _is_flash(signatures, number):
            cuts.append(number + 1)
    return cuts


def _is_flash(signatures: NDArray[np.float32], number: int) -> bool:
    """Whether the step after a frame goes to, or comes back from, a few frames that are unlike their like."""
    for length in (1, 2):
        for first in range(number - length, number + 1):
            last = first + length + 1
            if (
                first >= 0
                and last < len(signatures)
                and apart(signatures[first], signatures[last]) < JUMP / 2
            ):
                return True
    return False
