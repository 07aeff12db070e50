"""Exact minimum s-t cuts of a pixel graph.

The state is a `Graph`, which may come with a flow already in it: the nearer that is to the maximum, the less
there is to do. Three steps:

1. `settle_chains` sends the maximum flow along every row, column and diagonal, which pays most debts where
   they arise.
2. `mark_reached` marks what surpluses reach, up to the first debts on the way and with them.
3. `pay_debts` sends flow to these debts, and goes on behind those that it pays off.

When no surplus reaches a debt the flow is maximal, and what is reached is the smallest source side of all
minimum cuts, whatever the flow: the only one that does not depend on the order of the steps. So bands of rows
are worked on first, each for itself and at the same time, and then joined.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from relit.solver.graph import Graph
from relit.solver.search_forest import Events, pay_debts
from relit.solver.sweeps import mark_reached, reach_across, settle_chains

if TYPE_CHECKING:
    from relit.runtime.threads import Run


def cut(graph: Graph, bands: Sequence[tuple[int, int]], run: Run) -> Events:
    """Send a maximum flow; leave the smallest source side of the minimum cuts in ``graph.reached``.

    Parameters
    ----------
    graph : Graph
        `residual` and `excess` are updated in place.
    bands : sequence of (int, int)
        Bands that cover the image, from top to bottom.
    run : Run
        Works on the bands.

    Returns
    -------
    Events
        How many there were.
    """
    whole = bands[0][0], bands[-1][1]

    def settle(band: tuple[int, int]) -> Sequence[int]:
        settle_chains(graph, *band)
        return pay_debts(graph, *band, np.empty(2, np.int32)) if mark_reached(graph, *band) else Events()

    events = Events().plus(run(settle, bands))
    while True:
        in_debt = any(run(lambda band: mark_reached(graph, *band), bands))
        for _, border in bands[:-1]:
            in_debt |= reach_across(graph, *whole, border)
        if not in_debt:
            return events
        events = events.plus([pay_debts(graph, *whole, np.empty(2, np.int32))])
