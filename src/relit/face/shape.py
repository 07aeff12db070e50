"""The shape of a face: where its surface looks, and how deep it lies, at every pixel.

Of a face, it is the mesh that its landmarks span; without a depth, they lie on a half ellipsoid over its
outline, which is round and has no nose. Of a head, it is a template laid on the landmarks, if they are those
that the detector gives.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from relit.face.head import has_head, seen_head
from relit.face.hull import convex_hull, polygon_area
from relit.face.landmarks import Landmarks
from relit.face.outline import drawn, face_outline
from relit.face.rasterizer import rasterize
from relit.face.triangles import delaunay
from relit.photo.channels import repeated, squared_length
from relit.photo.filters import gaussian
from relit.photo.nearest import nearest_of
from relit.runtime.memo import remembered

if TYPE_CHECKING:
    from numpy.typing import NDArray

# What each of these is worth: docs/leaderboard.md, The constants.
_SMOOTH = 0.02  # standard deviation, in interocular distances, of the blur that hides the facets
_SMOOTH_HEAD = 0.015  # the same, of the template's, which are smaller
_HEIGHT = 0.4  # depth of the ellipsoid over the root of its hull's area: of twelve heads, 0.35 to 0.39


@dataclass(frozen=True, eq=False)
class FaceShape:
    """The surface of a face on a pixel grid.

    Attributes
    ----------
    normals : (H, W, 3) float32 array
        Unit normals ``(x, y, z)``, z growing away from the camera; beyond `head`, the nearest ones.
    depth : (H, W) float32 array
        In px, growing away from the camera.
    inside : (H, W) bool array
        The face, as its outline goes.
    head : (H, W) bool array
        Where the shape is known: the whole head with ears and neck, where a template lies on the landmarks;
        or what they span.
    """

    normals: NDArray[np.float32]
    depth: NDArray[np.float32]
    inside: NDArray[np.bool_]
    head: NDArray[np.bool_]


@remembered
def face_shape(landmarks: Landmarks, shape: tuple[int, ...], *, of: Landmarks | None = None) -> FaceShape:
    """Return the shape of a face.

    Parameters
    ----------
    landmarks : Landmarks
        Where the face is.
    shape : tuple of int
        ``(H, W, ...)`` of the image.
    of : Landmarks, optional
        Whose shape, if it is another face laid over this one: paired landmarks in that face's own photo.

    Returns
    -------
    FaceShape

    Examples
    --------
    A ramp that falls away to the right looks to the right:

    >>> ramp = Landmarks([[0, 0, 0], [9, 0, 9], [9, 9, 9], [0, 9, 0]])
    >>> face_shape(ramp, (10, 10)).normals[5, 5].astype(float).round(2).tolist()
    [0.71, 0.0, -0.71]
    """
    xy, points = landmarks.xy, with_depth(of or landmarks)
    values = np.column_stack([_normals_at(points), points[:, 2]]).astype(np.float32)
    triangles = delaunay(xy)
    seen = rasterize(np.column_stack([xy, np.zeros(len(xy))]), triangles, shape)
    surface = seen.spread(values, triangles)
    outside = ~seen.covered
    surface[outside] = values[nearest_of(xy, outside)]
    return _smoothed(surface, seen.covered, landmarks, _SMOOTH)


@remembered
def head_shape(landmarks: Landmarks, shape: tuple[int, ...], *, of: Landmarks | None = None) -> FaceShape:
    """Return the shape of a head: the template, laid on the landmarks; or `face_shape`, if it cannot be.

    Parameters
    ----------
    landmarks : Landmarks
        Where the face is.
    shape : tuple of int
        ``(H, W, ...)`` of the image.
    of : Landmarks, optional
        Whose shape, if it is another head laid over this one.

    Returns
    -------
    FaceShape
    """
    if has_head(landmarks) and has_head(of or landmarks):
        seen = seen_head(landmarks, shape, of or landmarks)
        if seen is not None:
            return _smoothed(seen.surface, seen.head, landmarks, _SMOOTH_HEAD)
    return face_shape(landmarks, shape, of=of)


def _smoothed(
    surface: NDArray[Any], known: NDArray[np.bool_], landmarks: Landmarks, blur: float
) -> FaceShape:
    """Return a surface of normals and depth, blurred by so many interocular distances."""
    sigma = blur * landmarks.interocular_distance
    smooth = gaussian(surface, sigma, edge="repeated")
    normals, depth = np.ascontiguousarray(smooth[..., :3]), np.ascontiguousarray(smooth[..., 3])
    return FaceShape(
        normals / repeated(np.sqrt(squared_length(normals)), 3),
        depth,
        drawn([face_outline(landmarks)], known.shape),
        known,
    )


def with_depth(landmarks: Landmarks) -> NDArray[np.float64]:
    """Return landmarks as ``(x, y, z)``; those without a depth lie on a half ellipsoid over their face.

    Examples
    --------
    >>> flat = Landmarks([[0, 0], [10, 0], [10, 10], [0, 10], [5, 5]])
    >>> abs(with_depth(flat)[:, 2]).round(1).tolist()
    [0.0, 0.0, 0.0, 0.0, 4.0]
    """
    points = landmarks.points
    if points.shape[1] == 3:
        return points
    outline = face_outline(landmarks)
    hull = convex_hull(outline)
    middle = (outline.min(axis=0) + outline.max(axis=0)) / 2
    # How far out a point is, on the way from the middle to the hull: 0 there, 1 here.
    facing = (np.roll(hull, -1, axis=0) - hull)[:, ::-1] * [1, -1]
    reach = (facing * (hull - middle)).sum(axis=1)
    out = np.clip(((points - middle) @ facing.T / reach).max(axis=1), 0, 1)
    height = _HEIGHT * np.sqrt(polygon_area(hull))
    return np.column_stack([points, -height * np.sqrt(1 - out**2)])


def _normals_at(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the normals at points of a mesh, towards the camera: means of those of the triangles there."""
    triangles = delaunay(points[:, :2])
    a, b, c = (points[triangles[:, corner]] for corner in range(3))
    facets = np.cross(b - a, c - a)  # as long as the triangle is large
    facets *= np.where(facets[:, 2:] > 0, -1, 1)
    normals = np.zeros_like(points)
    for corner in range(3):
        np.add.at(normals, triangles[:, corner], facets)
    normals[~normals.any(axis=1)] = 0, 0, -1  # of points that no triangle took: twins of others
    return np.asarray(normals / np.linalg.norm(normals, axis=1, keepdims=True))
