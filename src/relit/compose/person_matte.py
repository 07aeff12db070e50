"""Where a change of the light on a head goes: the person, with ears, hair and neck, and nothing of the wall.

A network tells the person from what is behind, but sees the edge between them only coarsely. It is found in
the photo: near it, what is surely one and what is surely the other are of two colours, and a pixel of hair
and wall lies between these, as far along as there is hair in it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import cv2
import numpy as np

from relit.compose.matte import matte
from relit.face.outline import across, face_outline
from relit.face.person import person
from relit.face.shape import head_shape
from relit.photo.channels import squared_length
from relit.photo.filters import distance_from, gaussian
from relit.photo.pixels import to_unit
from relit.photo.resampling import Enlarger, reduced
from relit.runtime.memo import remembered

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from relit.face.landmarks import Landmarks
    from relit.face.regions import FaceRegions
    from relit.face.views import View

# How far beyond the face's outline a change goes on in full, and where it ends, in interocular distances. Of
# 24 photos, no hair but buns and long hair reaches the first of these; shoulders and chests lie between those
# below.
_ABOVE, _BESIDE, _BELOW = (1.4, 1.8), (1.5, 3.0), (0.8, 4.0)
_BESIDE_OTHERS = 0.7, 1.25  # the same beside a face that is not alone: shoulders may touch
_OTHERS = 0.1  # of a face's area that is seen of somebody else above the chin, if there is one
_SHOULDERS, _NECK = 0.9, 0.8  # how much nearer a change begins to fade beside the end of the neck
_AROUND = 0.1  # beyond that to the view's end, so that nothing changes there
# What each of these is worth was seen on twelve rendered heads and 24 photos.
_SURE, _SURELY_NOT = 0.9, 0.1  # likeliness to be of the person
_FACE = 0.9  # mean likeliness of a face that was seen as a person's; of tight crops it is less
_TIGHT = 0.5  # share of a view that is face, from which on it is a tight crop
_CELLS = 24  # that the interocular distance has, where colours are looked for
_COLORS = 0.1  # interocular distances: standard deviation of the window in which colours are means
_CONTRAST = 0.05  # of 1: colours nearer to each other than that do not tell
_SEEN = 0.02  # share of a window that has to be surely one or the other
_FROM, _RISE = 0.2, 0.4  # likeliness that begins to count, and how much more is all of it
_FARTHER, _DOUBT = 0.3, 2.0  # how much later it begins per interocular distance, and by the share of doubt
_OVERHANG = 0.12  # interocular distances that a mesh may overhang a cheek
_FAINT = 0.15  # of the matte: of twelve rendered heads, walls take less (mean ΔE00 .024, not .032 with .08)


@remembered
def person_matte(view: View) -> NDArray[np.float32]:
    """Return where the person whose face it is takes a change, 0 to 1.

    Parameters
    ----------
    view : View
        Of the target.

    Returns
    -------
    (H, W) float32 array
        Falls off down the chest and along the shoulders, and is 0 at the ends of a view that ends at
        `corners_round`. Where the network does not see a person, that of the skin.
    """
    return person_area(view) * _fade(view.regions, _BESIDE if _alone(view) else _BESIDE_OTHERS)


def corners_round(landmarks: Landmarks) -> NDArray[np.float64]:
    """Return the corners, (4, 2) in px, of the turned box in which a head can change, and a little more.

    Examples
    --------
    >>> from relit.face.landmarks import Landmarks
    >>> face = Landmarks([[0, 0], [10, 0], [5, 10]])
    >>> bool((corners_round(face).max(axis=0) > 10).all())
    True
    """
    along, up = _axes(landmarks)
    outline, iod = face_outline(landmarks), landmarks.interocular_distance
    beside, above, below = (iod * (reach[1] + _AROUND) for reach in (_BESIDE, _ABOVE, _BELOW))
    x, y = outline @ along, outline @ up
    return np.array(
        [
            one * along + other * up
            for one in (x.min() - beside, x.max() + beside)
            for other in (y.min() - below, y.max() + above)
        ]
    )


def _axes(landmarks: Landmarks) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    x, y = across(landmarks)
    return np.array([x, y]), np.array([y, -x])


def _fade(face: FaceRegions, reach: tuple[float, float]) -> NDArray[np.float32]:
    """Return how much of a change is left at a place: less and less away from the face."""
    along, up = _axes(face.landmarks)
    rows, columns = (np.arange(size, dtype=np.float32) for size in face.shape)

    def beyond(axis: NDArray[np.float64]) -> NDArray[np.float32]:
        place = columns * np.float32(axis[0]) + (rows * np.float32(axis[1]))[:, None]
        away = place - np.float32((face.outline @ axis).max())
        return np.asarray(away / np.float32(face.interocular_distance))

    def left(
        away: NDArray[np.float32], first: NDArray[np.float32] | float, last: float
    ) -> NDArray[np.float32]:
        share = np.clip((last - away) / (last - first), 0, 1)
        return np.asarray(share * share * (3 - 2 * share), np.float32)

    below = beyond(-up)
    # Hair goes on in full beside a face; beside a neck there are shoulders.
    first = reach[0] - _SHOULDERS * np.clip(below / _NECK, 0, 1)
    beside = np.maximum(beyond(along), beyond(-along))
    return left(below, *_BELOW) * left(beyond(up), *_ABOVE) * left(beside, first, reach[1])


def _alone(view: View) -> bool:
    """Return whether nobody else is seen above the chin of a face."""
    face = view.regions
    groups = _groups((person(view) > 0.5) & (face.height >= 0))
    counts = np.bincount(groups.ravel())
    counts[np.unique(groups[face.inside])] = 0
    return bool(counts[1:].sum() < _OTHERS * face.inside.sum())


@remembered
def person_area(view: View) -> NDArray[np.float32]:
    """Return where the person is, 0 to 1."""
    face = view.regions
    if face.inside.all() or not face.inside.any():
        return np.ones(face.shape, np.float32)
    likely = person(view)
    # Of a face all is relit: a fringe, a hand and spectacles too.
    core = np.clip(face.distance / (_OVERHANG * face.interocular_distance) - 1, 0, 1)
    if face.inside.mean() > _TIGHT:  # so near that the network is lost
        area = np.maximum(matte(view), _template(view))
    elif likely[face.skin_area].mean() < _FACE:
        area = matte(view)
    else:
        area = _at_edges(view, likely)
        area = np.clip((area - _FAINT) / (1 - 2 * _FAINT), 0, 1)
    return np.asarray(np.maximum(area, core), np.float32)


def _template(view: View) -> NDArray[np.float32]:
    """Return where a head with these landmarks is, with a soft edge."""
    face = view.regions
    head = head_shape(face.landmarks, face.shape).head
    return gaussian(head, _COLORS / 2 * face.interocular_distance, edge="repeated")


def _at_edges(view: View, likely: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return how much of each pixel is of the person, its edge being that of the photo."""
    face, pixels = view.regions, np.atleast_3d(to_unit(view.pixels)).astype(np.float32)
    cell = max(round(face.interocular_distance / _CELLS), 1)
    sigma = _COLORS * face.interocular_distance / cell
    colors, chance, inside = (
        reduced(plane, cell) for plane in (pixels, likely, face.inside.astype(np.float32))
    )
    one = np.clip((chance - _SURE) / (1 - _SURE), 0, 1).astype(np.float32)
    other = np.clip((_SURELY_NOT - chance) / _SURELY_NOT, 0, 1).astype(np.float32)
    axis, level, trust = _between(colors, one, other, sigma)
    # Far from the face, or where the network doubts much, only what is very likely counts; of others nothing.
    away = distance_from(inside >= 0.5) * (cell / face.interocular_distance)
    joined = _joined(chance > 0.5, inside > 0.5, (_axes(face.landmarks)[1], face.outline / cell))
    doubt = ((chance > _FROM) & (chance < 1 - _FROM)).mean()
    least = np.minimum(_FROM + _FARTHER * away + _DOUBT * doubt, 1 - _RISE) + 2 * (1 - joined)
    parts = np.concatenate([axis, np.stack([level, trust * joined, least], axis=2)], axis=2)
    parts = Enlarger(parts.astype(np.float32), cell, pixels.shape).rows(0, len(pixels))
    share = np.clip(np.einsum("ijk,ijk->ij", pixels, parts[..., :-3]) - parts[..., -3], 0, 1)
    coarse = np.clip((likely - parts[..., -1]) / _RISE, 0, 1)
    return np.asarray(coarse + parts[..., -2] * (share - coarse), np.float32)


