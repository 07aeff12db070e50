"""By how much more than its brightness each colour of a head changes with the light.

Hue comes from lamps alone, that of the new ones less that of the old. What lamps leave of a face's hue is
make-up, a beard, another skin; but where a target's own light has colours, it is that light as well: a patch
of sun, the edge of a neon's shadow. The more its lamps differ in hue, the more of what they leave is theirs.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import cv2
import numpy as np

from relit.methods.lit_face import linear
from relit.photo.channels import clipped, moved, repeated, squared_length, within
from relit.photo.color import luma
from relit.photo.curves import log
from relit.photo.filters import gaussian
from relit.photo.ranks import median, quantile
from relit.photo.resampling import blurred

if TYPE_CHECKING:
    from typing import Any

    from numpy.typing import NDArray

    from relit.methods.lit_face import Plane
    from relit.methods.scene import Scene

# What each of these is worth: docs/leaderboard.md, The constants.
_NEARLY_ALL = 0.98  # the share of a face whose hue changes less than the most that anything may
_COLORED = 0.08  # in log: how much the hue of an own light varies of which half the remains are light
_GRAIN, _PATCH = 0.03, 0.08  # interocular distances that hue is looked at over, and remains are blurred over
_MOST = 1.0  # in log: what is farther off than this is no skin
_DARKEST = 1e-4  # linear light that counts as none


def hue_change(
    scene: Scene, smooth: Plane, new: Plane | None, old: Plane | None, noise: float
) -> tuple[Plane | None, NDArray[np.float64]]:
    """Return by how much more than the brightness each colour changes, and the mean of that.

    Parameters
    ----------
    scene : Scene
    smooth : (H, W, 3) or (H, W) array
        Linear light of the target, as of `without_noise`.
    new, old : (H, W, 3) array or None
        Hue of the new lamps and of the target's own, as log over the brightness; None of grey photos.
    noise : float
        τ of a hue, in log.

    Returns
    -------
    hue : (H, W, 3) float32 array or None
        Less its mean over the skin; None where the new light has no colours.
    cast : (3,) float64 array
        The mean; of lamps that a person set, that of the new light alone: how the old one's differs from
        white cannot be told from a skin.
    """
    none = np.zeros(3)
    if new is None:
        return None, none
    assert scene.skin is not None
    inside = scene.skin > 0.5 if np.any(scene.skin > 0.5) else scene.face.inside
    if old is None:  # a grey target takes on the reference's colours, light and skin alike
        return new if scene.rendered else _colors_of(scene), none
    change = new - old - _remains(scene, smooth, old, inside)
    cast = _mean(within(change, inside))
    skin = within(change, scene.face.skin_area)
    low, high = quantile(skin, 1 - _NEARLY_ALL), quantile(skin, _NEARLY_ALL)
    change = moved(clipped(change, low, high), -cast)
    change *= np.float32(shrunk(_variance(within(change, inside)), noise))
    return change, _mean(within(new, inside)) if scene.rendered else cast


def shrunk(variance: float, noise: float) -> float:
    """Return κ: the share of what varies so much that is more than noise.

    Examples
    --------
    >>> shrunk(4.0, 1.0), shrunk(0.5, 1.0)
    (0.75, 0.0)
    """
    return max(0.0, 1 - noise**2 / max(variance, 1e-12))


def without_noise(light: Plane, iod: float) -> Plane:
    """Return light as its hue is looked at; `iod` is the interocular distance in px."""
    return blurred(light, _GRAIN * iod)


def _remains(scene: Scene, smooth: Plane, old: Plane, inside: NDArray[np.bool_]) -> Plane:
    """Return what the target's own light has of the hue that its lamps leave, (H, W, 3)."""
    iod, face = scene.face.interocular_distance, scene.face
    assert scene.skin is not None
    left = _hue_of(smooth) - old
    left = np.clip(moved(left, -median(within(left, inside))), -_MOST, _MOST)
    skin = np.asarray(scene.skin * face.inside, np.float32)
    known = np.maximum(blurred(skin, _PATCH * iod), 0.05)
    left = blurred(repeated(skin, 3) * left, _PATCH * iod) / repeated(known, 3)
    theirs = within(old, inside)
    variance = _variance(moved(theirs, -_mean(theirs)))
    return np.asarray(variance / (variance + _COLORED**2) * left, np.float32)


def _mean(hue: Plane) -> NDArray[np.float64]:
    """Return the mean of hues, (n, 3)."""
    return np.asarray(cv2.mean(hue[None])[:3])


def _variance(hue: Plane) -> float:
    """Return how much a hue varies whose mean is 0, (n, 3)."""
    return float(squared_length(hue).mean(dtype=np.float64))


def _colors_of(scene: Scene) -> Plane:
    """Return the reference's own colours, log over its brightness, as fine as the light may be."""
    blur = 0.5 / scene.lam_px
    return _hue_of(gaussian(linear(scene.reference, scene.encoded), blur))


def _hue_of(light: NDArray[Any]) -> Plane:
    """Return the log of each colour over the brightness, (H, W, 3)."""
    brightness = np.maximum(luma(light), np.float32(_DARKEST))
    return np.asarray(log(np.maximum(light, np.float32(_DARKEST)) / repeated(brightness, 3)), np.float32)
