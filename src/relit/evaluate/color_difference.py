"""How different two colours look: CIE Lab under D65, and the difference CIEDE2000.

References
----------
.. [1] IEC 61966-2-1:1999 (sRGB).
.. [2] CIE 15:2004, "Colorimetry" (Lab).
.. [3] G. Sharma, W. Wu, E. N. Dalal, "The CIEDE2000 color-difference formula: implementation notes,
       supplementary test data, and mathematical observations", Color Research and Application 30(1), 2005.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from relit.photo.profile import decode_srgb

_RGB_TO_XYZ = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]])
_WHITE = _RGB_TO_XYZ.sum(axis=1)
_EDGE = 6 / 29  # of the cube root, below which Lab goes on in a straight line


def linear_light(rgb: NDArray[Any]) -> NDArray[np.float64]:
    """Return sRGB in [0, 1], (..., 3), as shares of light [1]_.

    Examples
    --------
    >>> linear_light(np.array([0.0, 0.5, 1.0])).round(3).tolist()
    [0.0, 0.214, 1.0]
    """
    return np.asarray(decode_srgb(np.asarray(rgb, np.float64)))


def lab(light: NDArray[Any]) -> NDArray[np.float64]:
    """Return L*, a* and b* of linear sRGB, (..., 3) [2]_; white is (100, 0, 0).

    Examples
    --------
    >>> lab(linear_light(np.array([1.0, 0.0, 0.0]))).round(1).tolist()
    [53.2, 80.1, 67.2]
    """
    ratio = light @ (_RGB_TO_XYZ / _WHITE[:, None]).T
    root = np.where(ratio > _EDGE**3, np.cbrt(ratio), ratio / (3 * _EDGE**2) + 4 / 29)
    x, y, z = np.moveaxis(root, -1, 0)
    return np.stack([116 * y - 16, 500 * (x - y), 200 * (y - z)], axis=-1)


def ciede2000(first: NDArray[Any], second: NDArray[Any]) -> NDArray[np.float64]:
    """Return the difference CIEDE2000 of colours in Lab, (..., 3), with all parametric factors 1 [3]_.

    About 1 is just seen side by side.

    Examples
    --------
    >>> float(ciede2000(np.array([50, 2.6772, -79.7751]), np.array([50, 0, -82.7485])).round(4))
    2.0425
    """
    (l1, a1, b1), (l2, a2, b2) = (np.moveaxis(np.asarray(one, np.float64), -1, 0) for one in (first, second))
    # Greys get more chroma in a*, so that their hue counts less.
    stretch = 1 + 0.5 * (1 - _saturating((np.hypot(a1, b1) + np.hypot(a2, b2)) / 2))
    c1, c2 = np.hypot(stretch * a1, b1), np.hypot(stretch * a2, b2)
    h1, h2 = (np.degrees(np.arctan2(b, stretch * a)) % 360 for a, b in ((a1, b1), (a2, b2)))

    grey = c1 * c2 == 0
    turn = np.where(grey, 0, (h2 - h1 + 180) % 360 - 180)
    # Of hues half a circle apart, the one way round is as good as the other; the paper goes by their order.
    turn = np.where(~grey & (h2 - h1 == 180), 180.0, turn)
    lightness, chroma = l2 - l1, c2 - c1
    hue = 2 * np.sqrt(c1 * c2) * np.sin(np.radians(turn / 2))

    mean_l, mean_c = (l1 + l2) / 2, (c1 + c2) / 2
    far = np.abs(h1 - h2) > 180
    mean_h = np.where(grey, h1 + h2, (h1 + h2) / 2 + np.where(far, np.where(h1 + h2 < 360, 180, -180), 0))

    uneven = (
        1
        - 0.17 * _cosine(mean_h - 30)
        + 0.24 * _cosine(2 * mean_h)
        + 0.32 * _cosine(3 * mean_h + 6)
        - 0.20 * _cosine(4 * mean_h - 63)
    )
    away = (mean_l - 50) ** 2
    of_lightness = lightness / (1 + 0.015 * away / np.sqrt(20 + away))
    of_chroma = chroma / (1 + 0.045 * mean_c)
    of_hue = hue / (1 + 0.015 * mean_c * uneven)
    blue = 30 * np.exp(-(((mean_h - 275) / 25) ** 2))  # where hue and chroma depend on one another
    rotation = -2 * _saturating(mean_c) * np.sin(np.radians(2 * blue))
    square = of_lightness**2 + of_chroma**2 + of_hue**2 + rotation * of_chroma * of_hue
    return np.asarray(np.sqrt(np.maximum(square, 0)))


def _saturating(chroma: NDArray[np.float64]) -> NDArray[np.float64]:
    power = chroma**7
    return np.asarray(np.sqrt(power / (power + 25.0**7)))


def _cosine(degrees: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.asarray(np.cos(np.radians(degrees)))
