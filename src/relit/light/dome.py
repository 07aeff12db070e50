"""A light as lamps on a dome round the head, and how it is found from the brightness of a face.

A matt surface of one albedo, with normals n, has the brightness ``Σ w_j max(n·l_j, 0) V_j``: each lamp j
stands far off in the direction l_j, gives w_j ≥ 0, and is seen by the share V_j of `light.horizon`. The lamps
that explain a photo are found by non-negative least squares, which is inverse lighting [1]_. What is farther
off than most (highlights, features, shadows of what is not on the head) gets less and less weight [2]_.

References
----------
.. [1] S. R. Marschner and D. P. Greenberg, "Inverse lighting for photography", Color Imaging Conf., 1997.
.. [2] P. J. Huber, "Robust estimation of a location parameter", Ann. Math. Statist. 35(1), 1964.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from relit.light.horizon import horizons, visible
from relit.light.nonnegative import nonnegative
from relit.photo.ranks import median, quantile
from relit.photo.resampling import Enlarger, reduced
from relit.runtime.memo import remembered
from relit.runtime.threads import one_blas_thread

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from relit.face.shape import FaceShape

# What each of these is worth: docs/leaderboard.md, The constants.
_LAMPS = 100
_BEHIND = 0.3  # how far behind the head lamps stand, as the cosine of the angle to the camera's axis
_SEEN = 40.0  # px between the eyes where lamps are fitted and shadows are looked for: both are soft
_EVEN = 0.02  # how much an even light is preferred, of the mean square of what a lamp does
_ROUNDS, _ROUNDS_FROM_PRIOR = 5, 2
_SAMPLES = 4000  # pixels that a fit looks at
_OUTLIER = 1.5  # standard deviations, beyond which an error counts once and not squared [2]_
_OF_MEDIAN = 1.4826  # a normal distribution's standard deviation over its median absolute deviation
_LEAST = 1e-3  # brightness, of the brightest, that counts as a perfect fit
_ALL = slice(None)


def _dome() -> NDArray[np.float64]:
    """Return directions spread evenly, as a sunflower's seeds are: (n, 3), z growing away from the camera."""
    seed = np.arange(_LAMPS)
    toward = 1 - (1 + _BEHIND) * (seed + 0.5) / _LAMPS
    round_it = np.pi * (1 + 5**0.5) * (seed + 0.5)
    out = np.sqrt(1 - toward**2)
    return np.stack([out * np.cos(round_it), out * np.sin(round_it), -toward], axis=1)


#: Towards the lamps, (100, 3) unit vectors ``(x, y, z)``, z growing away from the camera.
DOME = _dome()


class Lamps(NamedTuple):
    """Lamps round a head.

    Attributes
    ----------
    directions : (n, 3) array
        Unit vectors towards them, ``(x, y, z)``, z growing away from the camera.
    weights : (n,) array
        The linear brightness that each makes on what looks into it.
    colors : (n, 3) array or None
        The same of red, green and blue, up to a factor of each; None of light that is all white.
    """

    directions: NDArray[np.float64]
    weights: NDArray[np.float64]
    colors: NDArray[np.float64] | None = None


