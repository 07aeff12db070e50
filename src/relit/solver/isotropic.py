"""Isotropic TV-L1 by a primal-dual method, stopped by its duality gap.

Minimises ``Σ |∇u| + λ Σ |f - u|`` with forward differences and the Euclidean length of the gradient, by the
iteration of `primal_dual_iteration`. Unlike the anisotropic kind it has no exact combinatorial solver and is
not exactly contrast-invariant, so the LTV model runs it on log I.

Since a minimiser stays within the range [a, b] of f, the minimum over that range of ``λ|f - u| - u div p``,
pixel by pixel, bounds the optimum from below for every p with ``|p| ≤ 1``: the gap needs no limit on
``div p`` and is an honest distance to the optimum at every iteration.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from relit.errors import OptionError
from relit.photo.pixels import size_and_dtype
from relit.runtime.jit import compiled
from relit.runtime.threads import bands, pool
from relit.solver.neighborhoods import check_lam, check_plane
from relit.solver.primal_dual_iteration import SaddlePoint

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Floats = NDArray[np.float64]

#: Primal over dual step for images scaled to [0, 1]: the ratio of the two distances to be travelled.
_STEP_RATIO = 0.08
_FEWEST_ITERATIONS = 24  # before the gap is measured again, which costs as much as several of them
_PATIENCE = 480  # and twice as many iterations as the best gap took: single precision is then exhausted


@dataclass(frozen=True, eq=False)
class IsotropicSolution:
    """An image near the minimum, and how near.

    Attributes
    ----------
    u : (H, W) float64 array
        In the range of the image.
    energy, bound : float
        ``Σ|∇u| + λ Σ|f - u|`` and what no image goes below, in the image's unit of intensity.
    iterations : int
        Number of iterations taken.
    """

    u: NDArray[np.float64]
    energy: float
    bound: float
    iterations: int

    def __repr__(self) -> str:
        """Return size and dtype, and how near it is."""
        return (
            f"IsotropicSolution({size_and_dtype(self.u)}, gap={self.gap:.3g}, iterations={self.iterations})"
        )

    @property
    def gap(self) -> float:
        """Relative duality gap, ``(energy - bound) / energy``; 0 for a constant image."""
        return (self.energy - self.bound) / self.energy if self.energy > 0 else 0.0


def tv_l1_isotropic(
    image: NDArray[Any],
    lam: float,
    *,
    tolerance: float = 1e-3,
    max_iterations: int = 20_000,
    threads: int | None = None,
) -> IsotropicSolution:
    """Minimise isotropic TV-L1 until the relative duality gap is at most `tolerance`.

    Parameters
    ----------
    image : (H, W) array
        One channel of any integer or float dtype: f.
    lam : float
        λ in px⁻¹. A disc of radius r leaves u where λ < 2/r.
    tolerance : float
        Relative gap to stop at, above 0.
    max_iterations : int
        Where to stop in any case; the solution then tells the gap that was reached.
    threads : int, optional
        How many to use at most; by default, as many as can run at once. It changes nothing but the time.

    Returns
    -------
    IsotropicSolution

    Raises
    ------
    ImageError
        If the image is not a finite (H, W) array.
    OptionError
        If λ, the tolerance, or the number of iterations or threads is out of range.

    Examples
    --------
    >>> import numpy as np
    >>> y, x = np.mgrid[-20:21, -20:21]
    >>> disc = (x**2 + y**2 <= 10**2).astype(float)
    >>> kept, lost = tv_l1_isotropic(disc, 2.4 / 10).u, tv_l1_isotropic(disc, 1.6 / 10).u
    >>> bool(kept[20, 20] > 0.99), bool(lost[20, 20] < 0.01)
    (True, True)
    """
    check_plane(image)
    check_lam(lam)
    if not tolerance > 0:
        raise OptionError(f"tolerance: expected a relative gap above 0, got {tolerance!r}")
    if max_iterations < 1:
        raise OptionError(f"max_iterations: expected at least 1, got {max_iterations!r}")
    lowest, highest = float(image.min()), float(image.max())
    span = highest - lowest
    if span == 0:
        return IsotropicSolution(image.astype(np.float64), 0.0, 0.0, 0)
    f = (image - lowest) / span
    rows = bands(f.shape, threads)
    with pool(len(rows)) as run:
        single, steps = f.astype(np.float32), ((0, 1), (1, 0))
        iteration = SaddlePoint(single, lam, steps, None, ratio=_STEP_RATIO, rows=rows, run=run)
        iterations = best_at = 0
        best = np.inf
        while True:
            u = np.clip(iteration.u.astype(np.float64), 0, 1)
            sums = np.concatenate(run(partial(_energies, u, iteration.p, f, lam), rows))
            energy, bound = (float(total) for total in sums.sum(axis=0))
            if energy - bound <= tolerance * energy or iterations >= max_iterations:
                return IsotropicSolution(lowest + span * u, span * energy, span * bound, iterations)
            if energy - bound < best:
                best, best_at = energy - bound, iterations
            elif iterations > 2 * best_at + _PATIENCE:
                iteration.refine(f)
            count = min(max(_FEWEST_ITERATIONS, iterations // 8), max_iterations - iterations)
            iteration.advance(count)
            iterations += count


@compiled
def _energies(u: Floats, p: NDArray[Any], f: Floats, lam: float, rows: tuple[int, int]) -> Floats:
    """Return each row's part in the energy of u, and in the bound that p, cut to ``|p| ≤ 1``, proves."""
    height, width = f.shape
    first, last = rows
    sums = np.zeros((last - first, 2))
    above = np.zeros(width)
    if first > 0:
        for x in range(width):
            above[x] = _cut_to_disc(p[0, first - 1, x], p[1, first - 1, x])[1]
    for y in range(first, last):
        before = 0.0
        for x in range(width):
            here = u[y, x]
            across = u[y, x + 1] - here if x + 1 < width else 0.0
            down = u[y + 1, x] - here if y + 1 < height else 0.0
            sums[y - first, 0] += np.sqrt(across * across + down * down) + lam * abs(here - f[y, x])
            to_right, to_below = _cut_to_disc(p[0, y, x], p[1, y, x])
            push = to_right - before + to_below - above[x]
            before, above[x] = to_right, to_below
            sums[y - first, 1] += min(-f[y, x] * push, lam * f[y, x], lam * (1 - f[y, x]) - push)
    return sums


@compiled
def _cut_to_disc(across: float, down: float) -> tuple[float, float]:
    """Return a vector, cut to a length of 1."""
    x, y = np.float64(across), np.float64(down)
    length = max(1.0, np.sqrt(x * x + y * y))
    return x / length, y / length
