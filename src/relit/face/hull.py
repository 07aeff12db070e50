"""The convex hull of points in the plane, and the area of a polygon."""

from __future__ import annotations

from typing import TYPE_CHECKING

import cv2
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
    # OpenCV looks at float32, which is finest near 0.
    near = (points - points.min(axis=0)).astype(np.float32)
    return np.asarray(points[cv2.convexHull(near, clockwise=False, returnPoints=False)[:, 0]])


def polygon_area(corners: NDArray[np.float64]) -> float:
    """Return the area of a polygon, (m, 2), whose corners go round it from x to y.

    Examples
    --------
    >>> polygon_area(np.array([[0.0, 0], [4, 0], [4, 3]]))
    6.0
    """
    x, y = (corners - corners[0]).T
    return float((x * np.roll(y, -1) - np.roll(x, -1) * y).sum() / 2)
