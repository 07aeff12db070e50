"""Photos and planes made smaller and larger by a whole factor, and blurred."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.ndimage import gaussian_filter

if TYPE_CHECKING:
    from numpy.typing import NDArray

_CELLS = 3  # of a coarser grid per standard deviation of a blur: an edge is off by 1 % at most


def blurred(planes: NDArray[np.float32], sigma: float) -> NDArray[np.float32]:
    """Return planes, (H, W) or (H, W, k), blurred by a Gaussian of `sigma` px; a wide one on a coarser grid.

    Examples
    --------
    >>> edge = np.repeat(np.array([[0, 1]], np.float32), 64, axis=1)
    >>> blurred(edge, 8.0)[0, [48, 64, 80]].astype(float).round(2).tolist()
    [0.03, 0.53, 0.98]
    """
    factor = max(int(sigma / _CELLS), 1)
    # Means over cells and lines between them are blurs as well.
    left = np.sqrt(sigma**2 - (factor**2 - 1) / 4) / factor
    made = gaussian_filter(reduced(planes, factor), (left, left, 0)[: planes.ndim])
    return Enlarger(made, factor, planes.shape).rows(0, len(planes))


def reduced(image: NDArray[Any], factor: int) -> NDArray[Any]:
    """Return the means over blocks of ``factor x factor`` px, uint16 of integers and float32 of floats."""
    if factor == 1:
        return image
    whole = image.dtype.kind == "u"
    rows, columns = (-(-size // factor) for size in image.shape[:2])
    total = image
    for axis, count in enumerate((rows, columns)):
        shape = (*total.shape[:axis], count, *total.shape[axis + 1 :])
        part, total = total, np.zeros(shape, np.uint32 if whole else np.float32)
        for first in range(factor):
            places = np.minimum(np.arange(first, count * factor, factor), image.shape[axis] - 1)
            total += part.take(places, axis)
    if not whole:
        return total / np.float32(factor**2)
    return np.rint(total * (65535 / (factor**2 * float(np.iinfo(image.dtype).max)))).astype(np.uint16)


class Enlarger:
    """Bilinear enlargement by a whole factor, row by row, so that no large plane has to be held.

    Parameters
    ----------
    plane : (h, w) or (h, w, k) float32 array
    factor : int
    shape : tuple of int
        ``(H, W, ...)`` of the result, at most factor times as large.

    Examples
    --------
    >>> Enlarger(np.array([[0, 1]], np.float32), 2, (2, 4)).rows(0, 1)[0].tolist()
    [0.0, 0.25, 0.75, 1.0]
    """

    def __init__(self, plane: NDArray[np.float32], factor: int, shape: tuple[int, ...]) -> None:
        self._plane, self._factor, self._width = plane, factor, shape[1]

    def rows(self, first: int, last: int) -> NDArray[np.float32]:
        """Return rows ``first`` to ``last``, the latter not included."""
        if self._factor == 1:
            return self._plane[first:last, : self._width]
        narrow = _between(self._plane, 0, np.arange(first, last), self._factor)
        return _between(narrow, 1, np.arange(self._width), self._factor)


def _between(
    plane: NDArray[np.float32], axis: int, pixels: NDArray[np.int_], factor: int
) -> NDArray[np.float32]:
    """Return a plane interpolated along an axis, where the pixels of the enlarged one lie."""
    position = np.clip((pixels + 0.5) / factor - 0.5, 0, plane.shape[axis] - 1)
    before = position.astype(np.intp)
    share = (position - before).astype(np.float32).reshape(-1, *[1] * (plane.ndim - 1 - axis))
    enlarged = plane.take(before, axis)
    enlarged += share * (plane.take(before + 1, axis, mode="clip") - enlarged)
    return enlarged
