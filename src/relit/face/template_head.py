"""The template head: the mean of many MakeHuman heads, with nose, eye sockets, ears, skull and neck.

How they differ comes with it, as modes. `tools/template_head.py` makes both. All are symmetric, so that the
file holds one half. The unit is the interocular distance, the origin the middle of the eyes; x grows to the
left ear, y down, z to the back of the head.
"""

from __future__ import annotations

from functools import cache
from importlib import resources
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from relit.photo.channels import squared_distances

if TYPE_CHECKING:
    from numpy.typing import NDArray

#: Steps per interocular distance in which the file counts.
STEPS = 10_000
#: Steps of the largest move of a mode.
MODE_STEPS = 127
_NEIGHBOURS = 4  # vertices that a landmark moves with


class TemplateHead(NamedTuple):
    """A head as a mesh, and where landmarks lie on it.

    Attributes
    ----------
    vertices : (n, 3) float64 array
    triangles : (m, 3) int32 array
        Rows of vertices, clockwise where their front is seen.
    rows : (k,) int array
        Which rows of `mesh478` are known.
    landmarks : (k, 3) float64 array
        Where they lie.
    modes : (l, n, 3) float32 array
        The ways that heads differ most, of one standard deviation each.
    landmark_modes : (l, k, 3) float64 array
        The same of the landmarks.
    """

    vertices: NDArray[np.float64]
    triangles: NDArray[np.int32]
    rows: NDArray[np.int64]
    landmarks: NDArray[np.float64]
    modes: NDArray[np.float32]
    landmark_modes: NDArray[np.float64]


@cache
def template_head() -> TemplateHead:
    """Return the template.

    Examples
    --------
    >>> head = template_head()
    >>> [len(part) for part in head]
    [4191, 8204, 419, 419, 60, 60]
    """
    with resources.files("relit.face").joinpath("models", "head.npz").open("rb") as file:
        stored = np.load(file)
        half, quads, rows, places, moves, most = (
            stored[name] for name in ("vertices", "quads", "rows", "landmarks", "modes", "most")
        )
    vertices, triangles = whole(half / STEPS, quads.astype(np.int32))
    landmarks = places / STEPS
    there = half[:, 0] > 0
    modes = moves * (most.astype(float) / MODE_STEPS)[:, None, None]
    modes = np.concatenate([modes, modes[:, there] * [-1, 1, 1]], axis=1)
    square = squared_distances(landmarks, vertices)
    near = square.argpartition(_NEIGHBOURS, axis=1)[:, :_NEIGHBOURS]
    share = 1 / np.maximum(np.take_along_axis(square, near, axis=1), 1 / STEPS**2)
    share /= share.sum(axis=1, keepdims=True)
    return TemplateHead(
        vertices,
        triangles,
        rows.astype(np.int64),
        landmarks,
        modes.astype(np.float32),
        np.ascontiguousarray(np.einsum("lknx,kn->lkx", modes[:, near], share)),
    )


def whole(
    vertices: NDArray[np.float64], quads: NDArray[np.int32]
) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
    """Return vertices and triangles of a mesh of which the half with x ≥ 0 is given, in quadrilaterals.

    Examples
    --------
    >>> vertices, triangles = whole(np.array([[0.0, 0], [2, 0], [2, 1], [0, 1]]), np.array([[0, 1, 2, 3]]))
    >>> vertices[:, 0].tolist(), triangles.tolist()
    ([0.0, 2.0, 2.0, 0.0, -2.0, -2.0], [[0, 1, 2], [0, 3, 5], [0, 2, 3], [0, 5, 4]])
    """
    off = vertices[:, 0] > 0
    twin = np.arange(len(vertices))
    twin[off] = len(vertices) + np.arange(np.count_nonzero(off))
    other = vertices[off].copy()
    other[:, 0] *= -1
    both = np.concatenate([quads, twin[quads][:, [0, 3, 2, 1]]])
    triangles = np.concatenate([both[:, [0, 1, 2]], both[:, [0, 2, 3]]])
    return np.concatenate([vertices, other]), triangles.astype(np.int32)


def vertex_normals(vertices: NDArray[Any], triangles: NDArray[np.int32]) -> NDArray[np.float64]:
    """Return the unit normals of a mesh at its vertices: means of those of the triangles there, by area.

    Examples
    --------
    Clockwise in the picture, it looks at the camera:

    >>> vertex_normals(np.array([[0, 0, 5], [9, 0, 5], [0, 9, 5]]), np.array([[0, 1, 2]]))[0].tolist()
    [0.0, 0.0, -1.0]
    """
    a, b, c = (vertices[triangles[:, corner]] for corner in range(3))
    facets = np.cross(c - a, b - a)  # as long as the triangle is large
    normals = np.stack(
        [np.bincount(triangles.ravel(), np.repeat(facets[:, axis], 3), len(vertices)) for axis in range(3)],
        axis=-1,
    )
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    return np.where(lengths > 0, normals / np.where(lengths > 0, lengths, 1), (0.0, 0.0, -1.0)) + 0.0
