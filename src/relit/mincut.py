"""Exact minimum s-t cuts on a pixel grid, after Boykov and Kolmogorov [1]_, compiled by numba.

The graph is implicit. Nodes are the pixels of an image, row by row, inside a margin of pixels that carry no
capacity, so that ``p + offset[k]`` is always a valid index and no loop asks where the image ends. Direction
``k`` and its reverse are ``k`` and ``k ^ 1``.

=============  ============  ==========================================================================
``residual``   (N, D) int32  what can still flow from pixel p to ``p + offset[k]``
``excess``     (N,) int32    > 0: what the source can still send into p; < 0: what p can still send to the
                             sink; the two terminal arcs of a pixel never carry capacity at once
``tree``       (N,) uint8    ``FREE``, or a member of the ``SOURCE`` or the ``SINK`` search tree
``parent``     (N,) int8     direction of the parent in the tree, or ``ROOT``, ``ORPHAN`` or ``NONE``
=============  ============  ==========================================================================

Two search trees grow from the pixels with an excess, along arcs that are not saturated. Where they touch,
the path from source to sink is augmented; the arcs that this saturates cut branches off, whose roots, the
orphans, look for a new parent among their neighbours or become free. Invariants between two steps:

- a tree's arcs are unsaturated, from source to leaf in the source tree, from leaf to sink in the sink tree;
- every pixel next to a free pixel that its tree could grow into is on the queue of active pixels;
- ``residual[p, k] + residual[q, k ^ 1]`` and the sum of flows out of every pixel plus its ``excess`` stay as
  they were given.

When no active pixel is left the flow is maximal, and the source tree is exactly the set of pixels that the
source still reaches: the smallest source side of all minimum cuts.

References
----------
.. [1] Y. Boykov, V. Kolmogorov, "An experimental comparison of min-cut/max-flow algorithms for energy
       minimization in vision", IEEE PAMI 26(9), 2004.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

Bytes = NDArray[np.uint8] | NDArray[np.int8]
Ints = NDArray[np.int32]
Steps = NDArray[np.int64]

FREE, SOURCE, SINK = 0, 1, 2

_NONE, _ROOT, _ORPHAN = -1, -2, -3
_IDLE, _LAST = -1, -2  # in the queue's links: not queued; queued with nobody behind
_FAR = 2**31 - 1


@njit(cache=True, nogil=True)
def cut(residual: Ints, excess: Ints, offset: Steps) -> NDArray[np.uint8]:
    """Send a maximum flow and return the minimum cut.

    Parameters
    ----------
    residual : (N, D) int32 array
        Residual capacities; updated in place. Arcs into the margin must be 0.
    excess : (N,) int32 array
        Terminal capacities; updated in place.
    offset : (D,) int64 array
        Index step of each direction; ``offset[k ^ 1] == -offset[k]``.

    Returns
    -------
    (N,) uint8 array
        ``SOURCE`` for the pixels that the source still reaches, anything else for the others.
    """
    size = excess.size
    tree = np.zeros(size, np.uint8)
    parent = np.full(size, _NONE, np.int8)
    # How far from its root a pixel was at the time of `stamp`: lets orphans prefer short, proven parents.
    depth = np.zeros(size, np.int32)
    stamp = np.zeros(size, np.int32)
    link = np.full(size, _IDLE, np.int32)
    queue = np.full(2, _LAST, np.int32)  # first and last active pixel
    for p in range(size):
        if excess[p] != 0:
            tree[p] = SOURCE if excess[p] > 0 else SINK
            parent[p] = _ROOT
            depth[p] = 1
            _activate(p, link, queue)

    orphans = np.empty(1024, np.int32)
    time = 0
    while queue[0] != _LAST:
        p = queue[0]
        if tree[p] == FREE:
            _retire(p, link, queue)
            continue
        k = _grow(p, residual, offset, tree, parent, depth, stamp, link, queue)
        if k < 0:
            _retire(p, link, queue)
            continue
        time += 1
        q = p + offset[k]
        if tree[p] == SINK:
            p, q, k = q, p, k ^ 1
        orphans, count = _augment(p, q, k, residual, excess, offset, parent, orphans)
        orphans = _adopt(orphans, count, time, residual, offset, tree, parent, depth, stamp, link, queue)
    return tree


@njit(cache=True, nogil=True)
def _activate(p: int, link: Ints, queue: Ints) -> None:
    if link[p] == _IDLE:
        link[p] = _LAST
        if queue[0] == _LAST:
            queue[0] = p
        else:
            link[queue[1]] = p
        queue[1] = p


@njit(cache=True, nogil=True)
def _retire(p: int, link: Ints, queue: Ints) -> None:
    queue[0] = link[p]
    link[p] = _IDLE


@njit(cache=True, nogil=True)
def _grow(
    p: int,
    residual: Ints,
    offset: Steps,
    tree: Bytes,
    parent: Bytes,
    depth: Ints,
    stamp: Ints,
    link: Ints,
    queue: Ints,
) -> int:
    """Let the tree of `p` take its free neighbours; return the direction of the other tree, or -1."""
    own = tree[p]
    for k in range(offset.size):
        q = p + offset[k]
        room = residual[p, k] if own == SOURCE else residual[q, k ^ 1]
        if room == 0:
            continue
        if tree[q] == FREE:
            tree[q] = own
            parent[q] = k ^ 1
            depth[q] = depth[p] + 1
            stamp[q] = stamp[p]
            _activate(q, link, queue)
        elif tree[q] != own:
            return k
        elif stamp[q] <= stamp[p] and depth[q] > depth[p] + 1 and parent[q] >= 0:
            # A shorter way to the root through p: short trees make short paths.
            parent[q] = k ^ 1
            depth[q] = depth[p] + 1
            stamp[q] = stamp[p]
    return -1


@njit(cache=True, nogil=True)
def _augment(
    p: int, q: int, k: int, residual: Ints, excess: Ints, offset: Steps, parent: Bytes, orphans: Ints
) -> tuple[Ints, int]:
    """Send what fits along source → p → q → sink; return the orphans this makes, and their number."""
    flow = residual[p, k]
    i = p
    while parent[i] != _ROOT:
        up = parent[i]
        i += offset[up]
        flow = min(flow, residual[i, up ^ 1])
    flow = min(flow, excess[i])
    i = q
    while parent[i] != _ROOT:
        up = parent[i]
        flow = min(flow, residual[i, up])
        i += offset[up]
    flow = min(flow, -excess[i])

    count = 0
    residual[p, k] -= flow
    residual[q, k ^ 1] += flow
    i = p
    while parent[i] != _ROOT:
        up = parent[i]
        above = i + offset[up]
        residual[i, up] += flow
        residual[above, up ^ 1] -= flow
        if residual[above, up ^ 1] == 0:
            orphans, count = _orphan(i, parent, orphans, count)
        i = above
    excess[i] -= flow
    if excess[i] == 0:
        orphans, count = _orphan(i, parent, orphans, count)
    i = q
    while parent[i] != _ROOT:
        up = parent[i]
        above = i + offset[up]
        residual[i, up] -= flow
        residual[above, up ^ 1] += flow
        if residual[i, up] == 0:
            orphans, count = _orphan(i, parent, orphans, count)
        i = above
    excess[i] += flow
    if excess[i] == 0:
        orphans, count = _orphan(i, parent, orphans, count)
    return orphans, count


@njit(cache=True, nogil=True)
def _orphan(i: int, parent: Bytes, orphans: Ints, count: int) -> tuple[Ints, int]:
    if count == orphans.size:
        orphans = np.concatenate((orphans, np.empty_like(orphans)))
    parent[i] = _ORPHAN
    orphans[count] = i
    return orphans, count + 1


@njit(cache=True, nogil=True)
def _adopt(
    orphans: Ints,
    count: int,
    time: int,
    residual: Ints,
    offset: Steps,
    tree: Bytes,
    parent: Bytes,
    depth: Ints,
    stamp: Ints,
    link: Ints,
    queue: Ints,
) -> Ints:
    """Find every orphan the parent nearest to a root, or set it free; return the stack, which may grow."""
    while count > 0:
        count -= 1
        p = orphans[count]
        own = tree[p]
        nearest, choice = _FAR, _NONE
        for k in range(offset.size):
            q = p + offset[k]
            room = residual[q, k ^ 1] if own == SOURCE else residual[p, k]
            if room > 0 and tree[q] == own and parent[q] != _NONE:
                distance = _distance_to_root(q, time, offset, parent, depth, stamp)
                if distance < nearest:
                    nearest, choice = distance, k
        parent[p] = choice
        if choice != _NONE:
            depth[p] = nearest + 1
            stamp[p] = time
            continue
        for k in range(offset.size):
            q = p + offset[k]
            if tree[q] != own:
                continue
            room = residual[q, k ^ 1] if own == SOURCE else residual[p, k]
            if room > 0:
                _activate(q, link, queue)
            if parent[q] == k ^ 1:
                orphans, count = _orphan(q, parent, orphans, count)
        tree[p] = FREE
    return orphans


@njit(cache=True, nogil=True)
def _distance_to_root(p: int, time: int, offset: Steps, parent: Bytes, depth: Ints, stamp: Ints) -> int:
    """Return the length of the way from `p` to its root; ``_FAR`` if it ends at an orphan."""
    steps, i = 0, p
    while stamp[i] != time:
        steps += 1
        if parent[i] == _ROOT:
            stamp[i] = time
            depth[i] = 1
            break
        if parent[i] == _ORPHAN or parent[i] == _NONE:
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
