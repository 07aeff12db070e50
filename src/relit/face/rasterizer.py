"""Triangles seen straight from the front: which one is nearest at a pixel, and where in it (a z-buffer)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

_AT_ONCE = 2**17  # px of triangles that are looked at together: a large grid takes no more memory
_SLACK = 1e-6  # px by which a span may be too long, so that rounding makes none too short
_OUT = -1e-9  # how little of a corner still counts as none: a pixel on an edge is in one triangle at least


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
        made = np.zeros((*self.triangle.shape, *values.shape[1:]), np.float32)
        made[self.covered] = self.seen(values, triangles)
        return made

    def seen(self, values: NDArray[Any], triangles: NDArray[np.int32]) -> NDArray[np.float32]:
        """Return values that the mesh has at its vertices, (n, ...), at the k pixels where it is."""
        there = np.flatnonzero(self.covered)
        corners = triangles.take(self.triangle.take(there), axis=0)
        weights = self.weights.reshape(-1, 3).take(there, axis=0)
        weights = weights.reshape(*weights.shape, *(1,) * (values.ndim - 1))
        values = values.astype(np.float32)
        made: NDArray[np.float32] = weights[:, 0] * values.take(corners[:, 0], axis=0)
        for corner in (1, 2):
            made += weights[:, corner] * values.take(corners[:, corner], axis=0)
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
    spans = _spans(vertices, triangles, shape)
    seen = np.full(shape[0] * shape[1], -1, np.int32)
    weights = np.zeros((len(seen), 3), np.float32)
    nearest = np.full(len(seen), np.inf)
    part = np.cumsum(spans.width) // _AT_ONCE
    for some in np.split(np.arange(len(part)), np.flatnonzero(np.diff(part)) + 1):
        _draw(_Spans(*(each[..., some] for each in spans)), shape[1], nearest, seen, weights)
    return Raster(seen.reshape(shape[:2]), weights.reshape(*shape[:2], 3))


class _Spans(NamedTuple):
    """The rows of px of triangles, in the order of these.

    What a px has of the corners a and b, and its depth, are ``start + (x - left) · rise`` along one.
    """

    triangle: NDArray[Any]
    y: NDArray[Any]
    left: NDArray[Any]
    width: NDArray[Any]
    start: NDArray[Any]  # (3, n)
    rise: NDArray[Any]


def _spans(vertices: NDArray[np.float64], triangles: NDArray[np.int32], shape: tuple[int, ...]) -> _Spans:
    """Return the px of the triangles that show their fronts; at the ends of a row, one may be outside."""
    xy = vertices[triangles, :2]
    (ax, ay), (bx, by), (cx, cy) = xy.transpose(1, 2, 0)
    area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
    # Clipped as real numbers: what lies far off the grid fits in no index.
    first = np.maximum(np.ceil(xy.min(axis=1)), 0)
    last = np.minimum(np.floor(xy.max(axis=1)), [shape[1] - 1, shape[0] - 1])
    front = np.flatnonzero((area > 0) & (first <= last).all(axis=1))

    # Of the boxes' first px: what it has of each corner, and its depth; and how that rises along x and y.
    (left, top), (width, height) = first[front].T, (last - first + 1)[front].T.astype(int)
    corners = vertices[triangles[front]].transpose(2, 1, 0)
    (ax, bx, cx), (ay, by, cy), depth = corners - np.stack([left, top, np.zeros_like(left)])[:, None]
    start, along, down = (
        np.stack(of) / area[front]
        for of in (
            (bx * cy - by * cx, cx * ay - cy * ax, ax * by - ay * bx),
            (by - cy, cy - ay, ay - by),
            (cx - bx, ax - cx, bx - ax),
        )
    )
    start, along, down = (np.vstack([of, (of * depth).sum(axis=0)]) for of in (start, along, down))

    row = np.repeat(np.arange(len(front)), height)
    below = _counted(np.zeros_like(height), height)
    start, along = start.take(row, axis=1) + down.take(row, axis=1) * below, along.take(row, axis=1)
    # No px has less than nothing of a corner: that holds from some x on, or up to it.
    with np.errstate(divide="ignore", invalid="ignore"):
        nothing = -start[:3] / along[:3]
    begin = np.ceil(np.where(along[:3] > 0, nothing, 0).max(axis=0) - _SLACK)
    end = np.floor(np.where(along[:3] < 0, nothing, np.inf).min(axis=0) + _SLACK)
    begin = np.maximum(begin, 0).astype(int)
    end = np.minimum(end, width[row] - 1).astype(int)
    return _Spans(
        front[row],
        top.astype(int)[row] + below,
        left.astype(int)[row] + begin,
        np.maximum(end - begin + 1, 0),
        start[[0, 1, 3]] + along[[0, 1, 3]] * begin,
        along[[0, 1, 3]],
    )


def _counted(first: NDArray[np.intp], count: NDArray[np.intp]) -> NDArray[np.intp]:
    """Return the numbers from each of `first` on, so many of them, one after the other."""
    ends = np.cumsum(count)
    return np.arange(count.sum()) + np.repeat(first - ends + count, count)


def _draw(
    spans: _Spans,
    width: int,
    nearest: NDArray[np.float64],
    seen: NDArray[np.int32],
    weights: NDArray[np.float32],
) -> None:
    """Draw spans of triangles over those behind them; of two in one place, the first stays."""
    span = np.repeat(np.arange(len(spans.width)), spans.width)
    along = _counted(np.zeros_like(spans.width), spans.width)
    at_a, at_b, depth = spans.start.take(span, axis=1) + spans.rise.take(span, axis=1) * along
    at_c = 1 - at_a - at_b
    place = (spans.y * width + spans.left).take(span) + along
    inside = (at_a >= _OUT) & (at_b >= _OUT) & (at_c >= _OUT)
    drawn = np.flatnonzero(inside & (depth < nearest[place]))
    np.minimum.at(nearest, place[drawn], depth[drawn])
    drawn = drawn[depth[drawn] == nearest[place[drawn]]][::-1]  # the last to be written is the first
    seen[place[drawn]] = spans.triangle[span[drawn]]
    weights[place[drawn]] = np.stack([at_a[drawn], at_b[drawn], at_c[drawn]], axis=1)
