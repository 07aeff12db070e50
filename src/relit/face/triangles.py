"""Delaunay's triangles of points in the plane: no point lies in the circle round one [1]_.

References
----------
.. [1] A. Bowyer, "Computing Dirichlet tessellations", The Computer Journal 24(2), 1981.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

#: Shares of the points' spread. By the first, every point is moved, so that no four lie on a circle and no
#: three on a line: rounding, of 1e-16, can then make no triangles that cross. The second is how far away the
#: triangle lies that all begins with: what it takes from the hull is as thin as the first.
_MOVED, _FAR = 1e-8, 1e7
_FLAT = 1e-13  # twice the area, of the spread squared: what is smaller, or turned over, comes of that move


def delaunay(points: NDArray[np.float64]) -> NDArray[np.int32]:
    """Return the triangles of points.

    Parameters
    ----------
    points : (n, 2) array

    Returns
    -------
    (m, 3) int32 array
        Rows of points, clockwise in the picture. Of points in one place, one is in them; of points on one
        line, there are none.

    Examples
    --------
    >>> delaunay(np.array([[0.0, 0], [4, 0], [0, 4], [4, 4], [2, 1]])).shape
    (4, 3)
    """
    places, first = np.unique(points, axis=0, return_index=True)
    count = len(places)
    spread = max(np.ptp(places, axis=0).max(), np.finfo(float).tiny)
    moves = np.random.default_rng(0).uniform(-_MOVED, _MOVED, places.shape)
    far = _FAR * np.array([[-1, -1], [1, -1], [0, 1]])
    xy = np.vstack([(places - places.mean(axis=0)) / spread + moves, far])
    triangles = np.array([[count, count + 1, count + 2]])
    for point in range(count):
        broken = _round(xy[triangles] - xy[point])
        hole = triangles[broken]
        start, end = hole.ravel(), np.roll(hole, -1, axis=1).ravel()
        # Of the edges of the hole, those within it run both ways.
        rim = ~np.isin(start * len(xy) + end, end * len(xy) + start)
        fan = np.column_stack([start[rim], end[rim], np.full(rim.sum(), point)])
        triangles = np.vstack([triangles[~broken], fan])
    triangles = triangles[(triangles < count).all(axis=1)]
    a, b, c = places[triangles].transpose(1, 2, 0) / spread
    area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
    return np.asarray(first[triangles[area > _FLAT]], np.int32)


def _round(corners: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return which of the circles round triangles, (m, 3, 2), have the origin in them."""
    (ax, ay), (bx, by), (cx, cy) = corners.transpose(1, 2, 0)
    a, b, c = ax * ax + ay * ay, bx * bx + by * by, cx * cx + cy * cy
    return np.asarray(a * (bx * cy - by * cx) + b * (cx * ay - cy * ax) + c * (ax * by - ay * bx) > 0)
