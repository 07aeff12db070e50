"""Photos and planes made smaller and larger by a whole factor, and blurred."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import cv2
import numpy as np

from relit.photo.filters import gaussian

if TYPE_CHECKING:
    from numpy.typing import NDArray

_CELLS = 3  # of a coarser grid per standard deviation of a blur: an edge is off by 1 % at most
_BAND = 2**20  # samples of a photo that are held as wider integers at a time


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
    made = gaussian(reduced(planes, factor), float(left))
    return Enlarger(made, factor, planes.shape).rows(0, len(planes))


def reduced(image: NDArray[Any], factor: int) -> NDArray[Any]:
    """Return the means over blocks of ``factor x factor`` px, uint16 of integers and float32 of floats.

    At the end, the last pixel counts as often as a block has to be filled.
    """
    if factor == 1:
        return image
    rows, columns = (-(-size // factor) for size in image.shape[:2])
    kind = np.uint16 if image.dtype.kind == "u" else np.float32
    made = np.empty((rows, columns, *image.shape[2:]), kind)
    band = max(_BAND // (columns * factor * factor), 1)
    for first in range(0, rows, band):
        part = image[first * factor : (first + band) * factor]
        made[first : first + band] = _block_means(part, factor, columns)
    return made


def _block_means(part: NDArray[Any], factor: int, columns: int) -> NDArray[Any]:
    """Return the means over the blocks of some rows of a photo."""
    part = part.astype(np.uint16) * 257 if part.dtype == np.uint8 else part
    part = np.ascontiguousarray(part, None if part.dtype == np.uint16 else np.float32)
    rows, planes = -(-len(part) // factor), part.shape[2:]
    below, beside = rows * factor - len(part), columns * factor - part.shape[1]
    if below or beside:
        part = cv2.copyMakeBorder(part, 0, below, 0, beside, cv2.BORDER_REPLICATE)
    made = cv2.resize(part, (columns, rows), interpolation=cv2.INTER_AREA)
    return np.asarray(made).reshape(rows, columns, *planes)


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
        # Those that lie beside them count too.
        start = max(first // self._factor - 1, 0)
        part = self._plane[start : -(-last // self._factor) + 1]
        size = part.shape[1] * self._factor, part.shape[0] * self._factor
        made = cv2.resize(np.ascontiguousarray(part), size, interpolation=cv2.INTER_LINEAR)
        made = np.asarray(made, np.float32).reshape(size[1], size[0], *part.shape[2:])
        return made[first - start * self._factor : last - start * self._factor, : self._width]
