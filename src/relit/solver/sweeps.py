"""Passes over the rows of a pixel graph: send flow along straight chains, and mark what excesses reach.

The kernels run at the speed of the memory. Where possible, an inner loop writes to one array alone, and its
indices are unsigned, so that they cannot wrap around: compilers then vectorise it.
"""

from __future__ import annotations

import numpy as np

from relit.runtime.jit import compiled
from relit.solver.graph import Graph

Index = np.uintp

_ONE = np.uintp(1)


@compiled
def settle_chains(graph: Graph, start: int, stop: int) -> None:
    """Send the maximum flow along every straight chain of a band's pixels, one direction after the other.

    Forward, `carry` becomes what could cross the arc from p: > 0 of the excess behind it, < 0 for the deficit
    behind it. Backward, every pixel gets what it lacks or gives what it has too much, as far as that allows.
    """
    offset, drop, stride = graph.offset, graph.drop, graph.stride
    for p in range(start, stop, stride):
        _settle_row(graph, np.uintp(p))
    above = np.uintp(0)  # a row of the margin
    for k in range(2, offset.size, 2):
        for p in range(start, stop - drop[k], stride):
            behind = np.uintp(p - offset[k]) if p - drop[k] >= start else above
            _carry_on(graph, np.uintp(k), behind, np.uintp(p), np.uintp(p + offset[k]))
        for p in range(stop - stride, start + drop[k] - 1, -stride):
            _settle_back(graph, np.uintp(k), np.uintp(p - offset[k]), np.uintp(p))


@compiled
def _settle_row(graph: Graph, first: Index) -> None:
    residual, excess, carry, width = graph.residual, graph.excess, graph.carry, np.uintp(graph.width)
    crossing = np.int32(0)
    for x in range(width - _ONE):
        p = first + x
        crossing = min(max(excess[p] + crossing, -residual[1, p + _ONE]), residual[0, p])
        carry[p] = crossing
    p = first + width - _ONE
    have = excess[p]
    while p > first:
        q = p - _ONE
        flow = _share(have, carry[q])
        carry[q] = flow
        excess[p] = have + flow
        have = excess[q] - flow
        p = q
    excess[first] = have
    for x in range(width - _ONE):
        residual[0, first + x] -= carry[first + x]
    for x in range(width - _ONE):
        residual[1, first + x + _ONE] += carry[first + x]


@compiled
def _carry_on(graph: Graph, k: Index, behind: Index, first: Index, there: Index) -> None:
    residual, excess, carry = graph.residual, graph.excess, graph.carry
    for x in range(np.uintp(graph.width)):
        have = excess[first + x] + carry[behind + x]
        carry[first + x] = min(max(have, -residual[k + _ONE, there + x]), residual[k, first + x])


@compiled
def _settle_back(graph: Graph, k: Index, first: Index, there: Index) -> None:
    residual, excess, carry, width = graph.residual, graph.excess, graph.carry, np.uintp(graph.width)
    for x in range(width):
        carry[first + x] = _share(excess[there + x], carry[first + x])
    for x in range(width):
        excess[there + x] += carry[first + x]
    for x in range(width):
        excess[first + x] -= carry[first + x]
    for x in range(width):
        residual[k, first + x] -= carry[first + x]
    for x in range(width):
        residual[k + _ONE, there + x] += carry[first + x]


@compiled
def _share(have: int, crossing: int) -> int:
    """Return how much of what could cross evens out what a pixel has."""
    return min(max(-have, min(crossing, 0)), max(crossing, 0))


