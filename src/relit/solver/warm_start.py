"""A nearly maximal flow for all thresholds of anisotropic TV-L1 at once, from a primal-dual method.

The dual of TV-L1 is one flow that serves every threshold: the most ``Σ f·div p`` with ``|p| ≤ w`` on the arcs
and ``|div p| ≤ λ`` at the pixels. Some primal-dual iterations bring p near to it at the price of a few
additions a pixel, and leave to the exact cuts what is short-range and small. Whatever p is, the cuts end at
the same minimiser: accuracy is a matter of speed alone, and float32 will do.

Since only the order of the values matters, f is best given as the share of pixels that are darker: every
threshold's problem then has its part in the scale.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from relit.solver.neighborhoods import UNIT
from relit.solver.primal_dual_iteration import SaddlePoint

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from relit.runtime.threads import Run
    from relit.solver.neighborhoods import Grid

# Found by trial on photos: the time to the exact minimiser is flat around them.
_STEP_RATIO = 0.05
_ITERATIONS = 100
_ITERATIONS_PER_SCALE = 20  # and so many for each pixel of the scale 1/λ, which flow has to travel
_MOST_ITERATIONS = 2000


def nearly_maximal_flow(
    f: NDArray[np.float32], lam: float, grid: Grid, rows: Sequence[tuple[int, int]], run: Run
) -> NDArray[Any]:
    """Return the flow from each pixel along each of the grid's steps, within their weights: (D/2, H, W).

    f is of values in [0, 1], and λ in px⁻¹. The ranges of rows cover the image in order: `run` works on them
    at once, which does not change the result. Where a step leaves the image, the flow is 0.
    """
    weights = [weight / UNIT for weight in grid.weights]
    iteration = SaddlePoint(f, lam, grid.steps, weights, ratio=_STEP_RATIO, rows=rows, run=run)
    iteration.advance(min(round(_ITERATIONS + _ITERATIONS_PER_SCALE / lam), _MOST_ITERATIONS))
    flow = iteration.p
    np.negative(flow, out=flow)  # p climbs where flow runs down
    bounds = np.array(weights, np.float32)[:, None, None]
    return np.clip(flow, -bounds, bounds, out=flow)
