"""A baseline: large scales by a Gaussian blur of log I, as in homomorphic filtering [1]_.

The blur has a standard deviation of 1/λ px, the scale at which LTV parts the two. It knows no edges: light
bleeds over the outline of shadows and features, which shows as halos.

References
----------
.. [1] A. V. Oppenheim, R. W. Schafer, T. G. Stockham, "Nonlinear filtering of multiplied and convolved
       signals", Proc. IEEE 56(8), 1968.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from relit.ltv.decomposition import Decomposition
from relit.methods.scene import Relit, Scene, as_planes, recombined, stacked
from relit.photo.doubles import gaussian
from relit.photo.pixels import DARKEST, to_unit

if TYPE_CHECKING:
    from numpy.typing import NDArray


def relight(scene: Scene) -> Relit:
    """Return u(reference) · v(target)."""
    return recombined(_split(scene.target, scene.lam_px), _split(scene.reference, scene.lam_px))


def _split(image: NDArray[Any], lam: float) -> Decomposition:
    bright = np.maximum(to_unit(image), np.float32(DARKEST))
    u = stacked([np.exp(gaussian(np.log(plane), 1 / lam)) for plane in as_planes(bright)])
    return Decomposition(u, np.asarray(bright / u, np.float32), lam, "gaussian")
