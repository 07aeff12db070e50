"""Photos and planes made smaller and larger by a whole factor."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray


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
    >>> import numpy as np
    >>> Enlarger(np.array([[0, 1]], np.float32), 2, (2, 4)).rows(0, 1)[0].tolist()
    [0.0, 0.25, 0.75, 1.0]
    """

    def __init__(self, plane: NDArray[np.float32], factor: int, shape: tuple[int, ...]) -> None:
        self._plane, self._factor, self._shape = plane, factor, shape
        self._columns = _between(np.arange(shape[1]), factor, plane.shape[1])

    def rows(self, first: int, last: int) -> NDArray[np.float32]:
        """Return rows ``first`` to ``last``, the latter not included."""
        if self._factor == 1:
            return self._plane[first:last, : self._shape[1]]
        before, after, share = _between(np.arange(first, last), self._factor, self._plane.shape[0])
        narrow = self._plane[before]
        narrow += _beside(share, narrow.ndim, 0) * (self._plane[after] - narrow)
        before, after, share = self._columns
        wide = narrow[:, before]
        wide += _beside(share, wide.ndim, 1) * (narrow[:, after] - wide)
        return wide


def _between(
    places: NDArray[np.int_], factor: int, count: int
) -> tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.float32]]:
    """Return between which two of ``count`` reduced pixels places lie, and how near to the second."""
    position = np.clip((places + 0.5) / factor - 0.5, 0, count - 1)
    before = position.astype(np.intp)
    return before, np.minimum(before + 1, count - 1), (position - before).astype(np.float32)


def _beside(share: NDArray[np.float32], dimensions: int, axis: int) -> NDArray[np.float32]:
    return share.reshape([-1 if n == axis else 1 for n in range(dimensions)])
