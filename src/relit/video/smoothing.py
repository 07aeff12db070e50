"""Smoothing over time without lag: each value is read off a curve through those before and after it.

At a time, a line or a parabola is fitted by weighted least squares, and its value there is taken. What is
constant stays so, and what moves evenly is neither late nor early, at a shot's ends too, and where frames
come unevenly (a local regression [1]_).

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
#: Of the moments of the times that count, in standard deviations: where it is less, they are too few or too
#: near one another for a curve of that degree.
_LEAST_DET = 1e-9


def curve_weights(times: Floats, at: float, sigma: float, trust: Floats, degree: int = 1) -> Floats:
    """Return the weights by which values at some times give the value of a curve through them at one time.

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
    degree : int
        Of the polynomial: 1 is a line, which is late where what moves speeds up, by half the acceleration
        times sigma²; 2 is not. It is less where too few values count.

    Returns
    -------
    (n,) float64 array
        Their sum is 1.

    Examples
    --------
    >>> times = np.arange(5.0)
    >>> weights = curve_weights(times, 4.0, 1.0, np.ones(5))
    >>> float((weights * (3 * times + 1)).sum().round(9))
    13.0
    """
    away = (np.asarray(times, np.float64) - at) / sigma
    weights = trust * np.exp(-0.5 * away**2)
    if not weights.sum() > 0:
        weights = np.zeros(len(away))
        weights[np.argmin(np.where(trust > 0, np.abs(away), np.inf))] = 1
    powers = away[:, None] ** np.arange(degree + 1)
    moments = np.einsum("ni,n,nj->ij", powers, weights, powers) / weights.sum()
    while np.linalg.det(moments) <= _LEAST_DET:
        moments = moments[:-1, :-1]
    first = np.linalg.solve(moments, np.eye(len(moments))[0])
    return np.asarray(weights * (powers[:, : len(first)] @ first) / weights.sum())


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
