"""Polygons of a face, from its landmarks: its outline, the hulls of its features, and its axis."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from PIL import Image, ImageDraw

from relit.face.hull import convex_hull
from relit.face.landmarks import Landmarks
from relit.face.schemes import SCHEMES

if TYPE_CHECKING:
    from numpy.typing import NDArray

#: Features that come in pairs, right and left.
IN_PAIRS = ("eyes", "brows", "cheeks")

#: How far the forehead reaches above the brows, in interocular distances, where no landmark tells.
_FOREHEAD = 0.7


def across(landmarks: Landmarks) -> NDArray[np.float64]:
    """Return the unit vector ``(x, y)`` from the right eye to the left one; along x where no eyes tell.

    Examples
    --------
    >>> across(Landmarks([[0, 0], [9, 0], [0, 9]])).tolist()
    [1.0, 0.0]
    """
    eyes = landmarks.eyes
    if eyes is None:
        return np.array([1.0, 0.0])
    right, left = eyes[:, :2]
    return np.asarray((left - right) / np.linalg.norm(left - right))


def face_outline(landmarks: Landmarks) -> NDArray[np.float64]:
    """Return the polygon round the face, ``(m, 2)`` in px: the landmarks' hull, and the forehead.

    Schemes that end at the brows get a forehead of 0.7 interocular distances above them.

    Examples
    --------
    >>> face_outline(Landmarks([[0, 0], [10, 0], [5, 4], [5, 10]])).tolist()
    [[0.0, 0.0], [10.0, 0.0], [5.0, 10.0]]
    """
    scheme = SCHEMES[landmarks.scheme]
    points = landmarks.xy[list(scheme.outline)] if scheme.outline else landmarks.xy
    if scheme.outline and not scheme.has_forehead:
        brows = landmarks.xy[list(landmarks.groups["brows"])]
        x, y = across(landmarks)
        up = np.array([y, -x])
        points = np.vstack([points, brows + _FOREHEAD * landmarks.interocular_distance * up])
    return convex_hull(points)


def feature_hulls(landmarks: Landmarks, names: tuple[str, ...]) -> list[NDArray[np.float64]]:
    """Return the convex hulls, (n, 2) in px, of features of a face: two each of what comes in pairs.

    Examples
    --------
    >>> from relit import detect_landmarks, read_image, sample
    >>> face = detect_landmarks(read_image(sample("target")).pixels)
    >>> len(feature_hulls(face, ("brows", "mouth"))), feature_hulls(face, ("hat",))
    (3, [])
    """
    hulls = []
    for name in names:
        if name not in landmarks.groups:
            continue
        points = landmarks.xy[list(landmarks.groups[name])]
        left = points[:, 0] > np.median(points[:, 0]) if name in IN_PAIRS else np.zeros(len(points), bool)
        hulls += [convex_hull(side) for side in (points[left], points[~left]) if len(side) > 2]
    return hulls


def drawn(polygons: list[NDArray[np.float64]], shape: tuple[int, ...]) -> NDArray[np.bool_]:
    """Return polygons, (n, 2) of (x, y) in px, filled on an empty plane of ``(H, W, ...)``."""
    picture = Image.new("1", (shape[1], shape[0]))
    for polygon in polygons:
        ImageDraw.Draw(picture).polygon([(x, y) for x, y in polygon.tolist()], fill=1)
    return np.array(picture, np.bool_)
