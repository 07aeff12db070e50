"""Which pixel of a mask is nearest to each one, told by how far away it is; and which of some points.

In each column the nearest one is soon found. Neighbours in a row whose nearest pixel is in the same column c
tell it by their squared distances: ``(x + 1 - c)² - (x - c)² = 2 (x - c) + 1``.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from relit.photo.filters import distance_from

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Whole = NDArray[np.int32]

_AT_ONCE = 2**18  # distances
_TILE = 32  # px of a square whose pixels share the points that may be the nearest


def nearest_in(mask: NDArray[np.bool_]) -> Whole:
    """Return which pixel of a mask, as its place in the flat array, is nearest to each one.

    Parameters
    ----------
    mask : (H, W) bool array
        Not empty.

    Examples
    --------
    >>> nearest_in(np.array([[True, False, False, True]])).tolist()
    [[0, 0, 3, 3]]
    """
    height, width = mask.shape
    y, x = (axis.astype(np.int32) for axis in np.ogrid[:height, :width])
    beyond = np.int32(height + width)  # farther than all that is
    above = np.maximum.accumulate(np.where(mask, y, -beyond), axis=0)
    below = np.minimum.accumulate(np.where(mask, y, height + beyond)[::-1], axis=0)[::-1]
    row = np.where(y - above <= below - y, above, below)
    down = (row - y) ** 2

    away = np.rint(distance_from(mask) ** 2).astype(np.int32)
    rise: Whole = np.diff(away, axis=1, prepend=away[:, :1], append=away[:, -1:])
    columns = [np.clip(x - offset, 0, width - 1) for offset in (rise[:, 1:] >> 1, rise[:, :-1] + 1 >> 1)]
    one, other = (down.take(y * width + column) + (x - column) ** 2 for column in columns)
    column = np.where(one <= other, *columns).ravel()
    # Few share theirs with neither neighbour.
    alone = np.flatnonzero(np.minimum(one, other) > away)
    for some in np.array_split(alone, len(alone) * width // _AT_ONCE + 1):
        column[some] = (down[some // width] + (x - some[:, None] % width) ** 2).argmin(axis=1)
    chosen = column.reshape(mask.shape)
    return np.asarray(row.take(y * width + chosen) * width + chosen)


def nearest_of(points: NDArray[np.float64], where: NDArray[np.bool_]) -> NDArray[np.intp]:
    """Return which of some points, as a row of (n, 2), is nearest to each of the k pixels of a mask.

    Examples
    --------
    >>> nearest_of(np.array([[0.0, 0], [9, 0]]), np.array([[True, False, True, True, True, True]])).tolist()
    [0, 0, 0, 0, 1]
    """
    found = np.zeros(where.shape, np.intp)
    for top in range(0, where.shape[0], _TILE):
        for left in range(0, where.shape[1], _TILE):
            tile = np.s_[top : top + _TILE, left : left + _TILE]
            if not where[tile].any():
                continue
            away = np.hypot(*(points - [left + _TILE / 2, top + _TILE / 2]).T)
            # To and from the tile's middle, no pixel goes farther than half its diagonal.
            near = np.flatnonzero(away <= away.min() + 1.5 * _TILE)
            height, width = where[tile].shape
            x = np.arange(left, left + width) - points[near, 0, None]
            y = np.arange(top, top + height) - points[near, 1, None]
            found[tile] = near[(x[:, None] ** 2 + y[..., None] ** 2).argmin(axis=0)]
    return found[where]
