"""A baseline: large scales by weighted least squares [1]_, the reference's guided by the target's [2]_.

With ``f = log I``, u minimises ``Σ (u - f)² + μ Σ |∇u|² / (|∇f|^α + ε)``: smooth but where f has edges. The
guided filter [3]_ then gives the reference's large scales the edges of the target's, so that features of
the reference do not come along. To be used on lightness: ``color_space="ycbcr", channels="y"``.

References
----------
.. [1] Z. Farbman, R. Fattal, D. Lischinski, R. Szeliski, "Edge-preserving decompositions for multi-scale tone
       and detail manipulation", ACM TOG 27(3), 2008.
.. [2] X. Chen, M. Chen, X. Jin, Q. Zhao, "Face illumination transfer through edge-preserving filters", CVPR
       2011.
.. [3] K. He, J. Sun, X. Tang, "Guided image filtering", ECCV 2010.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from relit.errors import OptionError
from relit.ltv.decomposition import Decomposition
from relit.methods.scene import Relit, Scene, as_planes, recombined, stacked
from relit.photo.doubles import window_mean
from relit.photo.pixels import DARKEST, to_unit

if TYPE_CHECKING:
    from numpy.typing import NDArray

_ALPHA, _EPSILON = 1.2, 1e-4  # of [1]
_GUIDE = 0.1  # contrast, in log I, from which on the guide's edges count


def relight(scene: Scene) -> Relit:
    """Return u(reference), guided by u(target), times v(target)."""
    target, reference = _split(scene.target, scene.lam_px), _split(scene.reference, scene.lam_px)
    guides = as_planes(np.log(target.u))
    size = 2 * round(1 / scene.lam_px) + 1
    large = [
        np.exp(guided(guides[i % len(guides)], plane, size))
        for i, plane in enumerate(as_planes(np.log(reference.u)))
    ]
    u = stacked(large)
    light = Decomposition(u, reference.u * reference.v / u, reference.lam, reference.neighborhood)
    return recombined(target, light)


def _split(image: NDArray[Any], lam: float) -> Decomposition:
    bright = np.maximum(to_unit(image), np.float32(DARKEST))
    # μ = 1, the default of [1], where λ = 0.2: smoothing reaches as far as its root.
    u = stacked([np.exp(smoothed(np.log(plane), (0.2 / lam) ** 2)) for plane in as_planes(bright)])
    return Decomposition(u, np.asarray(bright / u, np.float32), lam, "wls")


def smoothed(f: NDArray[Any], strength: float) -> NDArray[np.float64]:
    """Return u of [1]_ for μ = `strength`."""
    try:
        from scipy import sparse
        from scipy.sparse.linalg import splu
    except ModuleNotFoundError:
        raise OptionError("method: wls needs an extra: pip install 'relit[baselines]'") from None

    height, width = f.shape
    f = f.astype(np.float64)
    down, across = (strength / (np.abs(np.diff(f, axis=axis)) ** _ALPHA + _EPSILON) for axis in (0, 1))
    down, across = np.pad(down, ((0, 1), (0, 0))).ravel(), np.pad(across, ((0, 0), (0, 1))).ravel()
    n = np.arange(f.size)
    below, beside = n[:-width], n[:-1]
    rows, columns = np.concatenate((below, beside)), np.concatenate((below + width, beside + 1))
    weights = np.concatenate((down[:-width], across[:-1]))
    adjacent: Any = sparse.coo_array((weights, (rows, columns)), shape=(f.size, f.size))
    adjacent = adjacent + adjacent.T
    system = sparse.eye_array(f.size) + sparse.diags_array(adjacent.sum(axis=0)) - adjacent
    return np.asarray(splu(system.tocsc()).solve(f.ravel())).reshape(height, width)


def guided(guide: NDArray[Any], image: NDArray[Any], size: int) -> NDArray[np.float64]:
    """Return an image as, in windows of some size, a linear function of a guide [3]_."""

    def mean(plane: NDArray[Any]) -> NDArray[np.float64]:
        return window_mean(plane, size, repeated=True)

    of_guide, of_image = mean(guide), mean(image)
    slope = (mean(guide * image) - of_guide * of_image) / (mean(guide * guide) - of_guide**2 + _GUIDE**2)
    return np.asarray(mean(slope) * guide + mean(of_image - slope * of_guide))
