"""The person where no light shows it: in deep shadow, the other half of the face and the reference stand in.

Of log I = s + p, p is the person, and known as well as the photo is: where the target's own light hardly
reaches, noise is all there is. Estimates are weighted by the inverse of their variances.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from relit.methods.lit_face import BRIGHTEST, shown
from relit.photo.curves import log
from relit.photo.filters import at_places, eroded, gaussian
from relit.photo.pixels import GAMMA
from relit.photo.ranks import quantile

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from relit.methods.lit_face import LitFace, Plane

# What each of these is worth: docs/leaderboard.md, The constants.
_UNLIT, _LIT = 0.03, 0.3  # encoded brightness, of a face's brightest, that says nothing and all of a person
_SLANTED = 0.5  # sine of the angle from which on a light casts shadows at their deepest
_SHADOW_EDGE = 0.07  # interocular distances that a shadow is widened by: at its edge light and person mix
_WIDE = 0.04  # interocular distances that brightness is looked at over
_PERSON, _HALVES = 0.35, 0.4  # in log of the encoded: how different two people are, and the halves of one
_NOISE = 2 / 255  # of an encoded photo
_LEAST = 1e-5  # linear brightness that counts as black
_SHAPE = 0.1  # in log: what a wrong normal does to a shade


def lit(face: LitFace, iod: float) -> Plane:
    """Return where a face's own light reaches: 0 to 1, and less at a shadow's edge than within the light."""
    skin = face.weight > 0.5
    seen = shown(gaussian(face.brightness, _WIDE * iod), face.encoded)
    brightest = float(quantile(seen[skin] if skin.any() else seen.ravel(), BRIGHTEST))
    size = max(1, round(_SHADOW_EDGE * iod))
    seen = gaussian(eroded(seen / max(brightest, 1e-6), size), size / 3)
    share = np.clip((seen - _UNLIT) / (_LIT - _UNLIT), 0, 1)
    # A light at the camera casts no shadow that the camera sees: what is dark then is dark hair.
    towards = face.lamps.weights @ face.lamps.directions
    slant = float(np.hypot(*towards[:2])) / max(float(np.linalg.norm(towards)), 1e-9)
    return np.asarray(1 - (1 - share**2 * (3 - 2 * share)) * min(slant / _SLANTED, 1) ** 4, np.float32)


def stand_in(
    brightness: Plane,
    shade: Plane,
    target: LitFace,
    reference: LitFace | None,
    features: NDArray[np.bool_],
    twin: NDArray[np.float64] | None,
    iod: float,
) -> tuple[Plane, Plane]:
    """Return what to add to log I of a target, to show the person where no light does, and where it is lit.

    Parameters
    ----------
    brightness : (H, W) array
        Linear luma of the target, with its grain, and nowhere 0.
    shade : (H, W) array
        s of the target, as it is taken off.
    target, reference : LitFace
        The latter laid over the former; None of a light by name.
    features : (H, W) bool array
        Where the reference may stand in though it shows no skin: brows, eyes and mouth.
    twin : (2, H, W) array or None
        As of `mirror.twins`.
    iod : float
        Interocular distance in px.

    Returns
    -------
    missing, lit : (H, W) float32 array
    """
    reached = lit(target, iod)
    person, variance = _person(target, shade, iod)
    own = reached / variance
    dark = 1 - _SHAPE**2 * own
    total, weights = own * person, own.copy()
    if twin is not None:
        half = dark * _there(reached, twin) / (_there(variance, twin) + (_curve(target) * _HALVES) ** 2)
        total, weights = total + half * _there(person, twin), weights + half
    if reference is not None:
        theirs, theirs_variance = _person(reference, reference.own_shading[0], iod)
        seen = np.maximum(reference.weight, gaussian(features, _WIDE / 2 * iod))
        shared = own * reference.weight
        theirs = theirs + (shared * (person - theirs)).sum() / max(float(shared.sum()), 1e-9)
        other = dark * seen / (theirs_variance + (_curve(target) * _PERSON) ** 2)
        total, weights = total + other * theirs, weights + other
    # As far as its own light shows the person, so does its grain.
    grain = log(brightness / np.maximum(target.brightness, np.float32(_LEAST)))
    missing = total / np.maximum(weights, 1e-9) - person - (1 - reached) * grain
    missing *= np.minimum(weights * (_curve(target) * _PERSON) ** 2, 1)
    return np.asarray(missing, np.float32), reached


def _person(face: LitFace, shade: Plane, iod: float) -> tuple[Plane, Plane]:
    """Return p beside a shading, and its variance."""
    seen = shown(gaussian(face.brightness, _WIDE * iod), face.encoded)
    noise = _curve(face) * _NOISE / np.maximum(seen, _NOISE)
    person = log(np.maximum(face.brightness, np.float32(_LEAST))) - shade
    return person, np.asarray(noise**2 + _SHAPE**2, np.float32)


def _curve(face: LitFace) -> float:
    """Return how much larger an error of the encoded is in log of linear light."""
    return GAMMA if face.encoded else 1.0


def _there(plane: Plane, twin: NDArray[np.float64]) -> Plane:
    return at_places(plane, twin[1], twin[0])
