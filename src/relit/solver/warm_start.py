"""A nearly maximal flow for all thresholds of anisotropic TV-L1 at once, from a primal-dual method.

The dual of TV-L1 is one flow that serves every threshold: the most ``Σ f·div p`` with ``|p| ≤ w`` on the arcs
and ``|div p| ≤ λ`` at the pixels. Some primal-dual iterations bring p near to it at the price of a few
additions a pixel, and leave to the exact cuts what is short-range and small. Whatever p is, the cuts end at
the same minimiser: accuracy is a matter of speed alone, and float32 will do.

An iteration brings flow a pixel further. So they begin at the saddle point of the image at half the size, and
that at one of a quarter, down to where flow has less than a pixel to travel.

Since only the order of the values matters, f is best given as the share of pixels that are darker: every
threshold's problem then has its part in the scale.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from relit.runtime.threads import bands
from relit.solver.neighborhoods import UNIT, paired
from relit.solver.primal_dual_iteration import SaddlePoint

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from relit.runtime.threads import Run
    from relit.solver.neighborhoods import Grid

    Floats = NDArray[np.float32]

# Found by trial on photos: the time to the exact minimiser is flat around them.
_STEP_RATIO = 0.05
_ITERATIONS = 100
_ITERATIONS_PER_SCALE = 8  # and so many for each pixel of the scale 1/λ, which flow has to travel
_MOST_ITERATIONS = 2000
_LEAST_SIZE = 16  # of an image that has a coarser one


def nearly_maximal_flow(
    f: Floats, lam: float, grid: Grid, rows: Sequence[tuple[int, int]], run: Run
) -> NDArray[Any]:
    """Return the flow from each pixel along each of the grid's steps, within their weights: (D/2, H, W).

    f is of values in [0, 1], and λ in px⁻¹. The ranges of rows cover the image in order: `run` works on them
    at once, which does not change the result. Where a step leaves the image, the flow is 0.
    """
    flow = _saddle_point(f, lam, grid, rows, run).p
    np.negative(flow, out=flow)  # p climbs where flow runs down
    bounds = np.array(grid.weights, np.float32)[:, None, None] / np.float32(UNIT)
    return np.clip(flow, -bounds, bounds, out=flow)


def _saddle_point(
    f: Floats, lam: float, grid: Grid, rows: Sequence[tuple[int, int]], run: Run
) -> SaddlePoint:
    """Iterate from the saddle point of the image at half the size, as long as flow has a pixel to travel."""
    start = None
    if lam < 1 and min(f.shape) >= _LEAST_SIZE:
        half = _halved(f)
        # Of two by two pixels, the length doubles and the area is fourfold.
        coarse = _saddle_point(half, 2 * lam, grid, bands(half.shape, len(rows)), run)
        start = _doubled(coarse.u, f.shape), _doubled_flow(coarse.p, f.shape, grid)
        del half, coarse
    weights = [weight / UNIT for weight in grid.weights]
    iteration = SaddlePoint(f, lam, grid.steps, weights, ratio=_STEP_RATIO, rows=rows, run=run)
    if start is not None:
        iteration.start(*start)
    del start
    iteration.advance(min(round(_ITERATIONS + _ITERATIONS_PER_SCALE / lam), _MOST_ITERATIONS))
    return iteration


def _halved(f: Floats) -> Floats:
    """Return the means of two by two pixels."""
    height, width = f.shape
    even = np.pad(f, ((0, height % 2), (0, width % 2)), mode="edge")
    down = even[::2] + even[1::2]
    return np.asarray((down[:, ::2] + down[:, 1::2]) / 4, np.float32)


def _doubled(coarse: Floats, shape: tuple[int, ...], step: tuple[int, int] = (0, 0)) -> Floats:
    """Interpolate values that belong to the middle of a step to pixels half as far apart."""
    fine = coarse
    for axis, (size, length) in enumerate(zip(shape, step, strict=True)):
        last = coarse.shape[axis] - 1
        at = np.clip(np.arange(size) / 2 - (1 + length) / 4, 0, last)
        low = at.astype(np.intp)
        share = (at - low).astype(np.float32).reshape((-1, 1) if axis == 0 else (1, -1))
        below = np.take(fine, low, axis)
        fine = below + share * (np.take(fine, np.minimum(low + 1, last), axis) - below)
    return fine


def _doubled_flow(coarse: Floats, shape: tuple[int, ...], grid: Grid) -> Floats:
    flow = np.zeros((len(grid.steps), *shape), np.float32)
    for k, step in enumerate(grid.steps):
        here, _ = paired(shape, step)
        flow[k][here] = _doubled(coarse[k], shape, step)[here]
    return flow
