"""A held membrane on a grid, by conjugate gradients that a multigrid cycle leads [1]_.

The factor of such a matrix fills up: to solve by it takes several times as long, and needs SciPy.

References
----------
.. [1] O. Tatebe, "The multigrid preconditioned conjugate gradient method", Sixth Copper Mountain Conference
       on Multigrid Methods, 1993.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import cv2
import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Levels = list[tuple[NDArray[np.float32], NDArray[np.float32]]]

_STIFFNESS = np.array([[0.0, -1, 0], [-1, 4, -1], [0, -1, 0]])
_HALVING = np.array([1.0, 3, 3, 1]) / 4  # the transpose of linear interpolation
_DAMPING = 0.8  # of Jacobi's steps: in two dimensions, what is rough goes fastest
_LAST_STEPS = 8  # on the coarsest grid, of a few cells
_STEPS = 100  # of the conjugate gradients, at most; of grids up to 400 x 300, 20 were the most that it took
_MISSED = 1e-9  # of the right side, at the end: planes are right to about 1e-7, as float32 is


def held_membrane(hold: NDArray[np.float64], right: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the x with ``hold x + Σ (x - x_j) = right``, j being the neighbours of a cell on the grid.

    Parameters
    ----------
    hold : (h, w) array
        Above 0.
    right : (h, w) array

    Returns
    -------
    (h, w) float64 array

    Examples
    --------
    >>> right = np.zeros((1, 3))
    >>> right[0, 0] = 1
    >>> (8 * held_membrane(np.ones((1, 3)), right)).round(6).tolist()
    [[5.0, 2.0, 1.0]]
    """
    levels = _levels(hold)
    x, missing = np.zeros_like(right), right.copy()
    least = _MISSED**2 * _dot(right, right)
    along, before = np.zeros_like(right), 1.0
    for _ in range(_STEPS):
        if not _dot(missing, missing) > least:
            break
        step = _cycle(_padded(missing, levels[0][0].shape), levels)[: len(right), : right.shape[1]]
        gain = _dot(missing, step)
        along *= gain / before
        along += step
        before = gain
        pull = _pull(along, hold)
        share = gain / _dot(along, pull)
        x += share * along
        missing -= share * pull
    return x


def _levels(hold: NDArray[np.float64]) -> Levels:
    """Return how much cells are held, and Jacobi's step there, on grids that are coarser by two each."""
    count = max(max(hold.shape).bit_length() - 3, 0)
    sides = [-(-side // 2**count) * 2**count for side in hold.shape]
    held = np.pad(
        hold.astype(np.float32),
        [(0, side - old) for side, old in zip(sides, hold.shape, strict=True)],
        "edge",
    )
    levels = [(held, _DAMPING / (4 + held))]
    for _ in range(count):
        held = held[::2, ::2] + held[1::2, ::2] + held[::2, 1::2] + held[1::2, 1::2]
        levels.append((held, _DAMPING / (4 + held)))
    return levels


def _cycle(right: NDArray[np.float32], levels: Levels) -> NDArray[np.float32]:
    """Return nearly what solves for a right side: a V-cycle, which is symmetric."""
    (hold, step), *coarser = levels
    x = step * right
    if coarser:
        missing = right - _pull(x, hold)
        halved = cv2.sepFilter2D(
            missing, -1, _HALVING, _HALVING, anchor=(1, 1), borderType=cv2.BORDER_REFLECT
        )
        below = _cycle(np.ascontiguousarray(halved[::2, ::2]), coarser)
        x += cv2.resize(below, x.shape[::-1], interpolation=cv2.INTER_LINEAR)
    for _ in range(1 if coarser else _LAST_STEPS):
        x += step * (right - _pull(x, hold))
    return x


def _pull(x: NDArray[Any], hold: NDArray[Any]) -> NDArray[Any]:
    """Return what neighbours and hold pull with at each cell; there are no neighbours beyond the ends."""
    made = cv2.filter2D(x, -1, _STIFFNESS, borderType=cv2.BORDER_REPLICATE)
    made += hold * x
    return np.asarray(made)


def _padded(plane: NDArray[np.float64], shape: tuple[int, ...]) -> NDArray[np.float32]:
    padded = np.zeros(shape, np.float32)
    padded[: plane.shape[0], : plane.shape[1]] = plane
    return padded


def _dot(one: NDArray[Any], other: NDArray[Any]) -> float:
    # Not by BLAS, whose threads sum in another order each.
    return float(np.einsum("ij,ij->", one, other))
