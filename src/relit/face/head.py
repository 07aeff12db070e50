"""A head in a photo: the template, posed and bent so that its landmarks lie on those of the face.

The pose is a scaled orthographic projection [1]_. What it leaves is taken up by a bend of space, which is
the smoothest one (biharmonic splines [2]_) that leads the template's landmarks to the face's; farther off, at
the ears, the skull and the neck, it fades to a shift.

References
----------
.. [1] D. F. DeMenthon and L. S. Davis, "Model-based object pose in 25 lines of code", IJCV 15, 1995.
.. [2] G. Wahba, "Spline Models for Observational Data", SIAM, 1990.
"""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from scipy.ndimage import distance_transform_edt
from scipy.spatial.distance import cdist

from relit.face.landmarks import Landmarks
from relit.face.rasterizer import rasterize
from relit.face.template_head import template_head, vertex_normals
from relit.runtime.threads import one_blas_thread

if TYPE_CHECKING:
    from numpy.typing import NDArray

# How far the bend may miss a landmark, as the spline's smoothing in interocular distances: the detector is
# much surer of where a point is seen than of its depth. Of twelve rendered heads; half or twice as much is as
# good.
_SMOOTHING, _SMOOTHING_OF_DEPTH = 0.1, 2.0


class SeenHead(NamedTuple):
    """A head on a pixel grid.

    Attributes
    ----------
    surface : (H, W, 4) array
        Normals ``(x, y, z)``, z growing away from the camera and never above 0, and the depth in px; off the
        head, the nearest ones.
    head : (H, W) bool array
        Where the head is.
    """

    surface: NDArray[Any]
    head: NDArray[np.bool_]


def has_head(landmarks: Landmarks) -> bool:
    """Return whether the template can be laid on landmarks: they are the mesh, and have a depth."""
    return landmarks.scheme == "mesh478" and landmarks.points.shape[1] == 3


def seen_head(landmarks: Landmarks, shape: tuple[int, ...], of: Landmarks) -> SeenHead | None:
    """Return the head in a photo, None if nothing of it is in the frame.

    Parameters
    ----------
    landmarks : Landmarks
        Where the head is.
    shape : tuple of int
        ``(H, W, ...)`` of the photo.
    of : Landmarks
        Whose head; if not the same, it is laid over this one.
    """
    triangles = template_head().triangles
    place = fitted(landmarks)
    surface = place if of is landmarks else fitted(of)
    raster = rasterize(place, triangles, shape)
    if not raster.covered.any():
        return None
    spread = raster.spread(np.column_stack([vertex_normals(surface, triangles), surface[:, 2]]), triangles)
    # Interpolated over a facet at the rim, or of another pose, they may look a little away.
    spread[..., 2] = np.minimum(spread[..., 2], 0)
    nearest = distance_transform_edt(~raster.covered, return_distances=False, return_indices=True)
    return SeenHead(spread[tuple(nearest)], raster.covered)


def fitted(landmarks: Landmarks) -> NDArray[np.float64]:
    """Return the vertices of the template, laid on a face: ``(x, y, z)`` in px.

    Parameters
    ----------
    landmarks : Landmarks
        Of the mesh, with a depth.

    Returns
    -------
    (n, 3) float64 array

    Examples
    --------
    >>> from relit import detect_landmarks, read_image, sample
    >>> face = detect_landmarks(read_image(sample("target")).pixels)
    >>> vertices = fitted(face)
    >>> tip = np.argmin(np.linalg.norm(vertices[:, :2] - face.xy[4], axis=1))
    >>> bool(vertices[tip, 2] < np.median(vertices[:, 2]))  # the tip of the nose is near the camera
    True
    """
    template = template_head()
    there = landmarks.points[template.rows]
    with one_blas_thread():
        turn, origin = pose(template.landmarks, there)
        missing = there - (template.landmarks @ turn + origin)
        bend = _bend()
        weights = np.column_stack([bend.of_places @ missing[:, :2], bend.of_depths @ missing[:, 2]])
        return np.asarray(template.vertices @ turn + origin + bend.basis @ weights)


def pose(points: NDArray[Any], there: NDArray[Any]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the similarity ``points @ turn + origin`` that fits best to ``(x, y)`` there, z at its scale.

    Parameters
    ----------
    points, there : (n, 3) array
        Of `there`, the depth tells only how far away all of it is.

    Returns
    -------
    turn : (3, 3) float64 array
        A rotation times a scale.
    origin : (3,) float64 array
    """
    middle, center = points.mean(axis=0), there.mean(axis=0)
    affine = np.linalg.lstsq(points - middle, (there - center)[:, :2], rcond=None)[0]
    u, scales, vt = np.linalg.svd(affine, full_matrices=False)
    x, y = (u @ vt).T
    turn = scales.mean() * np.stack([x, y, np.cross(x, y)], axis=1)
    return turn, center - middle @ turn


class _Bend(NamedTuple):
    """A smoothing spline: what moves landmarks moves vertices by ``basis @ (solution @ moves)``."""

    basis: NDArray[np.float64]
    of_places: NDArray[np.float64]
    of_depths: NDArray[np.float64]


@cache
def _bend() -> _Bend:
    template = template_head()
    return _Bend(
        np.column_stack([-cdist(template.vertices, template.landmarks), np.ones(len(template.vertices))]),
        _solution(template.landmarks, _SMOOTHING),
        _solution(template.landmarks, _SMOOTHING_OF_DEPTH),
    )


def _solution(points: NDArray[np.float64], smoothing: float) -> NDArray[np.float64]:
    """Return the matrix from values at points to the spline's weights there, and its constant."""
    n = len(points)
    system = np.ones((n + 1, n + 1))
    system[:n, :n] = smoothing * np.eye(n) - cdist(points, points)
    system[n, n] = 0
    return np.asarray(np.linalg.inv(system)[:, :n])
