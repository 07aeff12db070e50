"""Pixel neighbourhoods: the steps, weights and pairs of anisotropic total variation."""

from __future__ import annotations

from dataclasses import dataclass
from numbers import Real
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from relit.errors import ImageError, OptionError

if TYPE_CHECKING:
    from numpy.typing import NDArray

Neighborhood = Literal[4, 8, 16]

#: Weights are integers in units of 2⁻²⁰, so that flows and energies add up without rounding.
UNIT = 2**20

_STEPS: dict[int, tuple[tuple[int, int], ...]] = {
    4: ((0, 1), (1, 0)),
    8: ((0, 1), (1, 0), (1, 1), (1, -1)),
    16: ((0, 1), (1, 0), (1, 1), (1, -1), (1, 2), (2, 1), (2, -1), (1, -2)),
}


@dataclass(frozen=True)
class Grid:
    """A neighbourhood: its steps and their weights.

    Attributes
    ----------
    steps : tuple of (int, int)
        One ``(dy, dx)`` per pair of opposite directions.
    weights : tuple of int
        Weight of each step, in `UNIT`.
    """

    steps: tuple[tuple[int, int], ...]
    weights: tuple[int, ...]

    @classmethod
    def of(cls, neighborhood: int) -> Grid:
        """Return the grid with 4, 8 or 16 neighbours.

        A line of direction φ crosses the steps e of a grid with density ``|e × φ|``; summing
        ``Δφ_e / (2 |e|)`` over the crossings gives its length (Cauchy-Crofton), where ``Δφ_e`` is the share
        of directions that step e stands for: half the gap to each of its neighbours in angle.

        Raises
        ------
        OptionError
            For any other number of neighbours.
        """
        if neighborhood not in _STEPS:
            raise OptionError(f"neighborhood: expected 4, 8 or 16, got {neighborhood!r}")
        steps = _STEPS[neighborhood]
        if neighborhood == 4:
            return cls(steps, (UNIT, UNIT))
        angles = np.arctan2([dy for dy, _ in steps], [dx for _, dx in steps]) % np.pi
        order = np.argsort(angles)
        gaps = np.diff(angles[order], append=angles[order[0]] + np.pi)
        shares = np.empty(len(steps))
        shares[order] = (gaps + np.roll(gaps, 1)) / 2
        weights = shares / (2 * np.hypot(*np.transpose(steps)))
        return cls(steps, tuple(int(weight) for weight in np.rint(weights * UNIT)))

    def fidelity(self, lam: float) -> int:
        """Return λ in `UNIT`: at least 1; at most 1 above a pixel's sum of weights, where only f is left."""
        check_lam(lam)
        return int(min(max(round(lam * UNIT), 1), 2 * sum(self.weights) + 1))


def check_lam(lam: float) -> None:
    """Refuse a λ that is not a finite number above 0."""
    number = isinstance(lam, Real) and not isinstance(lam, bool)
    if not (number and np.isfinite(lam) and lam > 0):
        raise OptionError(f"lam: expected a finite number above 0, got {lam!r}; the paper uses 0.2")


def check_plane(image: NDArray[Any], name: str = "image") -> None:
    """Refuse what is not one channel of finite numbers."""
    if not isinstance(image, np.ndarray) or image.dtype.kind not in "uif":
        given = getattr(image, "dtype", type(image).__name__)
        raise ImageError(f"{name}: expected an array of integers or floats, got {given}")
    if image.ndim != 2 or image.size == 0:
        raise ImageError(f"{name}: expected one channel of shape (H, W), got {image.shape}")
    if image.dtype.kind == "f" and not np.isfinite(image).all():
        raise ImageError(f"{name}: has values that are NaN or infinite; replace them first")


def paired(shape: tuple[int, ...], step: tuple[int, int]) -> tuple[tuple[slice, slice], tuple[slice, slice]]:
    """Return the slices of all pixels with a neighbour at `step`, and of those neighbours."""
    (height, width), (dy, dx) = shape, step
    rows = slice(0, max(height - dy, 0)), slice(dy, height)
    across = (max(-dx, 0), width - max(dx, 0)), (max(dx, 0), width - max(-dx, 0))
    columns = tuple(slice(start, max(stop, start)) for start, stop in across)
    return (rows[0], columns[0]), (rows[1], columns[1])
