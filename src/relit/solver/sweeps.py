"""What passes over the rows of a pixel graph do: send flow along straight chains, and mark what it reaches.

The kernels run at the speed of the memory. Where possible, an inner loop writes to one array alone, and its
indices are unsigned, so that they cannot wrap around: compilers then vectorise it.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from relit.runtime.jit import compiled
from relit.solver.graph import Flags, Graph, Ints

Index = np.uintp

_ONE = np.uintp(1)


@compiled
def settle_chains(graph: Graph, start: int, stop: int) -> None:
    """Send the maximum flow along every straight chain of a band's pixels, one direction after the other.

    Forward, `carry` becomes what could cross the arc from p: > 0 of the surplus behind it, < 0 for the debts
    behind it. Backward, every pixel gets what it lacks or gives what it has too much, as far as that allows.
    """
    residual, excess, carry = graph.residual, graph.excess, graph.carry
    width, stride = np.uintp(graph.width), graph.stride
    for p in range(start, stop, stride):
        _settle_row(residual, excess, carry, np.uintp(p), width)
    above = np.uintp(0)  # a row of the margin
    for k in range(2, graph.offset.size, 2):
        step, drop = graph.offset[k], graph.drop[k]
        for p in range(start, stop - drop, stride):
            behind = np.uintp(p - step) if p - drop >= start else above
            _carry_on(residual, excess, carry, np.uintp(k), behind, np.uintp(p), np.uintp(p + step), width)
        for p in range(stop - stride, start + drop - 1, -stride):
            _settle_back(residual, excess, carry, np.uintp(k), np.uintp(p - step), np.uintp(p), width)


@compiled
def _settle_row(residual: Ints, excess: Ints, carry: Ints, first: Index, width: Index) -> None:
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
def _carry_on(
    residual: Ints,
    excess: Ints,
    carry: Ints,
    k: Index,
    behind: Index,
    first: Index,
    there: Index,
    width: Index,
) -> None:
    for x in range(width):
        have = excess[first + x] + carry[behind + x]
        carry[first + x] = min(max(have, -residual[k + _ONE, there + x]), residual[k, first + x])


@compiled
def _settle_back(
    residual: Ints, excess: Ints, carry: Ints, k: Index, first: Index, there: Index, width: Index
) -> None:
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
    """Mark what surpluses reach inside a band, up to and with debts; return whether they reach any.

    A sweep down and one up over the rows find most of it; what leaks from that is flooded pixel by pixel.
    """
    residual, excess, reached, offset = graph.residual, graph.excess, graph.reached, graph.offset
    width, stride = np.uintp(graph.width), graph.stride
    gate = graph.parent  # no forest stands now
    for p in range(start, stop):
        reached[p] = np.uint8(excess[p] > 0)
    for p in range(start, stop, stride):
        for k in range(2, offset.size, 2):
            if start <= p - graph.drop[k]:
                _spread(residual, excess, reached, np.uintp(k), np.uintp(p - offset[k]), np.uintp(p), width)
        _spread_along(residual, excess, reached, np.uintp(p), width, gate)
    for p in range(stop - stride, start - 1, -stride):
        new = False
        for k in range(3, offset.size, 2):
            if p - graph.drop[k] < stop:
                new |= _spread(
                    residual, excess, reached, np.uintp(k), np.uintp(p - offset[k]), np.uintp(p), width
                )
        if new:
            _spread_along(residual, excess, reached, np.uintp(p), width, gate)
    in_debt = False
    for p in range(start, stop, stride):
        for k in range(2, offset.size, 2):  # the last sweep closed the other directions
            if p + graph.drop[k] >= stop:
                continue
            if _leaks(
                residual, excess, reached, np.uintp(k), np.uintp(p), np.uintp(p + offset[k]), width, gate
            ):
                for i in range(p, p + graph.width):
                    if gate[i]:
                        _flood(graph, start, stop, i)
    for p in range(start, stop, stride):
        in_debt |= _any_in_debt(excess, reached, np.uintp(p), width)
    return in_debt


@compiled
def reach_across(graph: Graph, start: int, stop: int, border: int) -> bool:
    """Let what is reached beside a border of bands reach across it; return whether it meets a debt."""
    reached, offset = graph.reached, graph.offset
    rows = graph.drop.max()
    in_debt = False
    for p in range(max(border - rows, start), min(border + rows, stop)):
        open_ = reached[p] and graph.excess[p] >= 0
        for k in range(offset.size):
            q = p + offset[k]
            if open_ and graph.residual[k, p] > 0 and not reached[q] and start <= q < stop:
                reached[q] = 1
                in_debt |= _flood(graph, start, stop, q)
    return in_debt


@compiled
def _spread(
    residual: Ints, excess: Ints, reached: Flags, k: Index, source: Index, target: Index, width: Index
) -> bool:
    """Mark what in a row is reached from another; return whether any is new."""
    new = np.uint8(0)
    for x in range(width):
        p, q = source + x, target + x
        passes = reached[p] & np.uint8(excess[p] >= 0) & np.uint8(residual[k, p] > 0)
        new |= passes & ~reached[q]
        reached[q] |= passes
    return bool(new)


@compiled
def _spread_along(
    residual: Ints, excess: Ints, reached: Flags, first: Index, width: Index, gate: NDArray[np.int8]
) -> None:
    """Mark what in a row is reached from the row itself."""
    for x in range(width):
        gate[first + x] = np.uint8(excess[first + x] >= 0) & np.uint8(residual[0, first + x] > 0)
    carry = np.uint8(0)
    for x in range(width):
        carry |= reached[first + x]
        reached[first + x] = carry
        carry &= np.uint8(gate[first + x])
    for x in range(width):
        gate[first + x] = np.uint8(excess[first + x] >= 0) & np.uint8(residual[1, first + x] > 0)
    carry = np.uint8(0)
    left = width
    while left > 0:
        left -= _ONE
        carry |= reached[first + left]
        reached[first + left] = carry
        carry &= np.uint8(gate[first + left])


@compiled
def _leaks(
    residual: Ints,
    excess: Ints,
    reached: Flags,
    k: Index,
    source: Index,
    target: Index,
    width: Index,
    leaks: NDArray[np.int8],
) -> bool:
    """Tell which pixels of a row reach one in another that is not marked; return whether any does."""
    found = np.uint8(0)
    for x in range(width):
        p = source + x
        passes = reached[p] & np.uint8(excess[p] >= 0) & np.uint8(residual[k, p] > 0)
        leak = passes & ~reached[target + x]
        leaks[p] = leak
        found |= leak
    return bool(found)


@compiled
def _any_in_debt(excess: Ints, reached: Flags, first: Index, width: Index) -> bool:
    """Return whether a debt is among what is reached of a row."""
    found = np.uint8(0)
    for x in range(width):
        found |= reached[first + x] & np.uint8(excess[first + x] < 0)
    return bool(found)


@compiled
def _flood(graph: Graph, start: int, stop: int, p: int) -> bool:
    """Mark what p reaches in a band, up to debts and what is marked; return whether it came upon a debt."""
    excess, reached, residual, offset = graph.excess, graph.reached, graph.residual, graph.offset
    stack = graph.link[start:stop]  # every pixel is pushed once at most, and no forest stands now
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
