"""Where a change of light can be trusted.

A method tells how the light changes on the face. It cannot know where the reference shows hair, spectacles
or what is behind, nor under brows, eyes and lips, which differ from person to person: there the change is
carried on from around, as a membrane would.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from relit.face.skin import skin_of
from relit.face.views import without_grain
from relit.photo.channels import moved, repeated, squared_length, within
from relit.photo.color import luma
from relit.photo.curves import log
from relit.photo.filters import box_round, dilated, gaussian
from relit.photo.pixels import to_unit
from relit.photo.ranks import median
from relit.runtime.memo import remembered

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from relit.face.views import View

# What each of these is worth: docs/leaderboard.md, The constants.
_RIM, _RIM_RENDERED = 0.1, 0.04  # interocular distances: at its outline a mesh is too flat to shade well
_EDGE = 0.06  # interocular distances by which features are widened, and over which trust turns soft
_OTHER_LIGHT = 0.6  # in log of the encoded, from skin's colour: of fourteen portraits, hair is at most 0.53
_ROUND = 0.1  # interocular distances round a face that its grain does not reach over
_NEAR = 0.02  # interocular distances by which the features of one face are widened


@remembered
def known(
    view: View,
    reference: NDArray[Any],
    seen: NDArray[np.bool_],
    *,
    rendered: bool = False,
    narrow: bool = False,
) -> NDArray[np.float32]:
    """Return where a change of light can be trusted, 0 to 1.

    Parameters
    ----------
    view : View
        Of the target.
    reference : (H, W) or (H, W, 3) array
        Laid over the view.
    seen : (H, W) bool array
        Where it lies within its photo.
    rendered : bool
        Whether the reference is nobody's face.
    narrow : bool
        Whether what cannot be trusted is half as wide: of the template head, which is shaded well at its rim,
        and a light that is found as a whole.

    Returns
    -------
    (H, W) float32 array
    """
    face, iod = view.regions, view.regions.interocular_distance
    rim, edge = (_RIM / 2, _EDGE / 2) if narrow else (_RIM_RENDERED if rendered else _RIM, _EDGE)
    trust = (face.distance > rim * iod).astype(np.float32)
    if not rendered:
        trust *= seen
        area = face.skin_area & seen
        if area.any():
            trust *= np.maximum(face.below_brows, view.skin_likeness)
            part = box_round(face.inside, int(_ROUND * iod) + 1)  # beyond, nothing is trusted
            theirs, area, below = without_grain(reference[part], iod), area[part], face.below_brows[part]
            skin = skin_of(theirs, area)
            # Below the brows, what is dark may lie in a shadow; above, it is hair or a hat.
            shaded, plain = skin.likeness(theirs, hue_alone=True), skin.likeness(theirs)
            if narrow and theirs.ndim == 3:
                shaded = np.maximum(shaded, _lit_in_color(theirs, area))
            trust[part] *= below * shaded + (1 - below) * plain
        trust *= 1 - dilated(face.features, _square(edge * iod))
    # What is beside the unknown is half unknown: a mixed pixel, a lens' blur, an alignment that is off.
    sigma = _square(edge * iod / 2) / 2
    return np.asarray(np.clip(2 * gaussian(trust, sigma) - 1, 0, 1), np.float32)


def _lit_in_color(pixels: NDArray[Any], area: NDArray[np.bool_]) -> NDArray[np.float32]:
    """Return where a colour is so far from that of most of a face that it is a second light's: 0 or 1."""
    light = np.maximum(to_unit(pixels), 1 / 255)
    hue = log(light / repeated(luma(light), 3))
    away = squared_length(moved(hue, -median(within(hue, area))))
    return np.asarray(away > _OTHER_LIGHT**2, np.float32)


@remembered
def skin_shown(view: View) -> NDArray[np.float32]:
    """Return where a face shows skin, whatever light falls on it: not in features, nor where hair hides it.

    Parameters
    ----------
    view : View

    Returns
    -------
    (H, W) float32 array
        0 to 1.
    """
    face = view.regions
    shown = face.inside * np.maximum(face.below_brows, view.skin_likeness)
    near = _square(_NEAR * face.interocular_distance)
    features = dilated(face.features, near)
    return np.asarray(shown * (1 - features), np.float32)


def _square(radius: float) -> int:
    """Return the side of a window that reaches so far, and at least 1 px, round its middle."""
    return 2 * max(round(radius), 1) + 1
