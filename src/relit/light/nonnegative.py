"""Non-negative least squares from a guess, by its normal equations [1]_.

SciPy's `nnls` begins with no lamp lit. Of fits one after the other, most lamps that one lights the next one
does as well: from there it takes half of SciPy's time on two faces, and from nothing four times as long.

References
----------
.. [1] R. Bro and S. de Jong, "A fast non-negativity-constrained least squares algorithm", J. Chemometrics
       11(5), 1997.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import cv2
import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

_TINY = np.finfo(float).tiny
_SMALL = 1e-12  # of the largest of `right`: a gradient that counts as none


def nonnegative(
    square: NDArray[np.float64], right: NDArray[np.float64], start: NDArray[np.float64] | None = None
) -> NDArray[np.float64]:
    """Return the w ≥ 0 that makes ``w'Aw - 2 r'w`` least.

    Parameters
    ----------
    square : (n, n) array
        A, symmetric and positive definite.
    right : (n,) array
        r.
    start : (n,) array, optional
        What is above 0 in it, the result is guessed to have above 0.

    Returns
    -------
    (n,) array

    Examples
    --------
    >>> nonnegative(np.array([[2.0, 1], [1, 2]]), np.array([2.0, -1])).round(9).tolist()
    [1.0, 0.0]
    """
    free = np.zeros(len(right), bool) if start is None else start > 0
    # A guess may have too much: without what would be negative, it is a point to begin at.
    while (free & ((result := _solved(square, right, free)) <= 0)).any():
        free &= result > 0
    least = _SMALL * float(np.abs(right).max())
    for _ in range(3 * len(right)):  # each time is one better, so that it ends; rounding may go round
        gradient = np.where(free, -np.inf, right - square @ result)
        wanted = int(gradient.argmax())
        if not gradient[wanted] > least:
            break
        free[wanted] = True
        while (below := free & ((new := _solved(square, right, free)) <= 0)).any():
            share = result[below] / np.maximum(result[below] - new[below], _TINY)
            result += share.min() * (new - result)
            first = np.flatnonzero(below)[share.argmin()]
            free &= result > 0
            free[first] = False
        result = new
    return result


def _solved(
    square: NDArray[np.float64], right: NDArray[np.float64], free: NDArray[np.bool_]
) -> NDArray[np.float64]:
    """Return the least over those that are free, the others being 0."""
    rows = np.flatnonzero(free)
    result = np.zeros(len(right))
    if len(rows):
        _, solved = cv2.solve(square[rows[:, None], rows], right[rows, None], flags=cv2.DECOMP_CHOLESKY)
        result[rows] = solved[:, 0]
    return result
