"""Where a change of light is known, and where it goes.

A method tells how the light changes on the face. It cannot know where the reference shows hair, spectacles
or what is behind, nor under brows, eyes and lips, which differ from person to person: there the change is
carried on from around as a membrane would. What is changed is the skin of the target, beyond the outline of
its face too, less and less with the distance.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.ndimage import distance_transform_edt, gaussian_filter, grey_dilation, white_tophat
from scipy.spatial import ConvexHull

from relit.color import luma
from relit.compose import drawn, face_outline
from relit.guided import guided_filter
from relit.pixels import to_unit
from relit.scale import feature_hulls
from relit.skin import skin_of

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from relit.landmarks import Landmarks

#: How far beyond the face's outline skin is relit, in interocular distances.
REACH = 0.9

_EDGE = 0.06  # interocular distances over which masks turn soft, and guided ones look for an edge
_GUIDE = 0.03  # contrast of an edge, of 1
_FEATURES = ("brows", "eyes", "mouth")
_NONE, _ALL = 0.25, 0.85  # likeness to skin that counts as none, and as all
_GLINT = 0.12  # brightness, of 1, by which a catchlight exceeds what is round it
_WHITE = 0.85  # share of a change that eyes and teeth take, less what colours them


def matte(image: NDArray[Any], landmarks: Landmarks) -> NDArray[np.float32]:
    """Return where the target's skin takes a change, 0 to 1.

    All of the face below the brows; above them, and round the face, what looks like its skin.

    Parameters
    ----------
    image : (H, W) or (H, W, 3) array
        uint8, uint16 or float in [0, 1].
    landmarks : Landmarks

    Returns
    -------
    (H, W) float32 array
        0 from 0.9 interocular distances outside the outline on.
    """
    unit = landmarks.interocular_distance
    inside = drawn([face_outline(landmarks)], image.shape)
    if inside.all() or not inside.any():
        return np.ones(image.shape[:2], np.float32)
    away = np.asarray(distance_transform_edt(~inside), np.float32) / np.float32(REACH * unit)
    near = np.clip(1 - away, 0, 1) ** 2
    likeness = skin_of(image, _skin_area(landmarks, inside)).likeness(image)
    share = np.maximum(likeness, _sure(landmarks, image.shape, unit))
    guide = to_unit(image) if image.ndim == 2 else luma(to_unit(image))
    radius = max(round(_EDGE * unit), 1)
    soft = guided_filter(share, guide, radius, _GUIDE)
    # A little of a likeness is none: it would show as a glow on a plain background.
    return np.asarray(near * np.clip((soft - _NONE) / (_ALL - _NONE), 0, 1), np.float32)


def known(
    target: NDArray[Any],
    reference: NDArray[Any],
    seen: NDArray[np.bool_],
    landmarks: Landmarks,
    *,
    rendered: bool = False,
) -> NDArray[np.float32]:
    """Return where a change of light can be trusted, 0 to 1.

    Parameters
    ----------
    target, reference : (H, W) or (H, W, 3) array
        The latter laid over the former.
    seen : (H, W) bool array
        Where the reference lies within its photo.
    landmarks : Landmarks
        Of the target.
    rendered : bool
        Whether the reference is nobody's face.

    Returns
    -------
    (H, W) float32 array
    """
    unit = landmarks.interocular_distance
    inside = drawn([face_outline(landmarks)], target.shape)
    trust = (distance_transform_edt(inside) > _EDGE * unit).astype(np.float32)
    if not rendered:
        area = _skin_area(landmarks, inside)
        sure = _sure(landmarks, target.shape, unit)
        for image in (target, reference):
            if not (area & seen).any():
                break
            skin = skin_of(image, area & seen)
            # Below the brows, what is dark may lie in a shadow; above, it is hair or a hat.
            hue, all_told = skin.likeness(image, hue_alone=True), skin.likeness(image)
            trust *= sure * hue + (1 - sure) * all_told if image is reference else np.maximum(sure, all_told)
        trust *= seen
        hulls = drawn(feature_hulls(landmarks, _FEATURES), target.shape)
        size = 2 * max(round(_EDGE * unit), 1) + 1
        trust *= 1 - grey_dilation(hulls.astype(np.float32), (size, size))
    # What is beside the unknown is half unknown: a mixed pixel, a lens' blur, an alignment that is off.
    size = 2 * max(round(_EDGE * unit / 2), 1) + 1
    return np.asarray(np.clip(2 * gaussian_filter(trust, size / 2) - 1, 0, 1), np.float32)


def eyes_and_teeth(
    image: NDArray[Any], landmarks: Landmarks
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Return where eyes and teeth are, and the share of a change of light that goes on there.

    Parameters
    ----------
    image : (H, W) or (H, W, 3) array
    landmarks : Landmarks

    Returns
    -------
    white : (H, W) float32 array
        1 between the lids and between the lips.
    share : (H, W) float32 array
        1 on skin, less there, and 0 in catchlights.
    """
    unit = landmarks.interocular_distance
    hulls = feature_hulls(landmarks, ("eyes", "inner_mouth"))
    white = gaussian_filter(drawn(hulls, image.shape).astype(np.float32), _EDGE * unit / 4)
    brightness = to_unit(image) if image.ndim == 2 else luma(to_unit(image))
    size = 2 * max(round(0.06 * unit), 1) + 1
    glint = np.clip(white_tophat(brightness, (size, size)) / _GLINT - 1, 0, 1)
    return white, np.asarray(1 - white * np.maximum(1 - _WHITE, glint), np.float32)


def _skin_area(landmarks: Landmarks, inside: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return the part of the face that is mostly skin; all of it, if nothing else is left."""
    unit = landmarks.interocular_distance
    features = drawn(feature_hulls(landmarks, _FEATURES), inside.shape)
    area = (distance_transform_edt(inside) > 2 * _EDGE * unit) & ~features
    return area if area.any() else inside


def _sure(landmarks: Landmarks, shape: tuple[int, ...], unit: float) -> NDArray[np.float32]:
    """Return where there is face for sure, whatever it looks like: from the brows down to the chin."""
    groups = landmarks.groups
    if "brows" not in groups:
        return drawn([face_outline(landmarks)], shape).astype(np.float32)
    up = _up(landmarks)
    brows = landmarks.xy[list(groups["brows"])]
    outline = face_outline(landmarks)
    below = outline[outline @ up <= (brows @ up).max()]
    points = np.vstack([below, brows])
    mask = drawn([points[ConvexHull(points).vertices]], shape).astype(np.float32)
    return np.asarray(gaussian_filter(mask, _EDGE * unit / 2))


def _up(landmarks: Landmarks) -> NDArray[np.float64]:
    eyes = landmarks.eyes
    if eyes is None:
        return np.array([0.0, -1.0])
    right, left = eyes[:, :2]
    across = (left - right) / np.linalg.norm(left - right)
    return np.array([across[1], -across[0]])