def _joined(
    persons: NDArray[np.bool_],
    face: NDArray[np.bool_],
    frame: tuple[NDArray[np.float64], NDArray[np.float64]],
) -> NDArray[np.float32]:
    """Return where persons are nobody but the one with the face, 0 to 1; 1 off all persons.

    Shoulders of several may touch. So what is above the chin has to be joined to the face above the chin.
    """
    up, outline = frame
    rows, columns = (np.arange(size) for size in face.shape)
    above = columns * up[0] + (rows * up[1])[:, None] >= (outline @ up).min()
    others = np.zeros_like(persons)
    for part in (persons, persons & above):
        groups = _groups(part)
        counts = np.bincount(groups[face], minlength=1)
        counts[0] = 0
        others |= part & (groups != counts.argmax())
    cross = cv2.getStructuringElement(cv2.MORPH_CROSS, (3, 3))
    around = cv2.dilate(others.view(np.uint8), cross, iterations=3).view(np.bool_)
    others = around & (others | ~persons)  # with their edges
    return gaussian(~others, 1.0)


def _groups(mask: NDArray[np.bool_]) -> NDArray[np.int32]:
    """Return which connected part of a mask each pixel is of, 0 off it."""
    _, groups = cv2.connectedComponents(mask.view(np.uint8), connectivity=4)
    return np.asarray(groups, np.int32)


def _between(
    colors: NDArray[np.float32], one: NDArray[np.float32], other: NDArray[np.float32], sigma: float
) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.float32]]:
    """Return the line from one to the other of two local colours, and how far it can be trusted.

    ``colors · axis - level`` is 1 at the one and 0 at the other.
    """
    (seen, color, spread), (seen_other, behind, spread_behind) = (
        _colors(colors, known, sigma) for known in (one, other)
    )
    apart = color - behind
    contrast = squared_length(apart)
    trust = contrast / (contrast + 2 * (spread + spread_behind) + _CONTRAST**2)
    trust = trust * np.clip(np.minimum(seen, seen_other) / _SEEN, 0, 1)
    axis = apart / np.maximum(contrast, np.float32(1e-6))[..., None]
    return axis, np.asarray((axis * behind).sum(axis=2)), np.asarray(trust)


def _colors(
    colors: NDArray[np.float32], known: NDArray[np.float32], sigma: float
) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.float32]]:
    """Return how much is known round each pixel, the mean of the colours there, and their variance."""

    def mean(planes: NDArray[np.float32]) -> NDArray[np.float32]:
        return gaussian(planes, sigma, edge="repeated")

    weight = known[..., None]
    seen = mean(weight)
    level, square = (
        mean(weight * planes) / np.maximum(seen, np.float32(1e-6)) for planes in (colors, colors**2)
    )
    return seen[..., 0], level.astype(np.float32), np.maximum(square - level**2, 0).sum(axis=2)
