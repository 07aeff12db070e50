"""A change of light on a head, before it is said how bright the face is to be, and of what overall colour."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from relit.methods.lit_face import BRIGHTEST, shown
from relit.methods.scene import Relit
from relit.photo.channels import moved, repeated, within
from relit.photo.color import brightest
from relit.photo.curves import exp
from relit.photo.ranks import quantile

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

    from relit.light.dome import Lamps
    from relit.methods.bleach import Bleach
    from relit.methods.lit_face import Plane

_SKINS = 0.4  # in log: how far two skins differ in colour; of rendered heads in white light, at most 0.26


@dataclass(frozen=True, eq=False)
class LightChange:
    """A change of light on a head, in logarithms of linear light.

    Attributes
    ----------
    light : (H, W) or (H, W, 3) array
        The planes that are relit, as of `lit_face.linear`.
    encoded : bool
        Whether they are encoded in the photo, by the curve of sRGB.
    brightness : (H, W) array
        D, without a constant.
    hue : (H, W, 3) array or None
        By how much more than D red, green and blue change, against one another; the mean is 0. None of light
        without colour.
    cast : (3,) array
        The mean of that: the reference's overall colour less the target's, light and skin alike; of lamps
        that a person set, their overall colour.
    bleach : Bleach or None
        How far the target's skin is bleached, which is undone as its brightness changes; None of a grey one.
    face : (H, W) bool array
        Where brightness is measured.
    ours, theirs : float
        Linear brightness of the target's face, and the reference's; of a light by name, the target's again.
    known : (H, W) array
        Where the head is, 0 to 1.
    confidence : float
        How far this can be trusted, 0 to 1.
    lamps, sources : Lamps
        The new light, and the same as of `Lighting`.
    no_skin : bool
        Whether all of the cast is the light's, and none a skin's.
    layers : mapping of str to array
        As of `Relit`.
    """

    light: Plane
    encoded: bool
    brightness: Plane
    hue: Plane | None
    cast: NDArray[np.float64]
    bleach: Bleach | None
    face: NDArray[np.bool_]
    ours: float
    theirs: float
    known: Plane
    confidence: float
    lamps: Lamps
    sources: Lamps
    no_skin: bool
    layers: Mapping[str, NDArray[np.float32]]

    def anchored(self, exposure: float, cast: float | None) -> Relit:
        """Return the relit planes.

        Parameters
        ----------
        exposure : float
            Share of the reference's brightness that the face takes on, the rest being the target's; 0 to 1.
        cast : float or None
            The same of its overall colour; with None, as much of it as is more than two skins differ by,
            or all, where it is no skin's.
        """
        light = np.atleast_3d(self.light)
        made = light * repeated(exp(self.brightness), light.shape[2])
        if self.hue is not None:
            if cast is None and self.no_skin:
                cast = 1.0
            elif cast is None:
                cast = max(0.0, 1 - _SKINS**2 / max(float(self.cast @ self.cast), 1e-12))
            made = made * exp(moved(self.hue, cast * self.cast))
        # A colour takes away from white light, as a filter does: the brightest channel is what is kept.
        ours, new = (float(quantile(brightest(within(one, self.face)), BRIGHTEST)) for one in (light, made))
        taken = exposure * np.log(max(self.theirs, 1e-4) / max(self.ours, 1e-4))
        anchor = np.log(ours / max(new, 1e-9)) + taken
        made = made * np.float32(np.exp(anchor))
        if self.bleach is not None:
            made = made * exp(self.bleach.undone(self.brightness + np.float32(anchor)))
        relit = shown(made, self.encoded)
        planes = relit[..., 0] if relit.shape[2] == 1 else relit
        return Relit(np.asarray(planes, np.float32), layers=self.layers)