@dataclass(frozen=True, eq=False)
class Surface:
    """What of a head light falls on: as coarse as shadows are soft, 27 to 60 px between the eyes.

    Attributes
    ----------
    normals : (h, w, 3) float32 array
    horizon : (16, h, w) float32 array
        As of `horizon.horizons`.
    factor : int
        By which the photo is reduced.
    shape : (int, int)
        Of the photo.
    """

    normals: NDArray[np.float32]
    horizon: NDArray[np.float32]
    factor: int
    shape: tuple[int, int]

    def basis(self, directions: NDArray[Any], at: NDArray[np.intp] | slice = _ALL) -> NDArray[np.float32]:
        """Return what a lamp of strength 1 does from each of n directions, (n, m); `at` is by rows."""
        facing = self.normals.reshape(-1, 3)[at].T
        horizon = self.horizon.reshape(len(self.horizon), -1)[:, at]
        with one_blas_thread():
            made: NDArray[np.float32] = directions.astype(np.float32) @ facing
        for does, share in zip(made, visible(horizon, directions), strict=True):
            np.maximum(does, 0, out=does)  # a lamp at a time: all of them fit no processor's cache
            does *= share
        return made

    def lit(self, lamps: Lamps) -> NDArray[np.float32]:
        """Return the brightness that lamps make, and if they have colours, those: (h, w, 1) or (h, w, 4)."""
        weights = lamps.weights[:, None]
        if lamps.colors is not None:
            weights = np.hstack([weights, lamps.colors])
        burning = weights.any(axis=1)  # of those that were found, few are
        basis = self.basis(lamps.directions[burning])
        with one_blas_thread():
            made = weights[burning].T.astype(np.float32) @ basis
        return np.ascontiguousarray(made.T).reshape(*self.normals.shape[:2], -1)

    def enlarged(self, planes: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return planes of this surface, (h, w, k), at the size of the photo, (H, W, k)."""
        return Enlarger(planes, self.factor, self.shape).rows(0, self.shape[0])


@remembered
def surface_of(shape: FaceShape, iod: float) -> Surface:
    """Return what of a head light falls on; `iod` is the interocular distance in px."""
    factor = max(round(iod / _SEEN), 1)
    normals = reduced(shape.normals, factor)
    depth = reduced(shape.depth, factor) / factor
    solid = reduced(shape.head.astype(np.float32), factor) > 0.5
    return Surface(normals, horizons(depth, solid, iod / factor), factor, shape.inside.shape)


def samples(count: int) -> slice:
    """Return which of so many pixels a fit looks at.

    Examples
    --------
    >>> samples(100), samples(10000)
    (slice(None, None, 1), slice(None, None, 3))
    """
    return slice(None, None, max(1, -(-count // _SAMPLES)))


def fit_lamps(
    basis: NDArray[Any],
    brightness: NDArray[Any],
    weight: NDArray[Any],
    *,
    prior: NDArray[np.float64] | None = None,
    tied: float = _EVEN,
) -> NDArray[np.float64]:
    """Find the lamps of the dome that light a face.

    Parameters
    ----------
    basis : (m, n) array
        What each lamp does at m pixels.
    brightness : (m,) array
        Linear, and not negative.
    weight : (m,) array
        How much each pixel counts, 0 to 1.
    prior : (n,) array, optional
        Lamps that the result is to be like; by default, all of one strength.
    tied : float
        How much it is to be like them.

    Returns
    -------
    (n,) float64 array
        w ≥ 0.

    Examples
    --------
    A ball that is lit from the left is found to be:

    >>> import numpy as np
    >>> from relit.light.dome import DOME, fit_lamps
    >>> x, y = np.random.default_rng(0).uniform(-0.7, 0.7, (2, 2000))
    >>> normals = np.stack([x, y, -np.sqrt(1 - x**2 - y**2)], axis=1)
    >>> basis = np.maximum(normals @ DOME.T, 0)
    >>> lamps = fit_lamps(basis, np.maximum(normals @ [-0.8, 0, -0.6], 0), np.ones(2000))
    >>> towards = lamps @ DOME
    >>> bool(np.arctan2(-towards[0], -towards[2]) > 0.7)
    True
    """
    some = samples(len(basis))
    does = np.ascontiguousarray(basis.T[:, some], np.float32)  # lamp by lamp
    brightness, weight = (np.asarray(one[some], np.float32) for one in (brightness, weight))
    count = len(does)
    scale = max(float(quantile(brightness, 0.9)), 1e-9)
    wanted = brightness / scale
    lamps = None if prior is None else prior / scale
    with one_blas_thread():
        for _ in range(_ROUNDS if prior is None else _ROUNDS_FROM_PRIOR):
            trust = weight if lamps is None else _trust(does, lamps, wanted, weight)
            half = does * np.sqrt(trust)
            square = (half @ half.T).astype(np.float64) / len(wanted)
            right = (does @ (trust * wanted)).astype(np.float64) / len(wanted)
            mean = max(float(np.trace(square)) / count, 1e-12)
            if prior is None:
                square += tied * mean * (np.eye(count) - 1 / count)
            else:
                square += tied * mean * np.eye(count)
                right += tied * mean * prior / scale
            lamps = nonnegative(square + 1e-6 * mean * np.eye(count), right, lamps)
    assert lamps is not None
    return np.asarray(lamps * scale)


def _trust(
    does: NDArray[np.float32],
    lamps: NDArray[np.float64],
    wanted: NDArray[np.float32],
    weight: NDArray[np.float32],
) -> NDArray[np.float32]:
    """Return how much each pixel counts, less where lamps leave it off."""
    off = np.abs(lamps.astype(np.float32) @ does - wanted)
    usual = _OUTLIER * _OF_MEDIAN * float(median(off[weight > 0])) if np.any(weight > 0) else 0.0
    return np.asarray(weight / np.maximum(1, off / max(usual, _LEAST)), np.float32)
