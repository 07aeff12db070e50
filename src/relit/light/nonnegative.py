"""Non-negative least squares from a guess, by its normal equations: block principal pivoting [1]_ [2]_.

Whatever is on the wrong side changes sides, all at once: the rows of ``Aw - r ≥ 0, w ≥ 0`` of which one at
least has to be 0. While fewer are wrong each time, that needs a handful of solutions. SciPy's `nnls`, which
lights one lamp after the other, takes five times as long on the 22 fits of two faces.

References
----------
.. [1] J. J. Júdice and F. M. Pires, "A block principal pivoting algorithm for large-scale strictly monotone
       linear complementarity problems", Computers & Operations Research 21(5), 1994.
.. [2] J. Kim and H. Park, "Fast nonnegative matrix factorization: an active-set-like method and
       comparisons", SIAM J. Scientific Computing 33(6), 2011.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import cv2
import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

_SMALL = 1e-12  # of the largest of `right`: a gradient that counts as none
_TRIES = 3  # changes of all that is wrong, after which there may be no fewer: as in [2]_
_MOST = 10  # solutions for each unknown


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
    least = _SMALL * float(np.abs(right).max())
    fewest, tries = len(right) + 1, _TRIES
    for _ in range(_MOST * len(right)):  # of exact numbers it ends by itself; rounding may go round
        result = _solved(square, right, free)
        wrong = np.where(free, result < 0, right - square @ result > least)
        count = int(np.count_nonzero(wrong))
        if not count:
            break
        if count < fewest:
            fewest, tries = count, _TRIES
        elif tries:
            tries -= 1
        else:  # one at a time there is no going round
            wrong[: np.flatnonzero(wrong)[-1]] = False
        free ^= wrong
    return np.maximum(result, 0)


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
