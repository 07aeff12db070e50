"""A head in a photo: of all that heads may be, the likeliest with its landmarks where those of the face are.

The pose is a scaled orthographic projection [1]_. The shape is the mean of heads and some of each way that
they differ, as likely as may be [2]_. What both leave is taken up by a bend of space, which is the smoothest
one (biharmonic splines [3]_) that leads the landmarks to the face's; farther off, at the ears, the skull and
the neck, it fades to a shift.

References
----------
.. [1] D. F. DeMenthon and L. S. Davis, "Model-based object pose in 25 lines of code", IJCV 15, 1995.
.. [2] V. Blanz and T. Vetter, "A morphable model for the synthesis of 3D faces", SIGGRAPH 1999.
.. [3] G. Wahba, "Spline Models for Observational Data", SIAM, 1990.
"""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING, Any, NamedTuple

import cv2
import numpy as np

from relit.face.landmarks import Landmarks
from relit.face.rasterizer import Raster, rasterize
from relit.face.template_head import template_head, vertex_normals
from relit.photo.channels import squared_distances
from relit.photo.nearest import nearest_in
from relit.runtime.memo import remembered
from relit.runtime.threads import one_blas_thread

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from relit.face.template_head import TemplateHead

# How far the bend may miss a landmark, as the spline's smoothing in interocular distances: the detector is
# much surer of where a point is seen than of its depth. Of twelve rendered heads; half or twice as much is as
# good.
_SMOOTHING, _SMOOTHING_OF_DEPTH = 0.1, 2.0
# How far landmarks are off, in interocular distances, as seen and in depth. Of twelve rendered heads; half or
# one and a half times as much is nearly as good.
_OFF, _OFF_IN_DEPTH = 0.04, 0.1
_LITTLE, _MUCH = 18.0, 32.0  # degrees between two heads at which light stays, and goes with the head
_ROUNDS = 6  # of pose and shape


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
    surface = fitted(of)
    drawn = raster_of(landmarks, shape[:2])
    if drawn is None:
        return None
    raster, covered, nearest = drawn
    seen = raster.seen(np.column_stack([vertex_normals(surface, triangles), surface[:, 2]]), triangles)
    # Interpolated over a facet at the rim, or of another pose, they may look a little away.
    seen[:, 2] = np.minimum(seen[:, 2], 0)
    return SeenHead(seen.take(nearest, axis=0), covered)


@remembered
def raster_of(
    landmarks: Landmarks, shape: tuple[int, ...]
) -> tuple[Raster, NDArray[np.bool_], NDArray[np.intp]] | None:
    """Return a head as it is drawn, where it is, and which of its pixels each one is nearest to; or None."""
    raster = rasterize(fitted(landmarks), template_head().triangles, shape)
    covered = raster.covered
    if not covered.any():
        return None
    number = np.cumsum(covered) - 1
    return raster, covered, number[nearest_in(covered)]


@remembered
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
        kind = _likeliest(template, there)
        marks = template.landmarks + np.tensordot(kind, template.landmark_modes, 1)
        vertices = template.vertices + np.tensordot(kind.astype(np.float32), template.modes, 1)
        turn, origin = pose(marks, there)
        missing = there - (marks @ turn + origin)
        bend = _bend()
        weights = np.column_stack([bend.of_places @ missing[:, :2], bend.of_depths @ missing[:, 2]])
        return np.asarray(vertices @ turn + origin + bend.basis @ weights.astype(np.float32))


def _likeliest(template: TemplateHead, there: NDArray[Any]) -> NDArray[np.float64]:
    """Return how much of each mode there is, in standard deviations: the ridge regression on landmarks.

    With M the modes, R the rotation and W the weights of the axes, ``(Σ M R W R' M' + 1) kind = Σ M R W d``
    is solved, d being by how much landmarks are missed.
    """
    modes, products = template.landmark_modes, _products()
    weight = np.divide(1, np.square([_OFF, _OFF, _OFF_IN_DEPTH]))
    kind = np.zeros(len(modes))
    for _ in range(_ROUNDS):
        moved = np.tensordot(kind, modes, 1)
        turn, origin = pose(template.landmarks + moved, there)
        scale = np.cbrt(np.linalg.det(turn))
        rotation = turn / scale
        missing = (there - (template.landmarks @ turn + origin)) / scale
        # How far off the camera all of it is, nobody knows.
        missing[:, 2] -= np.median(missing[:, 2] - moved @ rotation[:, 2])
        weighted = rotation * weight
        square = np.tensordot(weighted @ rotation.T, products, 2) + np.eye(len(kind))
        right = modes.reshape(len(kind), -1) @ (missing @ weighted.T).ravel()
        kind = np.linalg.solve(square, right)
    return kind


@cache
def _products() -> NDArray[np.float64]:
    """Return ``Σ M_a M_b'`` over the landmarks, for each two of the axes: (3, 3, l, l)."""
    modes = np.moveaxis(template_head().landmark_modes, -1, 0)
    return np.asarray(modes[:, None] @ modes[None].swapaxes(-1, -2))


def turn_between(one: Landmarks, other: Landmarks) -> NDArray[np.float64]:
    """Return the rotation R, ``x @ R``, by which the light on a head in one photo is turned for another.

    Light stays where it stands beside the camera, as long as both heads are held nearly alike. If one is
    turned much farther, it hides what the light does to sides that the other shows, and what it shows is not
    its front: then light goes with the head, as landmarks do.

    Parameters
    ----------
    one, other : Landmarks

    Returns
    -------
    (3, 3) float64 array
        That of no turn, where a template cannot be laid on both.

    Examples
    --------
    >>> from relit import detect_landmarks, read_image, sample
    >>> face = detect_landmarks(read_image(sample("target")).pixels)
    >>> turn_between(face, face).round(6).tolist()
    [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
    """
    if not (has_head(one) and has_head(other)):
        return np.eye(3)
    template = template_head()
    with one_blas_thread():
        first, second = (
            turn / np.cbrt(np.linalg.det(turn))
            for turn, _ in (pose(template.landmarks, face.points[template.rows]) for face in (one, other))
        )
        axis, _ = cv2.Rodrigues(first.T @ second)  # as long as the angle is large
    angle = float(np.degrees(np.linalg.norm(axis)))
    share = np.clip((angle - _LITTLE) / (_MUCH - _LITTLE), 0, 1)
    return np.asarray(cv2.Rodrigues(share * axis)[0])


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

    basis: NDArray[np.float32]
    of_places: NDArray[np.float64]
    of_depths: NDArray[np.float64]


@cache
def _bend() -> _Bend:
    template = template_head()
    return _Bend(
        np.column_stack(
            [-_distances(template.vertices, template.landmarks), np.ones(len(template.vertices))]
        ).astype(np.float32),
        _solution(template.landmarks, _SMOOTHING),
        _solution(template.landmarks, _SMOOTHING_OF_DEPTH),
    )


def _solution(points: NDArray[np.float64], smoothing: float) -> NDArray[np.float64]:
    """Return the matrix from values at points to the spline's weights there, and its constant."""
    n = len(points)
    system = np.ones((n + 1, n + 1))
    system[:n, :n] = smoothing * np.eye(n) - _distances(points, points)
    system[n, n] = 0
    return np.asarray(np.linalg.inv(system)[:, :n])


def _distances(points: NDArray[np.float64], others: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.asarray(np.sqrt(squared_distances(points, others)))
