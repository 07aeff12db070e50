"""TV-L1 [1]_: the minimiser of ``TV(u) + λ ‖f - u‖₁``, exactly, for anisotropic total variation.

**Total variation** is ``Σ w_pq |u_p - u_q|`` over the pairs of neighbours, with unit weights for 4 neighbours
and the Cauchy-Crofton weights of [2]_ for 8 and 16.

**Co-area.** Both terms are sums over thresholds t, and so is the energy: of ``TV([u ≥ t])`` and
``λ ‖[f ≥ t] - [u ≥ t]‖₁``, which is the capacity of a cut. So ``[u ≥ t]`` is the source side of a minimum cut
between the pixels that are at or above t and those below, and the smallest of these are nested [3]_.

**Halving.** Since they are nested, an image of K distinct values takes ⌈log₂ K⌉ cuts of the whole grid: each
halves the range of values of every pixel. Arcs between pixels of different ranges are saturated from then on,
and the flow of every round stays feasible in the next, which is why one array of residuals serves all rounds.
The first starts from a flow that is nearly maximal for all thresholds at once (`warm_start`).

**Certificate.** The last flow solves the dual for all thresholds at once. It is within the weights and no
pixel keeps more than λ of it, so that ``Σ f·div flow`` is at most the energy of any image: u attains it.

**Contrast invariance.** Only the order of the values matters: ``TVL1(g(f)) = g(TVL1(f))`` for increasing g.
So we solve for ranks and never quantise: any bit depth, any floats, and the LTV model's logarithm for free.

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
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from relit.runtime.jit import compiled
from relit.runtime.threads import bands, pool, split
from relit.solver.graph import Graph, Ints
from relit.solver.mincut import cut
from relit.solver.neighborhoods import UNIT, Grid, Neighborhood, check_plane
from relit.solver.search_forest import Events
from relit.solver.warm_start import nearly_maximal_flow

if TYPE_CHECKING:
    from numpy.typing import NDArray


# Pixels of a band that cuts work on. A search goes to and fro: over a whole image of 512², half
# of its time is spent on waiting for the memory. By trial on photos, 2¹⁵ to 2¹⁷ do as well.
_BAND = 2**16


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
    events : Events
        How much searching it took.
    """

    u: NDArray[Any]
    flow: NDArray[np.int32]
    events: Events


def tv_l1(
    image: NDArray[Any], lam: float, neighborhood: Neighborhood = 4, *, threads: int | None = None
) -> NDArray[Any]:
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
    threads : int, optional
        How many to use at most; by default, as many as can run at once. It changes nothing but the time.

    Returns
    -------
    (H, W) array
        Of the image's dtype, with values that occur in the image; the smallest where minimisers tie.

    Raises
    ------
    ImageError
        If the image is not a finite (H, W) array.
    OptionError
        If λ, the neighbourhood or the number of threads is out of range.

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
    return _minimise(image, lam, neighborhood, threads)[0]


def solve(
    image: NDArray[Any], lam: float, neighborhood: Neighborhood = 4, *, threads: int | None = None
) -> Solution:
    """Minimise as `tv_l1` does and return the flow as well.

    Examples
    --------
    >>> import numpy as np
    >>> f = np.eye(5, dtype=np.uint8)
    >>> solve(f, lam=0.8).flow.shape
    (2, 5, 5)
    """
    u, graph, levels, events = _minimise(image, lam, neighborhood, threads, feasible=True)
    return Solution(u, graph.flow(levels, Grid.of(neighborhood)), events)


def _minimise(
    image: NDArray[Any],
    lam: float,
    neighborhood: Neighborhood,
    threads: int | None,
    *,
    feasible: bool = False,
) -> tuple[NDArray[Any], Graph, Ints, Events]:
    """Return u, its graph, its ranks, and the events. If `feasible`, the flow keeps to λ at every pixel."""
    check_plane(image)
    grid = Grid.of(neighborhood)
    fidelity = grid.fidelity(lam)
    rows = bands(image.shape, threads)
    events = Events()
    values, ranks, shares = _ranks(image)
    last = len(values) - 1
    with pool(len(rows)) as run:
        # The flow has no other name, so that its memory serves the graph.
        graph = Graph.of_flow(nearly_maximal_flow(shares[ranks], fidelity / UNIT, grid, rows, run), grid)
        parts = [graph.band(pair) for pair in bands(image.shape, max(len(rows), image.size // _BAND))]
        half = 1 << last.bit_length() >> 1
        # The source gives λ to every pixel at or above the threshold; one below has to give it to the sink.
        graph.pixels(graph.excess)[:] += np.where(ranks >= half, np.int32(fidelity), np.int32(-fidelity))
        f = np.full_like(graph.excess, -1)
        graph.pixels(f)[:] = ranks
        del ranks
        low = np.zeros_like(graph.excess)
        while half > 0:
            events = events.plus([cut(graph, parts, run)])
            run(partial(_halve, graph, f, low, half, fidelity), parts)
            half //= 2
        if feasible:
            # The thresholds below the least value and above the greatest cut nothing off, but ask that no
            # pixel keeps more than λ. Where u is neither value, the other thresholds have seen to that.
            graph.excess[(low == last) & (f >= last)] -= 2 * fidelity
            graph.excess[(low > 0) & (low < last)] = 0
            events = events.plus([cut(graph, parts, run)])
    levels = graph.pixels(low)
    u = np.empty(image.shape, image.dtype)
    for first, stop in split(len(image), 1 + image.size // 2**20):  # indexing takes 8 bytes a pixel
        u[first:stop] = values[levels[first:stop]]
    return u, graph, levels, events


def _ranks(image: NDArray[Any]) -> tuple[NDArray[Any], Ints, NDArray[np.float32]]:
    """Return the values that occur, each pixel's rank among them, and the share of pixels below each."""
    if image.dtype.kind in "ui" and image.dtype.itemsize <= 2:
        # Counting beats sorting where values are few.
        lowest = int(image.min())
        codes = image.astype(np.int32) - lowest
        counts = np.bincount(codes.ravel())
        present = counts > 0
        ranks = (np.cumsum(present, dtype=np.int32) - 1)[codes]
        values, counts = (np.flatnonzero(present) + lowest).astype(image.dtype), counts[present]
    else:
        values, inverse, counts = np.unique(image, return_inverse=True, return_counts=True)
        ranks = inverse.reshape(image.shape).astype(np.int32)
    shares = (np.cumsum(counts) - counts / 2) / image.size
    return values, ranks, shares.astype(np.float32)


@compiled
def _halve(graph: Graph, f: Ints, low: Ints, half: int, fidelity: int, band: tuple[int, int]) -> None:
    """Close the arcs that the cut crosses, halve every pixel's range by it, and turn to the next thresholds.

    Across the cut the source side sends all it can; what could flow back must not, from now on.
    """
    start, stop = band
    reached, excess = graph.reached[start:stop], graph.excess[start:stop]
    f, low = f[start:stop], low[start:stop]
    for k in range(graph.offset.size):
        q = start + graph.offset[k]
        residual, other = graph.residual[k, start:stop], graph.reached[q : q + stop - start]
        for x in range(residual.size):
            residual[x] *= reached[x] == other[x]
    for x in range(f.size):
        was_above = np.int32(f[x] >= low[x] + half)
        low[x] += half * reached[x]
        is_above = np.int32(f[x] >= low[x] + half // 2)
        excess[x] += 2 * fidelity * (is_above - was_above)
