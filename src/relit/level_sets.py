"""TV-L1 [1]_: the minimiser of ``TV(u) + λ ‖f - u‖₁``, exactly where the total variation is anisotropic.

**Anisotropic** (4, 8 or 16 neighbours). Total variation is ``Σ w_pq |u_p - u_q|`` over the pairs of
neighbours, with unit weights for 4 neighbours and the Cauchy-Crofton weights of [2]_ for 8 and 16. By the
discrete co-area formula the energy is a sum over thresholds, each a binary cut, and their minimisers are
nested [3]_. So an image of K distinct values takes ⌈log₂ K⌉ cuts of the whole grid: each halves the range of
values of every pixel. Arcs between pixels of different ranges are saturated from then on, and the flow of
every round stays feasible in the next, which is why one array of residuals serves all rounds.

Only the order of the values matters (*contrast invariance*: ``TVL1(g(f)) = g(TVL1(f))`` for increasing g), so
we solve for ranks and never quantise: any bit depth, any float image, and the LTV model's logarithm for free.

Where minimisers tie, the result is the **smallest** one, pixel by pixel.

References
----------
.. [1] T. F. Chan, S. Esedoglu, "Aspects of total variation regularized L1 function approximation", SIAM J.
       Appl. Math. 65(5), 2005.
.. [2] Y. Boykov, V. Kolmogorov, "Computing geodesics and minimal surfaces via graph cuts", ICCV 2003.
.. [3] J. Darbon, M. Sigelle, "Image restoration with discrete constrained total variation", J. Math. Imaging
       Vis. 26, 2006; the parametric max-flow of D. Goldfarb, W. Yin, SIAM J. Sci. Comput. 31(5), 2009, is the
       route that the paper takes to the same minimiser.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numba import njit

from relit.grid import Grid, Neighborhood, check_plane, paired
from relit.mincut import cut, settle_chains

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from relit.mincut import Ints, Steps


@dataclass(frozen=True, eq=False)
class Solution:
    """An exact minimiser and the flow that proves it.

    Attributes
    ----------
    u : (H, W) array
        The smallest minimiser, of the image's dtype.
    flow : (D/2, H, W) int32 array
        Flow from each pixel along each of the grid's steps, in `UNIT`: the dual solution of all thresholds
        at once. 0 where a step leaves the image.
    """

    u: NDArray[Any]
    flow: NDArray[np.int32]


def tv_l1(image: NDArray[Any], lam: float, neighborhood: Neighborhood = 4) -> NDArray[Any]:
    """Return the exact minimiser ``u`` of anisotropic TV-L1.

    Parameters
    ----------
    image : (H, W) array
        One channel of any integer or float dtype: f.
    lam : float
        λ in px⁻¹. Structures of a scale (area over half their boundary, for large convex ones) below about
        1/λ leave u. Above the sum of a pixel's weights (4 for 4 neighbours) ``u = f``.
    neighborhood : {4, 8, 16}
        Neighbours of a pixel. More come closer to the rotation-invariant length, and take longer.

    Returns
    -------
    (H, W) array
        Of the image's dtype, with values that occur in the image; the smallest where minimisers tie.

    Raises
    ------
    ImageError
        If the image is not a finite (H, W) array.
    OptionError
        If λ or the neighbourhood is out of range.

    Examples
    --------
    A speck of one pixel has a boundary of 4 and goes when λ < 4; a block of 3 by 3 pixels goes when 9 λ < 12.

    >>> import numpy as np
    >>> f = np.zeros((7, 9), np.uint8)
    >>> f[2:5, 1:4] = 200
    >>> f[3, 6] = 200
    >>> u = tv_l1(f, lam=2)
    >>> int(u[3, 2]), int(u[3, 6]), int(tv_l1(f, lam=1).max())
    (200, 0, 0)
    """
    return solve(image, lam, neighborhood).u


def solve(image: NDArray[Any], lam: float, neighborhood: Neighborhood = 4) -> Solution:
    """Minimise as `tv_l1` does and return the flow as well.

    Examples
    --------
    >>> import numpy as np
    >>> f = np.eye(5, dtype=np.uint8)
    >>> solve(f, lam=0.8).flow.shape
    (2, 5, 5)
    """
    check_plane(image)
    grid = Grid.of(neighborhood)
    fidelity = grid.fidelity(lam)
    values, ranks = np.unique(image, return_inverse=True)
    height, width = image.shape
    # Steps reach two pixels at most. The right margin of a row serves the next row as its left one.
    margin = max(abs(step) for pair in grid.steps for step in pair)
    stride = width + margin
    inside = np.zeros((height + 2 * margin, stride), np.bool_)
    inside[margin:-margin, :width] = True

    offset = np.array([s * (dy * stride + dx) for dy, dx in grid.steps for s in (1, -1)], np.int64)
    residual = _full_capacities(inside.ravel(), offset, np.repeat(np.array(grid.weights, np.int32), 2))
    f, low, high = (np.zeros(inside.size, np.int32) for _ in range(3))
    f[inside.ravel()] = ranks.ravel()
    high[inside.ravel()] = len(values) - 1
    outflow = np.zeros(inside.size, np.int32)
    excess = np.empty(inside.size, np.int32)
    carry = np.empty(inside.size, np.int32)
    while _open_round(f, low, high, outflow, fidelity, excess):
        settle_chains(residual, excess, offset, carry)
        side = cut(residual, excess, offset)
        _close_round(side, f, low, high, outflow, fidelity, excess, residual, offset)

    u = values[low.reshape(inside.shape)[margin:-margin, :width]]
    return Solution(u, _read_flow(residual, offset, low, inside.shape, margin, grid))


def _read_flow(
    residual: NDArray[np.int32],
    offset: NDArray[np.int64],
    low: NDArray[np.int32],
    padded: tuple[int, ...],
    margin: int,
    grid: Grid,
) -> NDArray[np.int32]:
    height, width = padded[0] - 2 * margin, padded[1] - margin
    ranks = low.reshape(padded)[margin:-margin, :width]
    flow = np.zeros((len(grid.steps), height, width), np.int32)
    left = residual.reshape(*padded, len(offset))[margin:-margin, :width]
    for k, (step, weight) in enumerate(zip(grid.steps, grid.weights, strict=True)):
        here, there = paired((height, width), step)
        sent = (left[there][..., 2 * k + 1] - left[here][..., 2 * k]) // 2
        # Arcs across a level line were saturated downhill, then closed.
        flow[k][here] = np.where(
            ranks[here] == ranks[there], sent, weight * np.sign(ranks[here] - ranks[there])
        )
    return flow


@njit(cache=True, nogil=True)
def _full_capacities(inside: NDArray[np.bool_], offset: Steps, weights: Ints) -> Ints:
    residual = np.zeros((inside.size, offset.size), np.int32)
    for p in range(inside.size):
        if inside[p]:
            for k in range(offset.size):
                if inside[p + offset[k]]:
                    residual[p, k] = weights[k]
    return residual


@njit(cache=True, nogil=True)
def _open_round(f: Ints, low: Ints, high: Ints, outflow: Ints, fidelity: int, excess: Ints) -> bool:
    """Set every pixel's excess for the middle of its range; return whether any range is still open.

    A pixel at or above the threshold gets λ from the source, one below owes λ to the sink, less what its
    flows of earlier rounds already carry. A pixel whose range is closed takes no part.
    """
    any_open = False
    for p in range(f.size):
        excess[p] = 0
        if low[p] < high[p]:
            any_open = True
            above = f[p] >= (low[p] + high[p] + 1) // 2
            excess[p] = (fidelity if above else -fidelity) - outflow[p]
    return any_open


@njit(cache=True, nogil=True)
def _close_round(
    side: NDArray[np.bool_],
    f: Ints,
    low: Ints,
    high: Ints,
    outflow: Ints,
    fidelity: int,
    excess: Ints,
    residual: Ints,
    offset: Steps,
) -> None:
    """Halve the ranges by the cut, keep account of the flows, and close the arcs that it crosses."""
    for p in range(f.size):
        if low[p] < high[p]:
            middle = (low[p] + high[p] + 1) // 2
            outflow[p] = (fidelity if f[p] >= middle else -fidelity) - excess[p]
            if side[p]:
                low[p] = middle
            else:
                high[p] = middle - 1
        for k in range(offset.size):
            if residual[p, k] != 0 and side[p] != side[p + offset[k]]:
                # The source side sends all it can; what could flow back must not, from now on.
                residual[p, k] = 0
