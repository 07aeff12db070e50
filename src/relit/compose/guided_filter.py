"""Enlarge what was worked out on a reduced photo, guided by the edges of the photo itself.

What a *guided filter* [1]_ finds within a small window is that a plane c is about linear in a guide g,
``c = a g + b``. The coefficients are smooth, and can be enlarged with the guide at its full size [2]_. What
the line leaves over is enlarged with b, so that on the reduced photo nothing is lost.

References
----------
.. [1] K. He, J. Sun, X. Tang, "Guided image filtering", IEEE PAMI 35(6), 2013.
.. [2] K. He, J. Sun, "Fast guided filter", arXiv:1505.00996, 2015.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import cv2
import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray


class Lines(NamedTuple):
    """Local lines ``c = slope · g + offset``; the arrays have the shape of c."""

    slope: NDArray[np.float32]
    offset: NDArray[np.float32]


def fit_lines(
    values: NDArray[np.floating[Any]], guide: NDArray[np.floating[Any]], radius: int, least: float
) -> Lines:
    """Fit local lines to values over a guide.

    Parameters
    ----------
    values, guide : (H, W) or (H, W, k) array
    radius : int
        Of the window, in px: it is ``2 · radius + 1`` wide.
    least : float
        Standard deviation of the guide below which it says nothing: the lines are flat there.

    Returns
    -------
    Lines
        Means over the windows that hold a pixel.

    Examples
    --------
    >>> import numpy as np
    >>> guide = np.random.default_rng(0).random((9, 9))
    >>> lines = fit_lines(3 * guide + 1, guide, 1, 1e-6)
    >>> lines.slope[4, 4].round(3), lines.offset[4, 4].round(3)
    (np.float32(3.0), np.float32(1.0))
    """

    def mean(plane: NDArray[np.float64]) -> NDArray[np.float64]:
        window = (2 * radius + 1, 2 * radius + 1)
        made = cv2.blur(plane, window, borderType=cv2.BORDER_REPLICATE)
        return np.asarray(made, np.float64).reshape(plane.shape)

    c, g = values.astype(np.float64), guide.astype(np.float64)
    mean_c, mean_g = mean(c), mean(g)
    slope = (mean(g * c) - mean_g * mean_c) / (mean(g * g) - mean_g**2 + least**2)
    offset = mean_c - slope * mean_g
    return Lines(mean(slope).astype(np.float32), mean(offset).astype(np.float32))


def guided_filter(
    values: NDArray[np.floating[Any]], guide: NDArray[np.floating[Any]], radius: int, least: float
) -> NDArray[np.float32]:
    """Return values, smoothed where the guide is smooth and with edges where it has them.

    Parameters
    ----------
    values, guide, radius, least
        As for `fit_lines`.

    Returns
    -------
    (H, W) or (H, W, k) float32 array

    Examples
    --------
    >>> import numpy as np
    >>> step = np.repeat([0.0, 1.0], 8) * np.ones((9, 1))
    >>> bool(np.allclose(guided_filter(step, step, 2, 1e-3), step, atol=1e-3))
    True
    """
    lines = fit_lines(values, guide, radius, least)
    return lines.slope * guide.astype(np.float32) + lines.offset
