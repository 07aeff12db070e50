"""Filters of planes in double precision, by OpenCV: of what is measured, and of small differences.

Beyond their ends planes are mirrored.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import cv2
import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Doubles = NDArray[np.float64]

_REACH = 4.0  # standard deviations to which a Gaussian goes


def gaussian(planes: NDArray[Any], sigma: float) -> Doubles:
    """Return planes, (H, W) or (H, W, k), blurred by a Gaussian of `sigma` px.

    Examples
    --------
    >>> blurred = gaussian(np.eye(1, 9, 4), 1.0)
    >>> float(blurred.sum().round(12)), bool(np.isclose(blurred[0, 5] / blurred[0, 4], np.exp(-0.5)))
    (1.0, True)
    """
    given = np.ascontiguousarray(planes, np.float64)
    radius = int(_REACH * sigma + 0.5)
    if radius == 0:
        return given.copy()
    weights = np.exp(-0.5 * (np.arange(-radius, radius + 1) / sigma) ** 2)
    weights /= weights.sum()
    made = cv2.sepFilter2D(given, cv2.CV_64F, weights, weights, borderType=cv2.BORDER_REFLECT)
    return np.asarray(made, np.float64).reshape(given.shape)


def window_mean(planes: NDArray[Any], size: int, *, repeated: bool = False) -> Doubles:
    """Return the mean of the window of `size` px, an odd number, round each pixel.

    Parameters
    ----------
    planes : (H, W) or (H, W, k) array
    size : int
    repeated : bool
        Whether it is the last value that goes on beyond the ends.

    Examples
    --------
    >>> window_mean(np.array([[0.0, 3, 0, 3]]), 3).tolist()
    [[1.0, 1.0, 2.0, 2.0]]
    """
    given = np.ascontiguousarray(planes, np.float64)
    border = cv2.BORDER_REPLICATE if repeated else cv2.BORDER_REFLECT
    made = cv2.blur(given, (size, size), borderType=border)
    return np.asarray(made, np.float64).reshape(given.shape)
