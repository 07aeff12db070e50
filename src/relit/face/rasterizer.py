"""Triangles seen straight from the front: which one is nearest at a pixel, and where in it (a z-buffer)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from relit.runtime.jit import compiled

if TYPE_CHECKING:
    from numpy.typing import NDArray


class Raster(NamedTuple):
    """What is seen of a mesh.

    Attributes
    ----------
    triangle : (H, W) int32 array
        The row of the triangle that is seen, -1 where there is none.
    weights : (H, W, 3) float32 array
        Barycentric coordinates of the pixel's centre in it; 0 where there is none.
    """

    triangle: NDArray[np.int32]
    weights: NDArray[np.float32]

    @property
    def covered(self) -> NDArray[np.bool_]:
        """Where anything is seen."""
        return self.triangle >= 0

    def spread(self, values: NDArray[Any], triangles: NDArray[np.int32]) -> NDArray[np.float32]:
        """Return values that the mesh has at its vertices, (n, ...), at every pixel; 0 where it is not."""
        covered = self.covered
        corners, weights = triangles[self.triangle[covered]], self.weights[covered]
        weights = weights.reshape(*weights.shape, *(1,) * (values.ndim - 1))
        made = np.zeros((*self.triangle.shape, *values.shape[1:]), np.float32)
        made[covered] = sum(weights[:, k] * values.astype(np.float32)[corners[:, k]] for k in range(3))
        return made


def rasterize(vertices: NDArray[np.float64], triangles: NDArray[np.int32], shape: tuple[int, ...]) -> Raster:
    """Look at a mesh.

    Parameters
    ----------
    vertices : (n, 3) array
        ``(x, y)`` in px, and z, growing away from the camera.
    triangles : (m, 3) array
        Rows of vertices, clockwise in the picture; those that run the other way show their backs, and are
        not seen.
    shape : tuple of int
        ``(H, W, ...)`` of the grid.

    Returns
    -------
    Raster

    Examples
    --------
    A small triangle before a large one:

    >>> corners = np.array([[0, 0, 1], [4, 0, 1], [0, 4, 1], [0, 0, 0], [2, 0, 0], [0, 2, 0]], float)
    >>> rasterize(corners, np.array([[0, 1, 2], [3, 4, 5]], np.int32), (4, 4)).triangle
    array([[ 1,  1,  1,  0],
           [ 1,  1,  0,  0],
           [ 1,  0,  0, -1],
           [ 0,  0, -1, -1]], dtype=int32)
    """
    triangle = np.full(shape[:2], -1, np.int32)
    weights = np.zeros((*shape[:2], 3), np.float32)
    _fill(np.ascontiguousarray(vertices), np.ascontiguousarray(triangles), triangle, weights)
    return Raster(triangle, weights)


@compiled
def _fill(
    vertices: NDArray[np.float64],
    triangles: NDArray[np.int32],
    seen: NDArray[np.int32],
    weights: NDArray[np.float32],
) -> None:
    """Draw the triangles, each over those behind it; of two in one place, the first stays."""
    height, width = seen.shape
    nearest = np.full((height, width), np.inf)
    for row in range(len(triangles)):
        a, b, c = vertices[triangles[row, 0]], vertices[triangles[row, 1]], vertices[triangles[row, 2]]
        area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
        if not area > 0:
            continue
        # Clipped as real numbers: what lies far off the grid fits in no index.
        left = max(np.ceil(min(a[0], b[0], c[0])), 0.0)
        right = min(np.floor(max(a[0], b[0], c[0])), width - 1.0)
        top = max(np.ceil(min(a[1], b[1], c[1])), 0.0)
        bottom = min(np.floor(max(a[1], b[1], c[1])), height - 1.0)
        for y in range(int(top), int(bottom) + 1):
            for x in range(int(left), int(right) + 1):
                at_a = ((b[0] - x) * (c[1] - y) - (b[1] - y) * (c[0] - x)) / area
                at_b = ((c[0] - x) * (a[1] - y) - (c[1] - y) * (a[0] - x)) / area
                at_c = 1 - at_a - at_b
                if at_a < -1e-9 or at_b < -1e-9 or at_c < -1e-9:
                    continue
                depth = at_a * a[2] + at_b * b[2] + at_c * c[2]
                if depth < nearest[y, x]:
                    nearest[y, x] = depth
                    seen[y, x] = row
                    weights[y, x, 0] = at_a
                    weights[y, x, 1] = at_b
                    weights[y, x, 2] = at_c
