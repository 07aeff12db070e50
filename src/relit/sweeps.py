"""What passes over the rows of a pixel graph do: send flow along straight chains, and mark what it reaches.

These kernels read and write whole rows, so that they run at the speed of the memory. Where possible, an inner
loop writes to one array alone, which is what compilers vectorise.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from relit.graph import Flags, Graph, Ints


@njit(cache=True, nogil=True)
def settle_chains(graph: Graph, start: int, stop: int) -> None:
    """Send the maximum flow along every straight chain of a band's pixels, one direction after the other.

    Forward, `carry` becomes what could cross the arc from p: > 0 of the surplus behind it, < 0 for the debts
    behind it. Backward, every pixel gets what it lacks or gives what it has too much, as far as that allows.
    """
    residual, excess, carry = graph.residual, graph.excess, graph.carry
    width, stride = graph.width, graph.stride
    for p in range(start, stop, stride):
        end = p + width
        carry[end : p + stride] = 0  # nothing comes out of the margin
        _settle_row(excess[p:end], residual[0, p:end], residual[1, p:end], carry[p:end])
    nothing = np.zeros(width, np.int32)
    for k in range(2, graph.offset.size, 2):
        step, drop = graph.offset[k], graph.drop[k]
        for p in range(start, stop - drop, stride):
            end, behind, ahead = p + width, p - step, p + step
            _carry_on(
                carry[p:end],
                carry[behind : behind + width] if p - drop >= start else nothing,
                excess[p:end],
                residual[k, p:end],
                residual[k + 1, ahead : ahead + width],
            )
        for p in range(stop - stride, start + drop - 1, -stride):
            end, behind = p + width, p - step
            _settle_back(
                carry[behind : behind + width],
                excess[p:end],
                excess[behind : behind + width],
                residual[k, behind : behind + width],
                residual[k + 1, p:end],
            )


@njit(cache=True, nogil=True)
def _settle_row(excess: Ints, forward: Ints, backward: Ints, flow: Ints) -> None:
    last = excess.size - 1
    crossing = np.int32(0)
    for x in range(last):
        crossing = min(max(excess[x] + crossing, -backward[x + 1]), forward[x])
        flow[x] = crossing
    have = excess[last]
    for x in range(last, 0, -1):
        sent = _share(have, flow[x - 1])
        flow[x - 1] = sent
        excess[x] = have + sent
        have = excess[x - 1] - sent
    excess[0] = have
    _subtract(forward[:last], flow)
    _add(backward[1:], flow)


@njit(cache=True, nogil=True)
def _carry_on(carry: Ints, behind: Ints, excess: Ints, forward: Ints, backward: Ints) -> None:
    for x in range(carry.size):
        carry[x] = min(max(excess[x] + behind[x], -backward[x]), forward[x])


@njit(cache=True, nogil=True)
def _settle_back(flow: Ints, excess: Ints, behind: Ints, forward: Ints, backward: Ints) -> None:
    for x in range(excess.size):
        flow[x] = _share(excess[x], flow[x])
    _add(excess, flow)
    _subtract(behind, flow)
    _subtract(forward, flow)
    _add(backward, flow)


@njit(cache=True, nogil=True)
def _add(to: Ints, flow: Ints) -> None:
    for x in range(to.size):
        to[x] += flow[x]


@njit(cache=True, nogil=True)
def _subtract(from_: Ints, flow: Ints) -> None:
    for x in range(from_.size):
        from_[x] -= flow[x]


@njit(cache=True, nogil=True)
def _share(have: int, crossing: int) -> int:
    """Return how much of what could cross evens out what a pixel has."""
    return min(max(-have, min(crossing, 0)), max(crossing, 0))


@njit(cache=True, nogil=True)
def mark_reached(graph: Graph, start: int, stop: int) -> bool:
    """Mark what surpluses reach inside a band, up to and with debts; return whether they reach any.

    A sweep down and one up over the rows find most of it; what leaks from that is flooded pixel by pixel.
    """
    residual, excess, reached, offset = graph.residual, graph.excess, graph.reached, graph.offset
    width, stride = graph.width, graph.stride
    _mark_surplus(reached[start:stop], excess[start:stop])
    gate = np.empty(width, np.uint8)
    for p in range(start, stop, stride):
        _sweep_row(graph, start, stop, p, 0, gate)
    for p in range(stop - stride, start - 1, -stride):
        _sweep_row(graph, start, stop, p, 1, gate)
    in_debt = False
    for p in range(start, stop, stride):
        end = p + width
        gate[:] = 0
        leaks = False
        for k in range(offset.size):
            if start <= p + graph.drop[k] < stop:
                q = p + offset[k]
                leaks |= _leaks(
                    reached[p:end], excess[p:end], reached[q : q + width], residual[k, p:end], gate
                )
        if leaks:
            for x in range(width):
                if gate[x]:
                    flood(graph, start, stop, p + x)
    for p in range(start, stop, stride):
        in_debt |= any_in_debt(reached[p : p + width], excess[p : p + width])
    return in_debt


@njit(cache=True, nogil=True)
def _mark_surplus(reached: Flags, excess: Ints) -> None:
    for x in range(reached.size):
        reached[x] = np.uint8(excess[x] > 0)


@njit(cache=True, nogil=True)
def _sweep_row(graph: Graph, start: int, stop: int, p: int, back: int, gate: Flags) -> None:
    """Mark what in a row is reached from the rows above (below, if `back`), then from the row itself."""
    reached, excess, residual, width = graph.reached, graph.excess, graph.residual, graph.width
    row = reached[p : p + width]
    for k in range(2 + back, graph.offset.size, 2):
        q = p - graph.offset[k]
        if start <= p - graph.drop[k] < stop:
            end = q + width
            _spread(row, reached[q:end], excess[q:end], residual[k, q:end])
    end = p + width
    _spread_along(row, excess[p:end], residual[0, p:end], residual[1, p:end], gate)


@njit(cache=True, nogil=True)
def _spread(row: Flags, source: Flags, excess: Ints, open_: Ints) -> None:
    for x in range(row.size):
        row[x] |= source[x] & np.uint8(excess[x] >= 0) & np.uint8(open_[x] > 0)


@njit(cache=True, nogil=True)
def _spread_along(row: Flags, excess: Ints, forward: Ints, backward: Ints, gate: Flags) -> None:
    for x in range(row.size):
        gate[x] = np.uint8(excess[x] >= 0) & np.uint8(forward[x] > 0)
    carry = np.uint8(0)
    for x in range(row.size):
        row[x] |= carry
        carry = row[x] & gate[x]
    for x in range(row.size):
        gate[x] = np.uint8(excess[x] >= 0) & np.uint8(backward[x] > 0)
    carry = np.uint8(0)
    for x in range(row.size - 1, -1, -1):
        row[x] |= carry
        carry = row[x] & gate[x]


@njit(cache=True, nogil=True)
def _leaks(row: Flags, excess: Ints, target: Flags, open_: Ints, leaks: Flags) -> bool:
    found = np.uint8(0)
    for x in range(row.size):
        leak = row[x] & np.uint8(excess[x] >= 0) & (target[x] ^ np.uint8(1)) & np.uint8(open_[x] > 0)
        leaks[x] |= leak
        found |= leak
    return bool(found)


@njit(cache=True, nogil=True)
def any_in_debt(reached: Flags, excess: Ints) -> bool:
    """Return whether a debt is among what is reached."""
    found = np.uint8(0)
    for x in range(reached.size):
        found |= reached[x] & np.uint8(excess[x] < 0)
    return bool(found)


@njit(cache=True, nogil=True)
def flood(graph: Graph, start: int, stop: int, p: int) -> bool:
    """Mark what p reaches in a band, up to debts and what is marked; return whether it came upon a debt."""
    excess, reached, residual, offset = graph.excess, graph.reached, graph.residual, graph.offset
    stack = graph.carry[start:stop]  # every pixel is pushed once at most
    stack[0] = p
    count = 1
    in_debt = False
    while count > 0:
        count -= 1
        i = stack[count]
        if excess[i] < 0:
            in_debt = True
            continue
        for k in range(offset.size):
            q = i + offset[k]
            if residual[k, i] > 0 and not reached[q] and start <= q < stop:
                reached[q] = 1
                stack[count] = q
                count += 1
    return in_debt
