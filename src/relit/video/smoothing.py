"""Smoothing over time without lag: each value is read off a line through those before and after it.

At a time, a line is fitted by weighted least squares, and its value there is taken. What is constant stays
so, and what moves evenly is neither late nor early, at a shot's ends too, and where frames come unevenly
(a local linear regression [1]_).

References
----------
.. [1] W. S. Cleveland, "Robust locally weighted regression and smoothing scatterplots", JASA 74(368), 1979.
"""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Floats = NDArray[np.float64]

#: How many standard deviations the weights reach.
REACH = 3.0


def line_weights(times: Floats, at: float, sigma: float, trust: Floats) -> Floats:
    """Return the weights by which values at some times give the value of a line through them at one time.

    Parameters
    ----------
    times : (n,) array
        In s.
    at : float
        In s.
    sigma : float
        Standard deviation of the Gaussian that weighs them, in s.
    trust : (n,) array
        How much each value counts, besides; one at least has to count.

    Returns
    -------
    (n,) float64 array
        Their sum is 1.

    Examples
    --------
    >>> times = np.arange(5.0)
    >>> weights = line_weights(times, 4.0, 1.0, np.ones(5))
    >>> float((weights * (3 * times + 1)).sum().round(9))
    13.0
    """
    away = np.asarray(times, np.float64) - at
    weights = trust * np.exp(-0.5 * (away / sigma) ** 2)
    if not weights.sum() > 0:
        weights = np.zeros(len(away))
        weights[np.argmin(np.where(trust > 0, np.abs(away), np.inf))] = 1
    total = weights.sum()
    first, second = weights @ away / total, weights @ away**2 / total
    if second - first**2 <= 1e-9 * sigma**2:
        return np.asarray(weights / total)
    return np.asarray(weights * (second - first * away) / (total * (second - first**2)))


def filled(valid: NDArray[np.bool_], times: Floats, longest: float) -> NDArray[np.bool_]:
    """Return what is valid, with gaps that are no longer than so many s bridged, but not at the ends.

    Examples
    --------
    >>> filled(np.array([1, 0, 1, 0, 0, 0, 1, 0], bool), np.arange(8.0), 2.5).astype(int).tolist()
    [1, 1, 1, 0, 0, 0, 1, 0]
    """
    made, known = valid.copy(), np.flatnonzero(valid)
    for before, after in pairwise(known.tolist()):
        if times[after] - times[before] <= longest:
            made[before:after] = True
    return made


def faded(share: Floats, times: Floats, seconds: float) -> Floats:
    """Return how much of a change is made: no more than there is at any time nearby.

    It rises and falls by 1 in so many s at most, and is never above `share`.

    Examples
    --------
    >>> faded(np.array([1.0, 1, 1, 0, 1]), np.arange(5.0), 2.0).tolist()
    [1.0, 1.0, 0.5, 0.0, 0.5]
    """
    made = np.array(share, np.float64)
    for k in range(1, len(made)):
        made[k] = min(made[k], made[k - 1] + (times[k] - times[k - 1]) / seconds)
    for k in range(len(made) - 2, -1, -1):
        made[k] = min(made[k], made[k + 1] + (times[k + 1] - times[k]) / seconds)
    return made
