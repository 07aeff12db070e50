"""The pixels of an image as the nodes of a flow network, in flat arrays.

The graph is implicit: pixels lie row by row inside a margin of nodes without capacity, so that
``p + offset[k]`` is always a valid index and no loop asks where the image ends. Direction ``k`` and its
reverse are ``k`` and ``k ^ 1``; even k step forward, and k = 0 steps along the row.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from relit.solver.neighborhoods import UNIT, paired

if TYPE_CHECKING:
    from relit.solver.neighborhoods import Grid

Ints = NDArray[np.int32]

#: Rows above and below the image: no step goes farther than two, and a shifted row begins in the one before.
_MARGIN = 3


class Graph(NamedTuple):
    """A pixel graph and the state of its flow: D directions; N pixels and nodes of the margin.

    A band is a range of whole rows of it, ``start ≤ p < stop``. Where a function is given one, arcs that
    leave it count as closed, so that the bands of a graph can be worked on at the same time.

    Attributes
    ----------
    residual : (D, N) int32 array
        What can still flow from pixel p to ``p + offset[k]``, in `UNIT`. The arc is open where it is above 0.
    excess : (N,) int32 array
        > 0: what the source can still send into p; < 0: a deficit, what p can still send to the sink; 0 in
        the margin.
    reached : (N,) uint8 array
        1 where an excess reaches p over open arcs; 0 in the margin.
    carry : (N,) int32 array
        Scratch space. 0 in the margin between any two steps, and at all times behind the last row of a band:
        steps of the next band begin there.
    link, depth, stamp, parent : (N,) int32 or int8 array
        Scratch space, and the search forest.
    offset : (D,) int64 array
        Index step of every direction.
    drop : (D,) int64 array
        The part of it that is whole rows.
    stride, width : int
        Index step from row to row, and pixels in a row.
    """

    residual: Ints
    excess: Ints
    reached: NDArray[np.uint8]
    carry: Ints
    link: Ints
    depth: Ints
    stamp: Ints
    parent: NDArray[np.int8]
    offset: NDArray[np.int64]
    drop: NDArray[np.int64]
    stride: int
    width: int

    @classmethod
    def of_flow(cls, flow: NDArray[np.float32], grid: Grid) -> Graph:
        """Return the graph of an image with a flow in it; the excess is what the flow brings to a pixel.

        The flow, (D/2, H, W), is along every step of the grid, within its weight, and 0 out of the image.
        """
        _, height, width = flow.shape
        # The right margin of a row serves the next row as its left one.
        stride = width + max(abs(dx) for _, dx in grid.steps)
        size = (height + 2 * _MARGIN) * stride
        signed = [(sign * dy, sign * dx) for dy, dx in grid.steps for sign in (1, -1)]
        residual, excess = np.zeros((len(signed), size), np.int32), np.zeros(size, np.int32)
        inner, brought = _pixels(residual, stride, width), _pixels(excess, stride, width)
        for k, (step, weight) in enumerate(zip(grid.steps, grid.weights, strict=True)):
            here, there = paired((height, width), step)
            sent = np.rint(flow[k][here] * np.float32(UNIT)).astype(np.int32)
            np.subtract(weight, sent, out=inner[2 * k][here])
            np.add(weight, sent, out=inner[2 * k + 1][there])
            brought[here] -= sent
            brought[there] += sent
        del flow, sent  # large, as what follows
        return cls(
            residual=residual,
            excess=excess,
            reached=np.zeros(size, np.uint8),
            carry=np.zeros(size, np.int32),
            link=np.empty(size, np.int32),
            depth=np.empty(size, np.int32),
            stamp=np.empty(size, np.int32),
            parent=np.empty(size, np.int8),
            offset=np.array([dy * stride + dx for dy, dx in signed], np.int64),
            drop=np.array([dy * stride for dy, _ in signed], np.int64),
            stride=stride,
            width=width,
        )

    def pixels(self, nodes: NDArray[Any]) -> NDArray[Any]:
        """Return the (..., H, W) view of the pixels in an array of (..., N) nodes."""
        return _pixels(nodes, self.stride, self.width)

    def band(self, rows: tuple[int, int]) -> tuple[int, int]:
        """Return the band of some rows of the image."""
        first, last = rows
        return (first + _MARGIN) * self.stride, (last + _MARGIN) * self.stride

    def flow(self, ranks: Ints, grid: Grid) -> Ints:
        """Return the flow along every step of the grid; between unequal ranks, arcs were saturated."""
        flow = np.zeros((len(grid.steps), *ranks.shape), np.int32)
        residual = self.pixels(self.residual)
        for k, (step, weight) in enumerate(zip(grid.steps, grid.weights, strict=True)):
            here, there = paired(ranks.shape, step)
            sent = (residual[2 * k + 1][there] - residual[2 * k][here]) // 2
            downhill = np.sign(ranks[here] - ranks[there])
            flow[k][here] = np.where(downhill == 0, sent, weight * downhill)
        return flow


def _pixels(nodes: NDArray[Any], stride: int, width: int) -> NDArray[Any]:
    rows = nodes.reshape(*nodes.shape[:-1], -1, stride)
    return rows[..., _MARGIN:-_MARGIN, :width]
