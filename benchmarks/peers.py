"""Other solvers of TV-L1, called as well as their interfaces allow."""

from __future__ import annotations

from importlib.util import find_spec
from typing import Any

import numpy as np
from numpy.typing import NDArray

from relit.solver.neighborhoods import Grid, paired


def installed(module: str) -> bool:
    """Return whether a peer is there to compare with."""
    return find_spec(module) is not None


def energy(u: NDArray[Any], f: NDArray[Any], lam: float, neighborhood: int = 4) -> int:
    """Return the energy of u in `UNIT`, in whole numbers."""
    grid = Grid.of(neighborhood)
    u, f = u.astype(np.int64), f.astype(np.int64)
    total = grid.fidelity(lam) * int(np.abs(u - f).sum())
    for step, weight in zip(grid.steps, grid.weights, strict=True):
        here, there = paired(u.shape, step)
        total += weight * int(np.abs(u[here] - u[there]).sum())
    return total


def isotropic_energy(u: NDArray[Any], f: NDArray[Any], lam: float) -> float:
    """Return the energy that isotropic solvers minimise."""
    u = u.astype(float)
    across, down = np.diff(u, axis=1, append=u[:, -1:]), np.diff(u, axis=0, append=u[-1:])
    return float(np.hypot(across, down).sum() + lam * np.abs(u - f).sum())


class PyMaxflowDyadic:
    """The same dyadic cuts with PyMaxflow [1]_, Boykov and Kolmogorov's own code behind numpy.

    One graph of whole-number capacities with room for all arcs is used for every round; the arcs of a
    direction are added at once.

    References
    ----------
    .. [1] https://github.com/pmneila/PyMaxflow (GPL: a peer, never a dependency)
    """

    def __init__(self, f: NDArray[Any], lam: float, neighborhood: int = 4) -> None:
        import maxflow

        self.grid = Grid.of(neighborhood)
        self.fidelity = self.grid.fidelity(lam)
        self.f = f
        self.graph = maxflow.GraphInt(f.size, len(self.grid.steps) * f.size)

    def __call__(self) -> NDArray[Any]:
        """Return u."""
        values, ranks = np.unique(self.f, return_inverse=True)
        ranks = ranks.reshape(self.f.shape).astype(np.int32)
        low = np.zeros_like(ranks)
        half = 1 << (len(values) - 1).bit_length() >> 1
        while half:
            self.graph.reset()
            nodes = self.graph.add_grid_nodes(self.f.shape)
            unary = np.where(ranks >= low + half, self.fidelity, -self.fidelity)
            for (dy, dx), weight in zip(self.grid.steps, self.grid.weights, strict=True):
                here, there = paired(self.f.shape, (dy, dx))
                across = np.sign(low[here] - low[there]) * weight
                unary[here] -= across
                unary[there] += across
                weights = np.zeros(self.f.shape, np.int32)
                weights[here] = np.where(across == 0, weight, 0)
                reach = max(abs(dy), abs(dx))
                structure = np.zeros((2 * reach + 1, 2 * reach + 1), np.int32)
                structure[reach + dy, reach + dx] = 1
                self.graph.add_grid_edges(nodes, weights, structure=structure, symmetric=True)
            self.graph.add_grid_tedges(nodes, np.maximum(unary, 0), np.maximum(-unary, 0))
            self.graph.maxflow()
            low = np.where(self.graph.get_grid_segments(nodes), low, low + half).astype(np.int32)
            half //= 2
        return values[low]


def opencv(f: NDArray[np.uint8], lam: float, iterations: int) -> NDArray[np.uint8]:
    """Return what ``cv2.denoise_TVL1`` makes of an image: isotropic, in 8 bits."""
    import cv2

    u = np.empty_like(f)
    cv2.denoise_TVL1([f], u, lam, iterations)
    return u
