"""Filling the deficits of a pixel graph: the search forest of Boykov and Kolmogorov [1]_, from one side.

Trees hang from the deficits that an excess reaches and grow, against the arcs, until they meet an excess; the
path is augmented; the arcs that this saturates cut branches off, whose roots, the orphans, look for a new
parent among their neighbours or leave the forest. Past a deficit that is filled, reach goes on.

Growing from deficits that are reached, and not from all excesses or all deficits, leaves the large regions
alone in which nothing is left to do. The forest's arrays are `parent`, the direction of a pixel's parent or
``ROOT``, ``ORPHAN`` or ``NONE``; `depth`, how far from its root a pixel was at the time of `stamp`, by which
orphans prefer short, proven ways; and `link`, the queue of active pixels, of which ``queue`` holds the first
and the last. Invariants between two steps:

- ``residual[k, p] + residual[k ^ 1, q]``, and every pixel's `excess` plus the sum of its flows out, stay as
  they were given, and none changes from excess to deficit or back;
- a pixel that is reached and has no deficit has no open arc to what is not reached, so that a path from an
  excess to the first deficit lies in what is reached;
- a tree's arcs are open, from leaf to root, and its root has a deficit;
- a pixel of the forest with an open arc to it from one that is reached, but not in the forest, is on the
  queue.

References
----------
.. [1] Y. Boykov, V. Kolmogorov, "An experimental comparison of min-cut/max-flow algorithms for energy
       minimization in vision", IEEE PAMI 26(9), 2004.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np

from relit.runtime.jit import compiled, inlined
from relit.solver.graph import Graph, Ints

_NONE, _ROOT, _ORPHAN = -1, -2, -3
_IDLE, _LAST = -1, -2  # in the queue's links: not queued; queued with nobody behind
_FAR = 2**31 - 1


class Events(NamedTuple):
    """What a search forest was made of: the work of an exact solver, whatever the clock says.

    Attributes
    ----------
    growths, augmentations, adoptions : int
        Pixels that a tree took, paths that flow was sent along, and orphans that looked for a parent.
    """

    growths: int = 0
    augmentations: int = 0
    adoptions: int = 0

    def plus(self, others: Iterable[Sequence[int]]) -> Events:
        """Return the sum of these and other counts."""
        return Events(*(sum(counts) for counts in zip(self, *others, strict=True)))


@compiled
def fill_deficits(graph: Graph, start: int, stop: int) -> tuple[int, int, int]:
    """Fill the deficits inside a band until an excess reaches none any more; count the events."""
    excess, reached = graph.excess, graph.reached
    parent, depth, stamp, link = graph.parent, graph.depth, graph.stamp, graph.link
    for p in range(start, stop):
        parent[p] = _NONE
        stamp[p] = 0
        link[p] = _IDLE
    queue = np.array([_LAST, _LAST], np.int32)
    for p in range(start, stop):
        if reached[p] and excess[p] < 0:
            parent[p] = _ROOT
            depth[p] = 1
            _activate(p, link, queue)

    margin = graph.stride - graph.width
    scratch = graph.carry[start : stop - margin]  # of more cells than the band has pixels
    time = growths = adoptions = 0
    while queue[0] != _LAST:
        p = queue[0]
        k = _NONE
        if parent[p] != _NONE:
            k, grown = _grow(graph, start, stop, p, queue)
            growths += grown
        if k == _NONE:
            queue[0] = link[p]
            link[p] = _IDLE
        else:
            time += 1
            root, count = _augment(graph, p, k, scratch)
            adoptions += _adopt(graph, start, stop, time, scratch, count, queue)
            if excess[root] == 0:
                _pass_through(graph, start, stop, root, scratch, queue)
    for first in range(start, stop, graph.stride):
        for p in range(first + graph.width, first + graph.stride):
            graph.carry[p] = 0
    return growths, time, adoptions


@inlined
def _activate(p: int, link: Ints, queue: Ints) -> None:
    if link[p] == _IDLE:
        link[p] = _LAST
        if queue[0] == _LAST:
            queue[0] = p
        else:
            link[queue[1]] = p
        queue[1] = p


@inlined
def _grow(graph: Graph, start: int, stop: int, p: int, queue: Ints) -> tuple[int, int]:
    """Let the tree take neighbours of `p` up to one with an excess; return its direction, and how many."""
    grown = 0
    parent, depth, stamp = graph.parent, graph.depth, graph.stamp
    for k in range(graph.offset.size):
        q = p + graph.offset[k]
        if graph.residual[k ^ 1, q] == 0 or not graph.reached[q] or not start <= q < stop:
            continue
        if parent[q] == _NONE:
            if graph.excess[q] > 0:
                return k, grown
            grown += 1
            parent[q] = k ^ 1
            depth[q] = depth[p] + 1
            stamp[q] = stamp[p]
            _activate(q, graph.link, queue)
        elif stamp[q] <= stamp[p] and depth[q] > depth[p] + 1 and parent[q] >= 0:
            # A shorter way to a root through p: short trees make short paths.
            parent[q] = k ^ 1
            depth[q] = depth[p] + 1
            stamp[q] = stamp[p]
    return _NONE, grown


@inlined
def _augment(graph: Graph, p: int, k: int, orphans: Ints) -> tuple[int, int]:
    """Send what fits from the neighbour of `p` to the root; return the root and the number of orphans."""
    residual, excess, parent, offset = graph.residual, graph.excess, graph.parent, graph.offset
    giver = p + offset[k]
    flow = min(residual[k ^ 1, giver], excess[giver])
    i = p
    while parent[i] != _ROOT:
        flow = min(flow, residual[parent[i], i])
        i += offset[parent[i]]
    flow = min(flow, -excess[i])

    excess[giver] -= flow
    residual[k ^ 1, giver] -= flow
    residual[k, p] += flow
    count = 0
    i = p
    while parent[i] != _ROOT:
        up = parent[i]
        below = i
        i += offset[up]
        residual[up, below] -= flow
        residual[up ^ 1, i] += flow
        if residual[up, below] == 0:
            parent[below] = _ORPHAN
            orphans[count] = below
            count += 1
    excess[i] += flow
    if excess[i] == 0:
        parent[i] = _ORPHAN
        orphans[count] = i
        count += 1
    return i, count


@compiled
def _pass_through(graph: Graph, start: int, stop: int, p: int, stack: Ints, queue: Ints) -> None:
    """Let reach go on beyond a deficit that is filled; the deficits where it ends next become roots."""
    residual, reached, parent, offset = graph.residual, graph.reached, graph.parent, graph.offset
    stack[0] = p
    count = 1
    while count > 0:
        count -= 1
        i = stack[count]
        for k in range(offset.size):
            q = i + offset[k]
            if residual[k, i] == 0 or not start <= q < stop:
                continue
            if not reached[q]:
                reached[q] = 1
                if graph.excess[q] < 0:
                    parent[q] = _ROOT
                    graph.depth[q] = 1
                    _activate(q, graph.link, queue)
                else:
                    stack[count] = q
                    count += 1
            elif parent[q] != _NONE:
                _activate(q, graph.link, queue)  # which may now grow into pixel i


@inlined
def _adopt(graph: Graph, start: int, stop: int, time: int, orphans: Ints, waiting: int, queue: Ints) -> int:
    """Find every orphan the parent nearest to a root, or drop it; return how many there were.

    The orphans are a ring, long enough as no pixel is in it twice.
    """
    residual, parent, offset = graph.residual, graph.parent, graph.offset
    head, adoptions = 0, 0
    tail = waiting
    while waiting > 0:
        p = orphans[head]
        head = head + 1 if head + 1 < orphans.size else 0
        waiting -= 1
        adoptions += 1
        nearest, choice = _FAR, _NONE
        for k in range(offset.size):
            q = p + offset[k]
            if residual[k, p] > 0 and start <= q < stop and parent[q] != _NONE:
                distance = _distance_to_root(graph, q, time)
                if distance < nearest:
                    nearest, choice = distance, k
        parent[p] = choice
        if choice != _NONE:
            graph.depth[p] = nearest + 1
            graph.stamp[p] = time
            continue
        for k in range(offset.size):
            q = p + offset[k]
            if start <= q < stop and parent[q] != _NONE:
                if residual[k, p] > 0:
                    _activate(q, graph.link, queue)
                if parent[q] == k ^ 1:
                    parent[q] = _ORPHAN
                    orphans[tail] = q
                    tail = tail + 1 if tail + 1 < orphans.size else 0
                    waiting += 1
    return adoptions


@inlined
def _distance_to_root(graph: Graph, p: int, time: int) -> int:
    """Return the length of the way from `p` to its root; ``_FAR`` if it ends at an orphan."""
    parent, depth, stamp, offset = graph.parent, graph.depth, graph.stamp, graph.offset
    steps, i = 0, p
    while stamp[i] != time:
        steps += 1
        if parent[i] == _ROOT:
            stamp[i] = time
            depth[i] = 1
            break
        if parent[i] == _ORPHAN:
            return _FAR
        i += offset[parent[i]]
    else:
        steps += depth[i]
    # The way is proven now: mark it, so that no orphan of this round walks it again.
    distance, i = steps, p
    while stamp[i] != time:
        stamp[i] = time
        depth[i] = steps
        steps -= 1
        i += offset[parent[i]]
    return distance