@compiled
def mark_reached(graph: Graph, start: int, stop: int) -> bool:
    """Mark what excesses reach inside a band, up to and with deficits; return whether they reach any.

    A sweep down and one up over the rows find most of it; what leaks from that is flooded pixel by pixel.
    """
    excess, reached = graph.excess[start:stop], graph.reached[start:stop]
    offset, drop, stride, new = graph.offset, graph.drop, graph.stride, graph.parent
    for x in range(reached.size):
        reached[x] = np.uint8(excess[x] > 0)
    for p in range(start, stop, stride):
        for k in range(2, offset.size, 2):
            if p - drop[k] >= start:
                _spread(graph, np.uintp(k), np.uintp(p - offset[k]), np.uintp(p))
        _spread_along(graph, np.uintp(p))
    for p in range(stop - stride, start - 1, -stride):
        found = False
        for k in range(3, offset.size, 2):
            if p - drop[k] < stop:
                found |= _spread(graph, np.uintp(k), np.uintp(p - offset[k]), np.uintp(p))
        if found:
            _spread_along(graph, np.uintp(p))
    for p in range(start, stop, stride):
        for k in range(2, offset.size, 2):  # the last sweep closed the other directions
            below = p + offset[k]
            if p + drop[k] < stop and _spread(graph, np.uintp(k), np.uintp(p), np.uintp(below)):
                for q in range(below, below + graph.width):
                    if new[q]:
                        _flood(graph, start, stop, q)
    in_deficit = np.uint8(0)
    for x in range(reached.size):
        in_deficit |= reached[x] & np.uint8(excess[x] < 0)
    return bool(in_deficit)


@compiled
def reach_across(graph: Graph, start: int, stop: int, border: int) -> bool:
    """Let what is reached beside a border of bands reach across it; return whether it meets a deficit."""
    reached, offset = graph.reached, graph.offset
    rows = graph.drop.max()
    in_deficit = False
    for p in range(max(border - rows, start), min(border + rows, stop)):
        open_ = reached[p] and graph.excess[p] >= 0
        for k in range(offset.size):
            q = p + offset[k]
            if open_ and graph.residual[k, p] > 0 and not reached[q] and start <= q < stop:
                reached[q] = 1
                in_deficit |= _flood(graph, start, stop, q)
    return in_deficit


@compiled
def _spread(graph: Graph, k: Index, source: Index, target: Index) -> bool:
    """Mark what in a row another one reaches, and in `parent` what of it is new; return whether any is."""
    residual, excess, reached, new = graph.residual, graph.excess, graph.reached, graph.parent
    width = np.uintp(graph.width)
    found = np.uint8(0)
    for x in range(width):
        p, q = source + x, target + x
        passes = reached[p] & np.uint8(excess[p] >= 0) & np.uint8(residual[k, p] > 0)
        new[q] = passes & ~reached[q]
        found |= passes & ~reached[q]
    for x in range(width):
        reached[target + x] |= np.uint8(new[target + x])
    return bool(found)


@compiled
def _spread_along(graph: Graph, first: Index) -> None:
    """Mark what in a row is reached from the row itself."""
    residual, excess, reached, gate = graph.residual, graph.excess, graph.reached, graph.parent
    width = np.uintp(graph.width)
    for k in range(2):
        for x in range(width):
            gate[first + x] = np.uint8(excess[first + x] >= 0) & np.uint8(residual[k, first + x] > 0)
        carry = np.uint8(0)
        for x in range(width):
            p = first + x if k == 0 else first + (width - _ONE - x)
            carry |= reached[p]
            reached[p] = carry
            carry &= np.uint8(gate[p])


@compiled
def _flood(graph: Graph, start: int, stop: int, p: int) -> bool:
    """Mark what p reaches in a band, up to deficits and what is marked; return whether it meets a deficit."""
    excess, reached, residual, offset = graph.excess, graph.reached, graph.residual, graph.offset
    stack = graph.link[start:stop]  # every pixel is pushed once at most, and no forest stands now
    stack[0] = p
    count = 1
    in_deficit = False
    while count > 0:
        count -= 1
        i = stack[count]
        if excess[i] < 0:
            in_deficit = True
            continue
        for k in range(offset.size):
            q = i + offset[k]
            if residual[k, i] > 0 and not reached[q] and start <= q < stop:
                reached[q] = 1
                stack[count] = q
                count += 1
    return in_deficit
