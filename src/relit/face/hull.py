"""The convex hull of points in the plane, by Andrew's monotone chain [1]_.

A face has few enough points for plain Python; the library for hulls takes longer to be imported.

References
----------
.. [1] A. M. Andrew, "Another efficient algorithm for convex hulls in two dimensions", Information Processing
       Letters 9(5), 1979.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray


def convex_hull(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the corners, (m, 2), of the hull of (n, 2) points, from x to y round it; of a line, its ends.

    Examples
    --------
    >>> convex_hull(np.array([[0.0, 0], [10, 0], [5, 4], [5, 0], [5, 10]])).tolist()
    [[0.0, 0.0], [10.0, 0.0], [5.0, 10.0]]
    """
    ordered = np.unique(points, axis=0).tolist()
    corners = _chain(ordered)[:-1] + _chain(ordered[::-1])[:-1]
    return np.array(corners or ordered)


def _chain(points: list[list[float]]) -> list[list[float]]:
    """Return those of points that go along x from which all others lie to the left."""
    kept: list[list[float]] = []
    for x, y in points:
        while len(kept) > 1:
            (x0, y0), (x1, y1) = kept[-2:]
            if (x1 - x0) * (y - y0) > (y1 - y0) * (x - x0):
                break
            kept.pop()
        kept.append([x, y])
    return kept


def polygon_area(corners: NDArray[np.float64]) -> float:
    """Return the area of a polygon, (m, 2), whose corners go round it from x to y.

    Examples
    --------
    >>> polygon_area(np.array([[0.0, 0], [4, 0], [4, 3]]))
    6.0
    """
    x, y = (corners - corners[0]).T
    return float((x * np.roll(y, -1) - np.roll(x, -1) * y).sum() / 2)
