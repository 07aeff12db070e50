"""Exact minimum s-t cuts on a pixel grid, compiled by numba.

The graph is implicit. Nodes are the pixels of an image, row by row, inside a margin of pixels that carry no
capacity, so that ``p + offset[k]`` is always a valid index and no loop asks where the image ends. Direction
``k`` and its reverse are ``k`` and ``k ^ 1``.

=============  ============  ==========================================================================
``residual``   (N, D) int32  what can still flow from pixel p to ``p + offset[k]``
``excess``     (N,) int32    > 0: surplus, what the source can still send into p; < 0: debt, what p can
                             still send to the sink
``reached``    (N,) bool     whether p hangs on a search tree, so that the source reaches it
``parent``     (N,) int8     direction of the parent in the tree, or ``ROOT``, ``ORPHAN`` or ``NONE``
=============  ============  ==========================================================================

Two steps. `settle_chains` sends the maximum flow along every row, column and diagonal, which pays most debts
where they arise. `cut` finishes with the search forest of Boykov and Kolmogorov [1]_, grown from the
surpluses alone, since only what they reach is asked for: trees grow along unsaturated arcs until they meet a
debt; the path is augmented; the arcs that this saturates cut branches off, whose roots, the orphans, look for
a new parent among their neighbours or leave the tree. Invariants between two steps:

- a tree's arcs are unsaturated, from root to leaf, and its root has a surplus;
- a reached pixel with an unsaturated arc to a pixel that is not reached is on the queue of active pixels;
- ``residual[p, k] + residual[q, k ^ 1]``, and every pixel's ``excess`` plus the sum of its flows out, stay as
  they were given, and no excess ever changes its sign.

When no active pixel is left the flow is maximal, and what is reached is the smallest source side of all
minimum cuts.

References
----------
.. [1] Y. Boykov, V. Kolmogorov, "An experimental comparison of min-cut/max-flow algorithms for energy
       minimization in vision", IEEE PAMI 26(9), 2004.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

Ints = NDArray[np.int32]
Steps = NDArray[np.int64]
Flags = NDArray[np.bool_]
Directions = NDArray[np.int8]

_NONE, _ROOT, _ORPHAN = -1, -2, -3
_IDLE, _LAST = -1, -2  # in the queue's links: not queued; queued with nobody behind
_FAR = 2**31 - 1


@njit(cache=True, nogil=True)
def settle_chains(residual: Ints, excess: Ints, offset: Steps, carry: Ints) -> None:
    """Send the maximum flow along every straight chain of pixels, one direction after the other.

    Forward, `carry` becomes what could cross the arc from p: > 0 of the surplus behind it, < 0 for the debts
    behind it. Backward, every pixel gets what it lacks or gives what it has too much, as far as that allows.

    Parameters
    ----------
    residual, excess, offset
        As for `cut`; the first two are updated in place.
    carry : (N,) int32 array
        Scratch space.
    """
    size = excess.size
    for k in range(0, offset.size, 2):
        step = offset[k]
        carry[:step] = 0
        for p in range(step, size - step):
            have = excess[p] + carry[p - step]
            carry[p] = min(max(have, -residual[p + step, k + 1]), residual[p, k])
        for p in range(size - step - 1, step - 1, -1):
            crossing = carry[p - step]
            flow = min(max(-excess[p], min(crossing, 0)), max(crossing, 0))
            if flow != 0:
                q = p - step
                excess[p] += flow
                excess[q] -= flow
                residual[q, k] -= flow
                residual[p, k + 1] += flow


@njit(cache=True, nogil=True)
def cut(residual: Ints, excess: Ints, offset: Steps) -> Flags:
    """Send a maximum flow and return the minimum cut.

    Parameters
    ----------
    residual : (N, D) int32 array
        Residual capacities; updated in place. Arcs into the margin must be 0.
    excess : (N,) int32 array
        Surpluses and debts; updated in place.
    offset : (D,) int64 array
        Index step of each direction; ``offset[k ^ 1] == -offset[k]``, and even k step forward.

    Returns
    -------
    (N,) bool array
        The pixels that the source still reaches.
    """
    size = excess.size
    reached = excess > 0
    parent = np.full(size, _NONE, np.int8)
    # How far from its root a pixel was at the time of `stamp`: lets orphans prefer short, proven parents.
    depth = np.zeros(size, np.int32)
    stamp = np.zeros(size, np.int32)
    link = np.full(size, _IDLE, np.int32)
    queue = np.full(2, _LAST, np.int32)  # first and last active pixel
    for p in range(size):
        if reached[p]:
            parent[p] = _ROOT
            depth[p] = 1
            for k in range(offset.size):
                if residual[p, k] > 0 and not reached[p + offset[k]]:
                    _activate(p, link, queue)
                    break

    orphans = np.empty(1024, np.int32)
    time = 0
    while queue[0] != _LAST:
        p = queue[0]
        k = (
            _grow(p, residual, excess, offset, reached, parent, depth, stamp, link, queue)
            if reached[p]
            else _NONE
        )
        if k == _NONE:
            queue[0] = link[p]
            link[p] = _IDLE
        else:
            time += 1
            orphans, count = _augment(p, k, residual, excess, offset, parent, orphans)
            orphans = _adopt(
                orphans, count, time, residual, offset, reached, parent, depth, stamp, link, queue
            )
    return reached


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
def _grow(
    p: int,
    residual: Ints,
    excess: Ints,
    offset: Steps,
    reached: Flags,
    parent: Directions,
    depth: Ints,
    stamp: Ints,
    link: Ints,
    queue: Ints,
) -> int:
    """Let the tree take the neighbours of `p`; return the direction of one in debt, or ``NONE``."""
    for k in range(offset.size):
        if residual[p, k] == 0:
            continue
        q = p + offset[k]
        if not reached[q]:
            if excess[q] < 0:
                return k
            reached[q] = True
            parent[q] = k ^ 1
            depth[q] = depth[p] + 1
            stamp[q] = stamp[p]
            _activate(q, link, queue)
        elif stamp[q] <= stamp[p] and depth[q] > depth[p] + 1 and parent[q] >= 0:
            # A shorter way to a root through p: short trees make short paths.
            parent[q] = k ^ 1
            depth[q] = depth[p] + 1
            stamp[q] = stamp[p]
    return _NONE


@njit(cache=True, nogil=True)
def _augment(
    p: int, k: int, residual: Ints, excess: Ints, offset: Steps, parent: Directions, orphans: Ints
) -> tuple[Ints, int]:
    """Send what fits from the root of `p` to its neighbour; return the orphans and their number."""
    debtor = p + offset[k]
    flow = min(residual[p, k], -excess[debtor])
    i = p
    while parent[i] != _ROOT:
        up = parent[i]
        i += offset[up]
        flow = min(flow, residual[i, up ^ 1])
    flow = min(flow, excess[i])

    excess[debtor] += flow
    residual[p, k] -= flow
    residual[debtor, k ^ 1] += flow
    count = 0
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
    return orphans, count


@njit(cache=True, nogil=True)
def _orphan(i: int, parent: Directions, orphans: Ints, count: int) -> tuple[Ints, int]:
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
    reached: Flags,
    parent: Directions,
    depth: Ints,
    stamp: Ints,
    link: Ints,
    queue: Ints,
) -> Ints:
    """Find every orphan the parent nearest to a root, or drop it; return their list, which may grow."""
    head = 0
    while head < count:
        p = orphans[head]
        head += 1
        nearest, choice = _FAR, _NONE
        for k in range(offset.size):
            q = p + offset[k]
            if residual[q, k ^ 1] > 0 and reached[q]:
                distance = _distance_to_root(q, time, offset, parent, depth, stamp)
                if distance < nearest:
                    nearest, choice = distance, k
        parent[p] = choice
        if choice != _NONE:
            depth[p] = nearest + 1
            stamp[p] = time
            continue
        reached[p] = False
        for k in range(offset.size):
            q = p + offset[k]
            if reached[q]:
                if residual[q, k ^ 1] > 0:
                    _activate(q, link, queue)
                if parent[q] == k ^ 1:
                    orphans, count = _orphan(q, parent, orphans, count)
    return orphans


@njit(cache=True, nogil=True)
def _distance_to_root(p: int, time: int, offset: Steps, parent: Directions, depth: Ints, stamp: Ints) -> int:
    """Return the length of the way from `p` to its root; ``_FAR`` if it ends at an orphan."""
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
