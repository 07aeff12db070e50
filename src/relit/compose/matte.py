"""Where a change of light is known, and where it goes.

A method tells how the light changes on the face. It cannot know where the reference shows hair, spectacles
or what is behind, nor under brows, eyes and lips, which differ from person to person: there the change is
carried on from around as a membrane would. What is changed is the skin of the target, beyond the outline of
its face too, less and less with the distance.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.ndimage import distance_transform_edt, gaussian_filter, grey_closing, grey_dilation, white_tophat
from scipy.sparse import coo_array
from scipy.sparse.csgraph import dijkstra
from scipy.spatial import ConvexHull

from relit.compose.guided_filter import guided_filter
from relit.face.regions import drawn, face_outline, feature_hulls
from relit.face.skin import skin_of
from relit.photo.color import luma
from relit.photo.pixels import to_unit
from relit.photo.resampling import Enlarger, reduced
from relit.runtime.memo import remembered
from relit.solver.neighborhoods import paired

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from relit.face.landmarks import Landmarks

#: How far beyond the face's outline skin is relit, in interocular distances.
REACH = 0.9

_CELLS = 24  # that the interocular distance has, where the way from the face is looked for
_SIDEWAYS = 2.0  # how much farther it is across a face than along it
_BARRIER, _TEXTURE = 0.6, 1.0  # how far away an edge makes things, per standard deviation of the skin above
_EDGE = 0.06  # interocular distances over which masks turn soft, and guided ones look for an edge
_GUIDE = 0.03  # contrast of an edge, of 1
_FEATURES = ("brows", "eyes", "mouth")
_NONE, _ALL = 0.3, 0.9  # likeness to skin that counts as none, and as all
_HOLE = 0.12  # interocular distances: holes in the skin smaller than this are none
_FULL = 0.35  # of the reach, over which all of a change goes on
_RIM_RENDERED, _RIM = (
    0.04,
    0.1,
)  # interocular distances: at the outline a mesh is seen too flatly to shade well
_OVERHANG = 0.12  # interocular distances
_LAST = 0.1  # of the reach, over which the last of a change goes
_GRAIN = 0.015  # interocular distances
_FAINT = 0.04  # share of a change that nobody sees
_GLINT = 0.12  # brightness, of 1, by which a catchlight exceeds what is round it
_WHITE = 0.85  # share of a change that eyes and teeth take, less what colours them


@remembered
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
    smooth = _smooth(image, unit)
    skin = skin_of(smooth, _skin_area(landmarks, inside))
    near = np.clip((1 - _away(skin.whitened(smooth), inside, unit, _up(landmarks))) / (1 - _FULL), 0, 1)
    near = near**2 * (3 - 2 * near)
    # A little of a likeness is none: it would show as a glow on a plain background.
    like = np.clip((skin.likeness(smooth) - _NONE) / (_ALL - _NONE), 0, 1)
    # A highlight on skin, a mole, a strand of hair: the light falls on them too.
    size = 2 * max(round(_HOLE * unit / 2), 1) + 1
    like = grey_closing(like, (size, size))
    share = near * np.maximum(like, _sure(landmarks, image.shape, unit))
    guide = to_unit(image) if image.ndim == 2 else luma(to_unit(image))
    soft = guided_filter(share, guide, max(round(_EDGE * unit), 1), _GUIDE)
    soft = np.clip((soft - _FAINT) / (1 - 2 * _FAINT), 0, 1)
    beyond = distance_transform_edt(~inside) / (REACH * unit)
    return np.asarray(soft * np.clip((1 - beyond) / _LAST, 0, 1), np.float32)


def _away(
    colors: NDArray[np.float64], inside: NDArray[np.bool_], unit: float, up: NDArray[np.float64]
) -> NDArray[np.float32]:
    """Return how far from the face it is, 1 being out of reach, on the way that crosses least of an edge.

    Sideways it is farther than down: beyond the ears there is no skin, below the chin there is a neck.
    """
    cell = max(round(unit / _CELLS), 1)
    small = reduced(colors.astype(np.float32), cell)
    start = np.flatnonzero(reduced(inside.astype(np.float32), cell) > 0.5)
    # Older releases of SciPy search graphs of 32-bit indices alone.
    number = np.arange(small.shape[0] * small.shape[1], dtype=np.int32).reshape(small.shape[:2])
    pairs, costs = [], []
    for step in ((0, 1), (1, 0), (1, 1), (1, -1)):
        here, there = paired(small.shape[:2], step)
        edge = np.linalg.norm(small[here] - small[there], axis=-1)
        down, across = abs(up @ step[::-1]), abs(up @ [step[0], -step[1]])
        length = cell * np.hypot(down, _SIDEWAYS * across) / (REACH * unit)
        cost = length + _BARRIER * np.maximum(edge - _TEXTURE, 0)
        pairs.append(np.stack([number[here].ravel(), number[there].ravel()]))
        costs.append(cost.ravel())
    graph = coo_array((np.concatenate(costs), np.hstack(pairs)), (number.size, number.size)).tocsr()
    found = dijkstra(graph, directed=False, indices=start, min_only=True, limit=1.0)
    away = np.asarray(np.minimum(found, 1), np.float32).reshape(number.shape)
    return gaussian_filter(Enlarger(away, cell, inside.shape).rows(0, inside.shape[0]), _EDGE * unit)


@remembered
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
    rim = _RIM_RENDERED if rendered else _RIM
    trust = (distance_transform_edt(inside) > rim * unit).astype(np.float32)
    if not rendered:
        area = _skin_area(landmarks, inside) & seen
        sure = _sure(landmarks, target.shape, unit)
        ours, theirs = _smooth(target, unit), _smooth(reference, unit)
        if area.any():
            trust *= np.maximum(sure, skin_of(ours, area).likeness(ours))
            skin = skin_of(theirs, area)
            # Below the brows, what is dark may lie in a shadow; above, it is hair or a hat.
            trust *= sure * skin.likeness(theirs, hue_alone=True) + (1 - sure) * skin.likeness(theirs)
        trust *= seen
        hulls = drawn(feature_hulls(landmarks, _FEATURES), target.shape)
        size = 2 * max(round(_EDGE * unit), 1) + 1
        trust *= 1 - grey_dilation(hulls.astype(np.float32), (size, size))
    # What is beside the unknown is half unknown: a mixed pixel, a lens' blur, an alignment that is off.
    size = 2 * max(round(_EDGE * unit / 2), 1) + 1
    return np.asarray(np.clip(2 * gaussian_filter(trust, size / 2) - 1, 0, 1), np.float32)


@remembered
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


def _smooth(image: NDArray[Any], unit: float) -> NDArray[np.float32]:
    """Return a photo without its grain, in which a dark skin would lose its hue."""
    sigma = _GRAIN * unit
    unit_image = to_unit(image)
    return gaussian_filter(unit_image, (sigma, sigma, 0)[: image.ndim], mode="nearest")


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
    mask = drawn([points[ConvexHull(points).vertices]], shape)
    # A mesh may overhang a cheek.
    inner = distance_transform_edt(mask) > _OVERHANG * unit
    return np.asarray(gaussian_filter(inner.astype(np.float32), _EDGE * unit / 2))


def _up(landmarks: Landmarks) -> NDArray[np.float64]:
    eyes = landmarks.eyes
    if eyes is None:
        return np.array([0.0, -1.0])
    right, left = eyes[:, :2]
    across = (left - right) / np.linalg.norm(left - right)
    return np.array([across[1], -across[0]])
