"""Where a change of the light on a face goes: the skin of the target, beyond the outline of its face too.

All of the face below the brows is skin for sure; above them, and round the face, what looks like its skin and
can be reached from the face without crossing an edge takes the change, less and less with the distance.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from relit.compose.guided_filter import guided_filter
from relit.photo.channels import repeated
from relit.photo.filters import closed, distance_from, gaussian, opened
from relit.photo.resampling import Enlarger, reduced
from relit.runtime.memo import remembered
from relit.solver.neighborhoods import paired

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from relit.face.regions import FaceRegions
    from relit.face.views import View
    from relit.photo.planes import PlaneSpace

    Slices = tuple[slice, slice]

#: How far beyond the face's outline skin is relit, in interocular distances.
REACH = 0.9

# What each of these is worth: docs/leaderboard.md, The constants.
_CELLS = 24  # that the interocular distance has, where the way from the face is looked for
_SIDEWAYS = 2.0  # how much farther it is across a face than along it
_BARRIER, _TEXTURE = 0.6, 1.0  # how far away an edge makes things, per standard deviation of the skin above
_EDGE = 0.06  # interocular distances over which masks turn soft, and guided ones look for an edge
_GUIDE = 0.03  # contrast of an edge, of 1
_NONE, _ALL = 0.3, 0.9  # likeness to skin that counts as none, and as all
_HOLE = 0.12  # interocular distances: holes in the skin smaller than this are none
_FULL = 0.35  # of the reach, over which all of a change goes on
_LAST = 0.1  # of the reach, over which the last of a change goes
_FAINT = 0.04  # share of a change that nobody sees
_GLINT, _GLINT_SIZE = 0.12, 0.06  # brightness, of 1, by which a catchlight exceeds what is round it; IODs
_WHITE = 0.85  # share of a change that eyes and teeth take, less what colours them


@remembered
def matte(view: View) -> NDArray[np.float32]:
    """Return where the target's skin takes a change, 0 to 1.

    Parameters
    ----------
    view : View
        Of the target.

    Returns
    -------
    (H, W) float32 array
        0 from 0.9 interocular distances outside the outline on.
    """
    face, iod = view.regions, view.regions.interocular_distance
    if face.inside.all() or not face.inside.any():
        return np.ones(face.shape, np.float32)
    near = np.clip((1 - _away(view.skin.whitened(view.smooth), face)) / (1 - _FULL), 0, 1)
    near = near**2 * (3 - 2 * near)
    share = near * skin_share(view)
    soft = guided_filter(share, view.brightness, max(round(_EDGE * iod), 1), _GUIDE)
    soft = np.clip((soft - _FAINT) / (1 - 2 * _FAINT), 0, 1)
    beyond = distance_from(face.inside) / (REACH * iod)
    return np.asarray(soft * np.clip((1 - beyond) / _LAST, 0, 1), np.float32)


@remembered
def skin_share(view: View) -> NDArray[np.float32]:
    """Return how much of each pixel is skin, (H, W) in [0, 1], by its looks; below the brows, all."""
    # A little of a likeness is none: it would show as a glow on a plain background.
    like = np.clip((view.skin_likeness - _NONE) / (_ALL - _NONE), 0, 1)
    # A highlight on skin, a mole, a strand of hair: the light falls on them too.
    size = 2 * max(round(_HOLE * view.regions.interocular_distance / 2), 1) + 1
    return np.asarray(np.maximum(closed(like, size), view.regions.below_brows))


def _away(colors: NDArray[np.float32], face: FaceRegions) -> NDArray[np.float32]:
    """Return how far from the face it is, 1 being out of reach, on the way that crosses least of an edge.

    Sideways it is farther than down: beyond the ears there is no skin, below the chin there is a neck.
    """
    inside, up, iod = face.inside, face.up, face.interocular_distance
    cell = max(round(iod / _CELLS), 1)
    small = reduced(colors, cell)
    start = reduced(inside.astype(np.float32), cell) > 0.5
    ways = []
    for step in ((0, 1), (1, 0), (1, 1), (1, -1)):
        here, there = paired(start.shape, step)
        edge = np.linalg.norm(small[here] - small[there], axis=-1)
        down, across = abs(up @ step[::-1]), abs(up @ [step[0], -step[1]])
        length = cell * np.hypot(down, _SIDEWAYS * across) / (REACH * iod)
        ways.append((here, there, length + _BARRIER * np.maximum(edge - _TEXTURE, 0)))
    away = shortest_ways(start, ways).astype(np.float32)
    return gaussian(Enlarger(away, cell, inside.shape).rows(0, inside.shape[0]), _EDGE * iod)


def shortest_ways(
    start: NDArray[np.bool_], ways: list[tuple[Slices, Slices, NDArray[Any]]]
) -> NDArray[np.float64]:
    """Return how long the shortest way from a start to each cell of a grid is; 1 where none is shorter.

    Parameters
    ----------
    start : (h, w) bool array
    ways : list of (slices, slices, array)
        Cells, their neighbours, and how long it is from the ones to the others, above 0.

    Examples
    --------
    >>> along = np.s_[:, :-1], np.s_[:, 1:], np.full((1, 4), 0.375)
    >>> shortest_ways(np.eye(1, 5, dtype=bool), [along]).tolist()
    [[0.0, 0.375, 0.75, 1.0, 1.0]]
    """
    away = np.where(start, 0.0, 1.0)
    before = np.zeros_like(away)
    # Every round goes a cell farther, and few are in reach.
    while not np.array_equal(away, before):
        before = away.copy()
        for here, there, length in ways:
            np.minimum(away[there], before[here] + length, out=away[there])
            np.minimum(away[here], before[there] + length, out=away[here])
    return away


@remembered
def eyes_and_teeth(view: View) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Return where eyes and teeth are, and the share of a change of light that goes on there.

    Parameters
    ----------
    view : View
        Of the target.

    Returns
    -------
    white : (H, W) float32 array
        1 between the lids and between the lips.
    share : (H, W) float32 array
        1 on skin, less there, and 0 in catchlights.
    """
    iod = view.regions.interocular_distance
    hulls = view.regions.hulls(("eyes", "inner_mouth"))
    white = gaussian(hulls, _EDGE * iod / 4)
    size = 2 * max(round(_GLINT_SIZE * iod), 1) + 1
    glint = np.clip((view.brightness - opened(view.brightness, size)) / _GLINT - 1, 0, 1)
    return white, np.asarray(1 - white * np.maximum(1 - _WHITE, glint), np.float32)


def sparing_whites(change: NDArray[np.float32], view: View, space: PlaneSpace) -> NDArray[np.float32]:
    """Return a change with eyes and teeth spared: less of it, no colour, and nothing of catchlights."""
    white, share = eyes_and_teeth(view)
    if space.color_space == "rgb" and change.shape[2] == 3:
        brightness = (change @ space.weights(3))[..., None]
        change = change + repeated(white, 3) * (brightness - change)
    return np.asarray(change * repeated(share, change.shape[2]))
