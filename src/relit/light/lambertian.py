"""A light: one direction and what comes from everywhere, fitted robustly to the brightness of a face.

A matt surface of one albedo has the brightness ``max(b·n, 0) + a``, with n its normal, b the direct light
times the albedo, and a the ambient one. What is darker than that is a cast shadow or a feature, what is
brighter a highlight: the fit gives them less and less weight the farther off they are [1]_.

References
----------
.. [1] P. J. Huber, "Robust estimation of a location parameter", Ann. Math. Statist. 35(1), 1964.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from relit.runtime.threads import one_blas_thread

if TYPE_CHECKING:
    from numpy.typing import NDArray

# What each of these is worth: docs/leaderboard.md, The constants.
_ROUNDS = 12
_SAMPLES = 40_000  # pixels of a face that a fit looks at; of fewer, it matters which
_LEAST = 1e-3  # brightness, of 1, that counts as a perfect fit
_OUTLIER = 1.5  # standard deviations, beyond which an error counts once and not squared [1]_
_OF_MEDIAN = 1.4826  # a normal distribution's standard deviation over its median absolute deviation


class Light(NamedTuple):
    """A light on a face, in the brightness that it makes.

    Attributes
    ----------
    direct : (3,) float64 array
        b: towards the light, ``(x, y, z)`` with z growing away from the camera.
    ambient : float
        a.
    """

    direct: NDArray[np.float64]
    ambient: float

    @property
    def strength(self) -> float:
        """Brightness of what looks straight into the light."""
        return float(np.linalg.norm(self.direct)) + self.ambient

    @property
    def slant(self) -> float:
        """Sine of the angle between the light and the camera's axis: 0 from the front, 1 from the side."""
        length = float(np.linalg.norm(self.direct))
        return float(np.hypot(*self.direct[:2])) / length if length > 0 else 0.0

    def on(self, normals: NDArray[Any]) -> NDArray[np.float64]:
        """Return the brightness of a surface in this light."""
        with one_blas_thread():
            return np.asarray(np.maximum(normals @ self.direct, 0) + self.ambient)

    def sensitivity(self, normals: NDArray[Any]) -> NDArray[np.float64]:
        """Return by how much the logarithm of the brightness changes per radian that a normal turns."""
        length = float(np.linalg.norm(self.direct))
        with one_blas_thread():
            cosine = np.clip(normals @ (self.direct / max(length, 1e-9)), -1, 1)
        return np.asarray(length * np.sqrt(1 - cosine**2) / np.maximum(self.on(normals), self.strength / 20))


def fit_light(image: NDArray[Any], normals: NDArray[Any], face: NDArray[np.bool_]) -> Light:
    """Find the light on a face.

    Parameters
    ----------
    image : (H, W) array
        Brightness in [0, 1].
    normals : (H, W, 3) array
        Of the surface, towards the camera.
    face : (H, W) bool array
        The pixels that count.

    Returns
    -------
    Light

    Examples
    --------
    >>> import numpy as np
    >>> angle = np.linspace(-1.2, 1.2, 50)
    >>> normals = np.stack([np.sin(angle), 0 * angle, -np.cos(angle)], axis=-1)[None]
    >>> lit = 0.6 * np.maximum(normals @ [-0.8, 0, -0.6], 0) + 0.1
    >>> light = fit_light(lit, normals, np.ones((1, 50), bool))
    >>> (light.direct[[0, 2]] / 0.6).round(2).tolist(), round(light.ambient, 2)
    ([-0.8, -0.6], 0.1)
    """
    step = max(1, int(np.count_nonzero(face)) // _SAMPLES)
    brightness = image[face][::step].astype(np.float64)
    surface = normals[face][::step].astype(np.float64)
    with one_blas_thread():
        b = np.append(_solved(surface, brightness)[:3], 0.0)
        trust = np.ones_like(brightness)
        for _ in range(_ROUNDS):
            lit = (surface @ b[:3] > 0)[:, None]
            root = np.sqrt(trust)
            b = (b + _solved(surface * lit * root[:, None], brightness * root, root)) / 2
            off = np.abs(np.maximum(surface @ b[:3], 0) + b[3] - brightness)
            trust = 1 / np.maximum(1, off / max(_OUTLIER * _OF_MEDIAN * float(np.median(off)), _LEAST))
    return Light(b[:3], float(b[3]))


def _solved(
    surface: NDArray[np.float64], brightness: NDArray[np.float64], ones: NDArray[np.float64] | None = None
) -> NDArray[np.float64]:
    """Return b and a by least squares; a is not negative."""
    columns = np.column_stack([surface, np.ones_like(brightness) if ones is None else ones])
    # The normal equations, of four unknowns; a face that is flat or black leaves some of them open.
    square, right = columns.T @ columns, columns.T @ brightness
    solution = np.linalg.lstsq(square, right, rcond=None)[0]
    if solution[3] < 0:
        solution = np.append(np.linalg.lstsq(square[:3, :3], right[:3], rcond=None)[0], 0.0)
    return np.asarray(solution)
