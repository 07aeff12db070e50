"""Where the face ends: a feathered mask from the landmarks, and the way back into the photo."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from PIL import Image, ImageDraw
from scipy.ndimage import distance_transform_edt, gaussian_filter
from scipy.spatial import ConvexHull
from scipy.special import ndtr

from relit.landmarks import SCHEMES, Landmarks
from relit.pixels import from_unit, to_unit

if TYPE_CHECKING:
    from numpy.typing import NDArray

#: Width of the mask's soft edge, inside the outline, in interocular distances.
FEATHER = 0.3

_TAIL = 2.5  # standard deviations of the blur from the middle of the soft edge to its ends

#: How far the forehead reaches above the brows, in interocular distances, where no landmark tells.
_FOREHEAD = 0.7


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
    picture = Image.new("1", (width, height))
    ImageDraw.Draw(picture).polygon([(float(x), float(y)) for x, y in face_outline(landmarks)], fill=1)
    inside = np.asarray(picture, bool)
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


def blend(target: NDArray[Any], relit: NDArray[np.float32], mask: NDArray[np.float32] | None) -> NDArray[Any]:
    """Return the relit face in the target photo, in the target's dtype.

    Parameters
    ----------
    target : (H, W) or (H, W, 3) array
    relit : (H, W) or (H, W, 3) float32 array
        In [0, 1]; a grey target that became coloured has three channels here.
    mask : (H, W) float32 array or None
        Where it is 0 the target stays as it is, bit for bit; None takes all from `relit`.

    Returns
    -------
    (H, W) or (H, W, 3) array
        Of the shape of `relit`.
    """
    if mask is None:
        return from_unit(relit, target.dtype)
    base = np.broadcast_to(target[..., None], relit.shape) if target.ndim < relit.ndim else target
    share = mask if relit.ndim == 2 else mask[..., None]
    mixed = from_unit(share * relit + (1 - share) * to_unit(base), target.dtype)
    return np.where(share > 0, mixed, base)
