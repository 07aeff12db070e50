"""Exact minimum s-t cuts of a pixel graph.

The state is a `Graph`, which may come with a flow already in it: the nearer that is to the maximum, the less
there is to do. Three steps:

1. `settle_chains` sends the maximum flow along every row, column and diagonal, which fills most deficits
   where they arise.
2. `mark_reached` marks what excesses reach, up to the first deficits on the way and with them.
3. `fill_deficits` sends flow to these deficits, and goes on behind those that it fills.

When no excess reaches a deficit the flow is maximal, and what is reached is the smallest source side of all
minimum cuts, whatever the flow: the only one that does not depend on the order of the steps. So bands of rows
are worked on first, each for itself, in the cache and at the same time, and then joined.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from relit.solver.graph import Graph
from relit.solver.search_forest import Events, fill_deficits
from relit.solver.sweeps import mark_reached, reach_across, settle_chains

if TYPE_CHECKING:
    from relit.runtime.threads import Run


def cut(graph: Graph, bands: Sequence[tuple[int, int]], run: Run) -> Events:
    """Send a maximum flow; leave the smallest source side of the minimum cuts in ``graph.reached``.

    The bands cover the image, from top to bottom; `run` works on some at once.
    """
    whole = bands[0][0], bands[-1][1]

    def settle(band: tuple[int, int]) -> Sequence[int]:
        settle_chains(graph, *band)
        return fill_deficits(graph, *band) if mark_reached(graph, *band) else Events()

    events = Events().plus(run(settle, bands))
    while True:
        in_deficit = any(run(lambda band: mark_reached(graph, *band), bands))
        for _, border in bands[:-1]:
            in_deficit |= reach_across(graph, *whole, border)
        if not in_deficit:
            return events
        events = events.plus([fill_deficits(graph, *whole)])
