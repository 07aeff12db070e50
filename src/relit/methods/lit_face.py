"""One face, explained by lamps: how bright they make it, of what hue, and what they leave unexplained."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from relit.light.dome import DOME, Lamps, fit_lamps, samples, surface_of
from relit.photo.color import luma
from relit.photo.curves import log
from relit.photo.filters import gaussian
from relit.photo.pixels import DARKEST, to_unit
from relit.photo.profile import decode_srgb, encode_srgb
from relit.photo.ranks import median, quantile
from relit.photo.resampling import reduced
from relit.runtime.memo import remembered
from relit.runtime.threads import one_blas_thread

if TYPE_CHECKING:
    from typing import TypeAlias

    from numpy.typing import NDArray

    from relit.face.shape import FaceShape
    from relit.light.dome import Surface

    Plane: TypeAlias = NDArray[np.float32]

#: The share of a face that is darker than what counts as its brightest.
BRIGHTEST = 0.95
# What each of these is worth: docs/leaderboard.md, The constants.
_GRAIN = 0.01  # interocular distances that brightness is blurred over
_HUE_GRAIN = 0.03  # the same of hue, which varies more slowly and is noisier
# Of a face's brightest: what its light leaves darker is no base for a ratio. A photo is taken among walls,
# and its curve lifts what is dark; where values are light as it is, less is still light.
_DARKEST_SHADE, _DARKEST_AS_IS = 0.05, 0.02
_NEARLY_ALL = 0.99  # the share of a face that is darker than the most a light makes of it
_TIED = 0.1  # how much the lamps of a colour are like those of the brightness
_MOST = 1.5  # in log: what is farther off than this is no skin
# Of a face's brightest, as encoded: the standard deviation of what lamps leave; more where shadows are as
# dark as in a laboratory.
_USUAL, _USUAL_AS_IS = 0.1, 0.2
_DARKEST = 1e-4  # linear brightness below which there is only noise


@dataclass(frozen=True, eq=False)
class LitFace:
    """A face and the lamps that explain it.

    Attributes
    ----------
    surface : Surface
        The face's own.
    brightness : (H, W) array
        Linear luma, without grain.
    weight : (H, W) array
        Where it shows skin, 0 to 1; there the lamps were fitted.
    lamps : Lamps
    encoded : bool
        Whether the photo's values are light by the curve of sRGB.
    """

    surface: Surface
    brightness: Plane
    weight: Plane
    lamps: Lamps
    encoded: bool

    @cached_property
    def own_shading(self) -> tuple[Plane, Plane | None]:
        """What its own lamps make of it: as of `shading`."""
        return self.shading(self.lamps)

    def shading(self, lamps: Lamps, most: float = np.inf) -> tuple[Plane, Plane | None]:
        """Return what lamps make of this face's shape: log brightness, and log hue if they have colours.

        Where they leave it darker than some of its brightest, that counts: less is no base for a ratio.
        Nowhere is it brighter than `most`.
        """
        made = self._made if lamps is self.lamps else self.surface.lit(lamps)
        least = (_DARKEST_SHADE if self.encoded else _DARKEST_AS_IS) * self._quantile(made[..., 0], BRIGHTEST)
        least = max(least, _DARKEST)
        shade = log(np.clip(made[..., :1], least, max(most, least)))
        if lamps.colors is None:
            return self.surface.enlarged(shade)[..., 0], None
        gains = lamps.colors.sum(axis=0) / max(float(lamps.weights.sum()), _DARKEST)
        ground = (least - np.minimum(made[..., :1], least)) * gains.astype(np.float32)
        bright = log(np.maximum(made[..., :1], least))
        hue = log(np.maximum(made[..., 1:] + ground, np.float32(_DARKEST))) - bright
        both = self.surface.enlarged(np.concatenate([shade, hue], axis=2))
        return both[..., 0], both[..., 1:]

    def most(self) -> float:
        """Return the most that the lamps make of this face where it shows skin."""
        return self._quantile(self._made[..., 0], _NEARLY_ALL)

    @cached_property
    def _made(self) -> NDArray[np.float32]:
        """What its own lamps make of its surface: as of `Surface.lit`."""
        return self.surface.lit(self.lamps)

    def _quantile(self, made: Plane, share: float) -> float:
        """Return what of so large a share of the skin is less."""
        inside = reduced(self.weight, self.surface.factor) > 0.5
        return float(quantile(made[inside] if inside.any() else made.ravel(), share))

    @cached_property
    def explained(self) -> float:
        """How well lamps explain the face, as the eye sees it: 1 if they do, 1/2 if what is usual is left."""
        inside = self.weight > 0.5
        if not inside.any():
            return 0.0
        made = np.exp(self.own_shading[0][inside])
        brightest = quantile(self.brightness[inside], BRIGHTEST)
        seen, wanted = (encode_srgb(light / brightest) for light in (self.brightness[inside], made))
        usual = _USUAL if self.encoded else _USUAL_AS_IS
        return float(1 / (1 + ((seen - wanted).std() / usual) ** 2))

    @cached_property
    def unexplained(self) -> Plane:
        """e, as far as it may be skin; its median over the skin is 0."""
        off = log(np.maximum(self.brightness, np.float32(_DARKEST))) - self.own_shading[0]
        inside = self.weight > 0.5
        middle = median(off[inside]) if inside.any() else 0
        return np.asarray(np.clip(off - middle, -_MOST, _MOST), np.float32)


def linear(planes: NDArray[Any], encoded: bool) -> Plane:
    """Return the light that planes show, float32 and nowhere 0; if it is encoded, by the curve of sRGB."""
    values = np.maximum(to_unit(planes), np.float32(DARKEST))
    return np.asarray(decode_srgb(values) if encoded else values, np.float32)


def shown(light: NDArray[Any], encoded: bool) -> Plane:
    """Return light as planes show it; the inverse of `linear`, beyond 1 too."""
    return np.asarray(encode_srgb(light) if encoded else light, np.float32)


def brightness_of(light: Plane) -> Plane:
    """Return the luma of linear planes, (H, W)."""
    return light if light.ndim == 2 else luma(light)


@remembered
def explain(planes: NDArray[Any], shape: FaceShape, weight: Plane, iod: float, *, encoded: bool) -> LitFace:
    """Find the lamps that light a face.

    Parameters
    ----------
    planes : (H, W) or (H, W, 3) array
        As encoded in a photo.
    shape : FaceShape
    weight : (H, W) array
        Where it shows skin, 0 to 1.
    iod : float
        Interocular distance in px.
    encoded : bool
        Whether the photo's values are light by the curve of sRGB, or light as they are.

    Returns
    -------
    LitFace
    """
    light, surface = linear(planes, encoded), surface_of(shape, iod)
    brightness = gaussian(brightness_of(light), _GRAIN * iod)
    counts = reduced(weight, surface.factor)
    skin = np.flatnonzero(counts > 0.5 if np.any(counts > 0.5) else np.ones(counts.shape, bool))
    some = skin[samples(len(skin))]
    basis, counts = surface.basis(DOME, some).T, counts.ravel()[some]
    weights = fit_lamps(basis, reduced(brightness, surface.factor).ravel()[some], counts)
    colors = None
    if light.ndim == 3:
        hue = reduced(gaussian(light, _HUE_GRAIN * iod), surface.factor).reshape(-1, 3)
        hue = hue[skin] / np.maximum(luma(hue[skin]), np.float32(_DARKEST))[:, None]
        colors = _colored(basis, hue[samples(len(skin))], counts, weights, median(hue))
    return LitFace(surface, brightness, weight, Lamps(DOME, weights, colors), encoded)


def _colored(
    basis: NDArray[np.float32],
    hue: NDArray[np.float32],
    counts: Plane,
    weights: NDArray[np.float64],
    gains: NDArray[np.float32],
) -> NDArray[np.float64]:
    """Return the lamps of red, green and blue.

    What they explain is the colour alone, at the brightness that the lamps make: where a person's albedo, or
    the shape, is off, all channels are. Before they are found, all have the same colour, `gains`.
    """
    with one_blas_thread():
        made = basis @ weights
    fits = [
        fit_lamps(basis, channel * made, counts, prior=weights * gain, tied=_TIED)
        for channel, gain in zip(hue.T, gains.tolist(), strict=True)
    ]
    return np.stack(fits, axis=1)
