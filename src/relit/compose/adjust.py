"""How bright a relit face is to be, of what hue, and how strong the change of light.

A change is ``c = log(relit / target)``, plane by plane. Its brightness is that of the planes, weighted as
`PlaneSpace.weights` says. A method that tells light from skin is anchored by that, before there is a change;
of the others, the change is compared with the target.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from relit.methods.scene import Relit
from relit.photo.pixels import GAMMA

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from relit.methods.light_change import LightChange
    from relit.settings.options import TransferOptions

    Planes = NDArray[np.float32]

# What each of these is worth: docs/leaderboard.md, The constants.
_BRIGHTEST = 0.95  # the share of a face that is darker than what says how bright it is

#: Logarithm of the factor by which a stop changes an encoded value.
STOP = float(np.log(2) / GAMMA)


def anchored(made: Relit | LightChange, options: TransferOptions) -> Relit:
    """Return relit planes as bright, and of the hue, that the options want, as far as a method tells."""
    if isinstance(made, Relit):
        return made
    if options.tint == "neutral":
        made = replace(made, hue=None)
    return made.anchored(options.exposure_share, options.tint_share)


def controlled(
    change: Planes,
    base: Planes,
    face: NDArray[np.bool_],
    weights: NDArray[np.float32],
    options: TransferOptions,
) -> Planes:
    """Return a change as the options want it.

    Parameters
    ----------
    change : (H, W, k) array
        As the method made it.
    base : (H, W, k) or (H, W, 1) array
        Planes of the target, in (0, 1].
    face : (H, W) bool array
        Where brightness and hue are measured.
    weights : (k,) array
        Share of each plane in the brightness; the sum is 1.
    options : TransferOptions
        Of which `exposure`, `tint`, `shadows`, `highlights` and `strength` are read.

    Returns
    -------
    (H, W, k) float32 array

    Examples
    --------
    >>> from relit.settings.options import TransferOptions
    >>> change, base = np.full((2, 2, 1), 0.5, np.float32), np.full((2, 2, 1), 0.5, np.float32)
    >>> options = TransferOptions(method="ltv", strength=0.5)
    >>> float(controlled(change, base, np.ones((2, 2), bool), np.ones(1, np.float32), options)[0, 0, 0])
    0.25
    """
    kept = options.record.anchors_itself or options.color_space != "rgb"
    if base.shape[2] == 3 and not kept:  # a grey target has no hue to keep
        change = _tinted(change, face, weights, options)
    bright = (weights > 0).astype(np.float32)
    change = change + np.float32(_exposure(change, base, face, weights, options)) * bright
    brightness = change @ weights
    middle = np.float32(brightness[face].mean())
    share = np.where(brightness > middle, options.highlights, options.shadows).astype(np.float32)
    lift = ((share - 1) * (brightness - middle))[..., None]
    return np.asarray(np.float32(options.strength) * (change + lift * bright), np.float32)


def _tinted(
    change: Planes, face: NDArray[np.bool_], weights: NDArray[np.float32], options: TransferOptions
) -> Planes:
    """Return a change of RGB with as much of its colour as is wanted.

    The overall colour of a light goes with the hue of a skin, and so does colour that comes and goes with the
    light's brightness: a dark skin's blue falls off more steeply than a fair one's. What varies over the face
    in its own way is the light's.
    """
    brightness = (change @ weights)[..., None]
    if options.tint == "neutral":
        return np.repeat(brightness, 3, axis=2)
    share = options.tint_share
    if share is None:
        return change
    color, off = change - brightness, brightness - brightness[face].mean()
    steepness = (color[face] * off[face]).mean(axis=0) / max(float((off[face] ** 2).mean()), 1e-9)
    unwanted = steepness * off + color[face].mean(axis=0)
    return np.asarray(change - np.float32(1 - share) * unwanted, np.float32)


def _exposure(
    change: Planes,
    base: Planes,
    face: NDArray[np.bool_],
    weights: NDArray[np.float32],
    options: TransferOptions,
) -> float:
    """Return what to add to a change for the exposure that is wanted."""
    stops = options.stops or 0.0
    if options.record.anchors_itself or options.exposure in (None, "take"):
        return stops * STOP
    before, after = (
        np.quantile(np.broadcast_to(planes, change.shape)[face] @ weights, _BRIGHTEST)
        for planes in (base, base * np.exp(change))
    )
    return float(np.log(before / max(after, 1e-6))) + stops * STOP
