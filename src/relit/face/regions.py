"""Where a face ends, and its parts: masks drawn from the landmarks."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from PIL import Image, ImageDraw
from scipy.ndimage import distance_transform_edt, gaussian_filter
from scipy.spatial import ConvexHull
from scipy.special import ndtr

from relit.errors import LandmarkError
from relit.face.landmarks import Landmarks
from relit.face.schemes import SCHEMES

if TYPE_CHECKING:
    from numpy.typing import NDArray

#: Width of the mask's soft edge, inside the outline, in interocular distances.
FEATHER = 0.3

_TAIL = 2.5  # standard deviations of the blur from the middle of the soft edge to its ends

#: How far the forehead reaches above the brows, in interocular distances, where no landmark tells.
_FOREHEAD = 0.7

_SOFT_EDGE, _PART_MARGIN = 0.08, 0.12  # of the parts of a face, in interocular distances
_IN_PAIRS = ("eyes", "brows", "cheeks")


def face_mask(
    landmarks: Landmarks, shape: tuple[int, ...], *, feather: float = FEATHER
) -> NDArray[np.float32]:
    """Return where the face is: 1 inside, falling smoothly to 0 at its outline.

    Parameters
    ----------
    landmarks : Landmarks
        Of the target. Schemes that end at the brows get a forehead of 0.7 interocular distances above them.
    shape : tuple of int
        ``(H, W, ...)`` of the target.
    feather : float
        Width of the soft edge in interocular distances.

    Returns
    -------
    (H, W) float32 array
        In [0, 1]; exactly 0 from two pixels outside the outline on.

    Examples
    --------
    >>> face = Landmarks([[20, 20], [80, 20], [80, 90], [20, 90]])
    >>> mask = face_mask(face, (100, 100))
    >>> float(mask[5, 50]), float(mask[60, 50])
    (0.0, 1.0)
    """
    height, width = shape[:2]
    inside = drawn([face_outline(landmarks)], shape)
    if inside.all():
        return np.ones((height, width), np.float32)
    # A face shrunk by half the feather and blurred over it. Beyond the frame the face goes on: the frame's
    # edge is not an edge of the face.
    band = max(feather * landmarks.interocular_distance, 1.0)
    core = (distance_transform_edt(inside) >= band / 2).astype(np.float32)
    soft = gaussian_filter(core, band / (2 * _TAIL), mode="nearest")
    least = float(ndtr(-_TAIL))  # what the blur leaves on a straight outline
    return np.asarray(np.clip((soft - least) / (1 - 2 * least), 0, 1) * inside, np.float32)


def face_outline(landmarks: Landmarks) -> NDArray[np.float64]:
    """Return the polygon round the face, ``(m, 2)`` in px: the landmarks' hull, and the forehead.

    Examples
    --------
    >>> face_outline(Landmarks([[0, 0], [10, 0], [5, 4], [5, 10]])).tolist()
    [[0.0, 0.0], [10.0, 0.0], [5.0, 10.0]]
    """
    scheme = SCHEMES[landmarks.scheme]
    points = landmarks.xy[list(scheme.outline)] if scheme.outline else landmarks.xy
    if scheme.outline and not scheme.has_forehead:
        brows = landmarks.xy[list(landmarks.groups["brows"])]
        right = landmarks.xy[list(scheme.right_eye)].mean(axis=0)
        left = landmarks.xy[list(scheme.left_eye)].mean(axis=0)
        up = np.array([(left - right)[1], (right - left)[0]]) / np.linalg.norm(left - right)
        points = np.vstack([points, brows + _FOREHEAD * landmarks.interocular_distance * up])
    return np.asarray(points[ConvexHull(points).vertices])


def part_mask(landmarks: Landmarks, shape: tuple[int, ...], region: str) -> NDArray[np.float32]:
    """Return where parts of a face are, 0 to 1, with soft edges that meet halfway.

    Parameters
    ----------
    landmarks : Landmarks
    shape : tuple of int
        ``(H, W, ...)`` of the image.
    region : str
        As in `TransferOptions`.

    Returns
    -------
    (H, W) float32 array

    Raises
    ------
    LandmarkError
        If the scheme of the landmarks does not know a part.

    Examples
    --------
    >>> face = Landmarks([[20, 20], [80, 20], [80, 90], [20, 90]])
    >>> mask = part_mask(face, (100, 100), "left")
    >>> mask[50, [5, 95]].round(3).tolist()
    [1.0, 0.0]
    """
    masks = [_part(landmarks, shape, name) for name in region.split("+")]
    return np.asarray(np.max(masks, axis=0), np.float32)


def _part(landmarks: Landmarks, shape: tuple[int, ...], name: str) -> NDArray[np.float32]:
    unit = landmarks.interocular_distance
    if name == "face":
        return np.ones(shape[:2], np.float32)
    if name in ("left", "right"):
        middle, across = _halves(landmarks)
        y, x = np.indices(shape[:2], np.float32)
        off = ((x - middle[0]) * across[0] + (y - middle[1]) * across[1]) / (_SOFT_EDGE * unit)
        return np.asarray(ndtr(off if name == "right" else -off), np.float32)
    rows = landmarks.groups.get(name)
    if rows is None:
        raise LandmarkError(
            f"region: these landmarks ({landmarks.scheme}) do not say where the {name} is; let them be "
            "detected, or choose another part"
        )
    sides = landmarks.xy[list(rows)]
    if name in _IN_PAIRS:
        middle, across = _halves(landmarks)
        right = (sides - middle) @ across > 0
        groups = [sides[right], sides[~right]]
    else:
        groups = [sides]
    # Of a face in profile one side may have no points, and those of a chin may lie on one line.
    hulls = drawn(
        [points[ConvexHull(points, qhull_options="QJ").vertices] for points in groups if len(points) > 2],
        shape,
    )
    larger = distance_transform_edt(~hulls) <= _PART_MARGIN * unit
    return np.asarray(gaussian_filter(larger.astype(np.float32), _SOFT_EDGE * unit))


def _halves(landmarks: Landmarks) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the middle of a face, and the unit vector across it to the right of the picture."""
    if landmarks.eyes is None:
        outline = face_outline(landmarks)
        return (outline.min(axis=0) + outline.max(axis=0)) / 2, np.array([1.0, 0.0])
    right, left = landmarks.eyes[:, :2]
    across = (left - right) / np.linalg.norm(left - right)
    return (left + right) / 2, across if across[0] >= 0 else -across


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
        left = points[:, 0] > np.median(points[:, 0]) if name in _IN_PAIRS else np.zeros(len(points), bool)
        hulls += [side[ConvexHull(side).vertices] for side in (points[left], points[~left]) if len(side) > 2]
    return hulls


def drawn(polygons: list[NDArray[np.float64]], shape: tuple[int, ...]) -> NDArray[np.bool_]:
    """Return polygons, (n, 2) of (x, y) in px, filled on an empty plane."""
    picture = Image.new("1", (shape[1], shape[0]))
    for polygon in polygons:
        ImageDraw.Draw(picture).polygon([(x, y) for x, y in polygon.tolist()], fill=1)
    return np.array(picture, np.bool_)
