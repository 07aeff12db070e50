"""Radial functions φ(|x - xᵢ|) of scattered centers, also of centers that nearly coincide: twins.

Twins have huge coefficients of opposite sign, and a sum of them is as wrong as its order makes it, which is
another with every BLAS. So of twins i and j

    cᵢ φᵢ + cⱼ φⱼ  =  cᵢ (φᵢ - φⱼ) + (cᵢ + cⱼ) φⱼ

is solved for and evaluated as on the right, the difference in a form that does not cancel. With T the matrix
that takes these differences, ``Φ c = (Φ T) (T⁻¹ c)``; without twins it is the identity.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from relit.photo.channels import squared_distances
from relit.photo.curves import log

if TYPE_CHECKING:
    from numpy.typing import NDArray

_TINY = np.finfo(float).tiny
_TWINS = 1e-3  # how near twins are, in units of the scale; further apart, the plain sum is right enough


@dataclass(frozen=True, eq=False)
class Basis:
    """The functions φᵢ as an `RBF` has them; the thin-plate spline's logarithm takes r in another `unit`."""

    centers: NDArray[np.float64]
    kernel: str
    radius: float
    scale: float
    unit: float

    def __call__(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return Φ T at (k, 2) points: (k, n), of each center φᵢ, or of a twin φᵢ - φⱼ."""
        return self.of_squares(squared_distances(points, self.centers) / self.scale**2, points)

    def squares(self, places: NDArray[Any], axis: int) -> NDArray[np.float64]:
        """Return the squared distances of places along one axis from the centers, in units of the scale."""
        return np.asarray(np.square(np.subtract.outer(places, self.centers[:, axis]) / self.scale))

    def of_squares(self, square: NDArray[np.float64], points: NDArray[Any]) -> NDArray[np.float64]:
        """Return Φ T at points whose squared distances, in units of the scale, are known: (k, n)."""
        basis = self._phi(square)
        twins, earlier = self._twins
        if len(twins):
            # |x - xᵢ|² - |x - xⱼ|² = ((x - xᵢ) + (x - xⱼ))·(xⱼ - xᵢ)
            to_twins, to_earlier = (points[:, None] - self.centers[which] for which in (twins, earlier))
            apart = self.centers[earlier] - self.centers[twins]
            rise = ((to_twins + to_earlier) * apart).sum(axis=-1) / self.scale**2
            low = np.minimum(square[:, twins], square[:, earlier])
            basis[:, twins] = np.sign(rise) * self._phi_rise(low, np.abs(rise))
        return basis

    @property
    def differences(self) -> NDArray[np.float64]:
        """T, (n, n): unit upper triangular, with -1 in the column of a twin i, row j."""
        twins, earlier = self._twins
        differences = np.eye(len(self.centers))
        differences[earlier, twins] = -1
        return differences

    def of_differences(self, coefficients: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return T⁻¹ c."""
        solved = coefficients.copy()
        twins, earlier = self._twins
        for twin, other in zip(twins[::-1], earlier[::-1], strict=True):  # a twin may be another's other
            solved[other] += solved[twin]
        return solved

    @cached_property
    def _twins(self) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """The centers i that nearly coincide with earlier ones, and the nearest such j of each."""
        square = squared_distances(self.centers, self.centers)
        apart = np.where(np.tri(len(square), k=-1, dtype=bool), np.sqrt(square), np.inf)
        twins = np.flatnonzero(apart.min(axis=1) < _TWINS * self.scale)
        return twins, apart[twins].argmin(axis=1)

    def _phi(self, square: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return φ of squared distances."""
        if self.kernel == "gaussian":
            return np.exp(-square * (self.scale / self.radius) ** 2)
        if self.kernel == "multiquadric":
            return -np.sqrt(square + (self.radius / self.scale) ** 2)
        made = log(np.maximum(square, _TINY))  # 0 log 0 is 0
        if self.unit != 1:
            made += 2 * np.log(self.unit)
        made *= square
        made *= 0.5
        return made

    def _phi_rise(self, low: NDArray[np.float64], rise: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return φ(low + rise) - φ(low), right to the last digits however small the rise."""
        high = low + rise
        if self.kernel == "gaussian":
            return np.asarray(self._phi(low) * np.expm1(-rise * (self.scale / self.radius) ** 2))
        if self.kernel == "multiquadric":
            return np.asarray(rise / (self._phi(low) + self._phi(high)))
        # high log high - low log low = (high - low) log high + low log(high / low)
        bend = low * np.log1p(rise / np.maximum(low, _TINY))
        return np.asarray(0.5 * (rise * np.log(np.maximum(high * self.unit**2, _TINY)) + bend))
