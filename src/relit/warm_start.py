"""A nearly maximal flow for all thresholds of anisotropic TV-L1 at once, from a primal-dual method.

The dual of TV-L1 is one flow that serves every threshold: the most ``Σ f·div p`` with ``|p| ≤ w`` on the arcs
and ``|div p| ≤ λ`` at the pixels. Some iterations of Chambolle and Pock's method [1]_, over-relaxed, bring p
near to it at the price of a few additions a pixel, and leave to the exact cuts what is short-range and small.
Whatever p is, the cuts end at the same minimiser: accuracy is a matter of speed alone, and float32 will do.

Since only the order of the values matters, f is taken as the share of pixels that are darker: every
threshold's problem then has its part in the scale.

Iterations are staggered: while the first of a batch is at row y, the next is at row ``y - reach``, and so on,
so that a batch passes through the memory once. Bands of rows carry as many rows of their neighbours with them
as a batch uses up, and are therefore independent of one another until its end.

References
----------
.. [1] A. Chambolle, T. Pock, "A first-order primal-dual algorithm for convex problems with applications to
       imaging", J. Math. Imaging Vis. 40, 2011.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from relit.grid import UNIT

if TYPE_CHECKING:
    from relit.grid import Grid
    from relit.threads import Run

Floats = NDArray[np.float32]

# Found by trial on photos: the time to the exact minimiser is flat around them.
_STEP_RATIO = 0.07  # primal over dual step, for f in [0, 1]
_ITERATIONS = 100
_ITERATIONS_PER_SCALE = 20  # and so many for each pixel of the scale 1/λ, which flow has to travel
_MOST_ITERATIONS = 2000

_RELAXATION = np.float32(1.9)  # below 2, where the method still converges
_BATCH = 8  # iterations in one pass through the memory


class _Band(NamedTuple):
    """Some rows of f, u, its extrapolation, and p for every step of the grid."""

    f: Floats
    u: Floats
    ahead: Floats
    p: Floats


def nearly_maximal_flow(
    f: Floats, lam: float, grid: Grid, rows: Sequence[tuple[int, int]], run: Run
) -> Floats:
    """Return the flow from each pixel along each of the grid's steps, within their weights.

    Parameters
    ----------
    f : (H, W) float32 array
        Values in [0, 1].
    lam : float
        λ in px⁻¹.
    grid : Grid
        The neighbourhood.
    rows : sequence of (int, int)
        Ranges of rows that cover the image in order: the bands to work on at once.
        They do not change the result.
    run : Run
        Works on the bands.

    Returns
    -------
    (D/2, H, W) float32 array
        0 where a step leaves the image.
    """
    steps = np.array(grid.steps, np.int64)
    weights = np.array(grid.weights, np.float32) / np.float32(UNIT)
    norm = np.sqrt(4 * len(steps))  # at least that of the differences along all steps
    sizes = np.array([lam, _STEP_RATIO / norm, 1 / (_STEP_RATIO * norm)], np.float32)
    reach = int(steps[:, 0].max())
    height = len(f)
    spans = [(max(first - _BATCH * reach, 0), min(last + _BATCH * reach, height)) for first, last in rows]
    bands = []
    for first, last in spans:
        part = f[first:last]
        bands.append(_Band(part, part.copy(), part.copy(), np.zeros((len(steps), *part.shape), np.float32)))

    iterations = min(round(_ITERATIONS + _ITERATIONS_PER_SCALE / lam), _MOST_ITERATIONS)
    for _ in range(-(-iterations // _BATCH)):
        run(lambda band: _iterate(band, steps, weights, sizes, reach), bands)
        _share_rows(bands, spans, rows)
    flow = np.concatenate(
        [
            band.p[:, first - start : last - start]
            for band, (start, _), (first, last) in zip(bands, spans, rows, strict=True)
        ],
        axis=1,
    )
    np.negative(flow, out=flow)  # p climbs where flow runs down
    return np.clip(flow, -weights[:, None, None], weights[:, None, None], out=flow)


def _share_rows(
    bands: Sequence[_Band], spans: Sequence[tuple[int, int]], rows: Sequence[tuple[int, int]]
) -> None:
    """Give every band the rows of its neighbours anew."""
    for above in range(len(bands) - 1):
        below = above + 1
        border = rows[below][0]
        for source, target, first, last in (
            (above, below, spans[below][0], border),
            (below, above, border, spans[above][1]),
        ):
            start, to = spans[source][0], spans[target][0]
            for theirs, ours in zip(bands[source][1:], bands[target][1:], strict=True):
                ours[..., first - to : last - to, :] = theirs[..., first - start : last - start, :]


@njit(cache=True, nogil=True)
def _iterate(
    band: _Band,
    steps: NDArray[np.int64],
    weights: Floats,
    sizes: Floats,
    reach: int,
) -> None:
    """Take a batch of iterations. What its reach covers, from where the band was cut off, becomes wrong."""
    height, width = band.f.shape
    lam, tau, sigma = sizes
    divergence = np.empty(width, np.float32)
    for front in range(height + reach * (_BATCH - 1)):
        for i in range(_BATCH):
            y = front - reach * i
            if not 0 <= y < height:
                continue
            divergence[:] = 0
            for k in range(len(steps)):
                dy, dx = steps[k]
                left, right = max(-dx, 0), width - max(dx, 0)
                p = band.p[k, y, left:right]
                if y + dy < height:
                    here, there = band.ahead[y, left:right], band.ahead[y + dy, left + dx : right + dx]
                    _step_dual(p, here, there, divergence[left:right], weights[k], sigma)
                if y >= dy:
                    _subtract(divergence[left + dx : right + dx], band.p[k, y - dy, left:right])
            _step_primal(band.u[y], band.ahead[y], band.f[y], divergence, tau, tau * lam)


@njit(cache=True, nogil=True)
def _step_dual(
    p: Floats, here: Floats, there: Floats, divergence: Floats, weight: float, sigma: float
) -> None:
    for x in range(p.size):
        stepped = min(max(p[x] + sigma * (there[x] - here[x]), -weight), weight)
        p[x] += _RELAXATION * (stepped - p[x])
        divergence[x] += p[x]


@njit(cache=True, nogil=True)
def _subtract(divergence: Floats, p: Floats) -> None:
    for x in range(p.size):
        divergence[x] -= p[x]


@njit(cache=True, nogil=True)
def _step_primal(u: Floats, ahead: Floats, f: Floats, divergence: Floats, tau: float, pull: float) -> None:
    for x in range(u.size):
        v = u[x] + tau * divergence[x]
        # The proximal step of τλ|u - f| pulls towards f by at most τλ.
        v += min(max(f[x] - v, -pull), pull)
        ahead[x] = v + v - u[x]
        u[x] += _RELAXATION * (v - u[x])
