"""Colour spaces, as one table: channel names, the paper's primary channel, and the way there and back.

All work on encoded (gamma-corrected) RGB in [0, 1], as the paper does, and keep every channel in [0, 1].

References
----------
.. [1] A. R. Smith, "Color gamut transform pairs", SIGGRAPH 1978 (HSV).
.. [2] ITU-R Recommendation BT.601 (YCbCr; full range, as in JFIF).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import reduce
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from relit.errors import OptionError

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

ColorSpaceName = Literal["rgb", "hsv", "ycbcr"]

LUMA_WEIGHTS = np.array([0.299, 0.587, 0.114])  # BT.601
# Cb and Cr are blue and red less luma, scaled to [-½, ½] and shifted to [0, 1].
_RGB_TO_YCBCR = np.array(
    [
        LUMA_WEIGHTS,
        (np.array([0, 0, 1]) - LUMA_WEIGHTS) / (2 * (1 - LUMA_WEIGHTS[2])),
        (np.array([1, 0, 0]) - LUMA_WEIGHTS) / (2 * (1 - LUMA_WEIGHTS[0])),
    ]
)
_CHROMA_SHIFT = np.array([0, 0.5, 0.5])


@dataclass(frozen=True)
class ColorSpace:
    """A colour space."""

    channels: tuple[str, str, str]
    #: The channel that the paper relights alone in its Fig. 12; RGB has none.
    primary: str | None
    #: The channel that carries the light when the reference has no colour; in RGB, all scale by their luma.
    lightness: str | None
    #: (..., 3) float arrays to and from encoded RGB.
    from_rgb: Callable[[NDArray[Any]], NDArray[Any]]
    to_rgb: Callable[[NDArray[Any]], NDArray[Any]]


def luma(rgb: NDArray[Any]) -> NDArray[Any]:
    """Return BT.601 luma of encoded RGB, (..., 3).

    Examples
    --------
    >>> round(float(luma(np.array([1.0, 1.0, 1.0]))), 6)
    1.0
    """
    return np.asarray(rgb @ LUMA_WEIGHTS.astype(rgb.dtype))


def brightest(planes: NDArray[Any]) -> NDArray[Any]:
    """Return the greatest of the planes at each pixel, (..., k) to (...).

    Examples
    --------
    >>> brightest(np.array([[1, 3, 2], [4, 0, 0]])).tolist()
    [3, 4]
    """
    # Along so short an axis, NumPy's own max takes seven times as long.
    return np.asarray(reduce(np.maximum, np.moveaxis(planes, -1, 0)))


def rgb_to_hsv(rgb: NDArray[Any]) -> NDArray[Any]:
    """Return hue (turns, red at 0), saturation and value [1]_."""
    value = rgb.max(axis=-1)
    chroma = value - rgb.min(axis=-1)
    safe = np.where(chroma > 0, chroma, 1)
    red, green, blue = np.moveaxis(rgb, -1, 0)
    sixth = np.select(
        [chroma == 0, value == red, value == green],
        [0, ((green - blue) / safe) % 6, (blue - red) / safe + 2],
        (red - green) / safe + 4,
    )
    saturation = np.where(value > 0, chroma / np.where(value > 0, value, 1), 0)
    return np.stack([sixth / 6, saturation, value], axis=-1).astype(rgb.dtype)


def hsv_to_rgb(hsv: NDArray[Any]) -> NDArray[Any]:
    """Return RGB of hue, saturation and value; the inverse of `rgb_to_hsv`."""
    hue, saturation, value = (channel[..., None] for channel in np.moveaxis(hsv, -1, 0))
    # Each of R, G and B falls from the value to value·(1 - saturation) with the hue's distance from its own.
    fall = (np.array([5, 3, 1], hsv.dtype) + 6 * hue) % 6
    return np.asarray(value - value * saturation * np.clip(np.minimum(fall, 4 - fall), 0, 1))


def rgb_to_ycbcr(rgb: NDArray[Any]) -> NDArray[Any]:
    """Return luma and the blue and red colour differences [2]_."""
    return np.asarray(rgb @ _RGB_TO_YCBCR.T.astype(rgb.dtype) + _CHROMA_SHIFT.astype(rgb.dtype))


def ycbcr_to_rgb(ycbcr: NDArray[Any]) -> NDArray[Any]:
    """Return RGB of luma and colour differences; the inverse of `rgb_to_ycbcr`."""
    back = np.linalg.inv(_RGB_TO_YCBCR).T.astype(ycbcr.dtype)
    return np.asarray((ycbcr - _CHROMA_SHIFT.astype(ycbcr.dtype)) @ back)


COLOR_SPACES: dict[ColorSpaceName, ColorSpace] = {
    "rgb": ColorSpace(("r", "g", "b"), None, None, np.asarray, np.asarray),
    "hsv": ColorSpace(("h", "s", "v"), "h", "v", rgb_to_hsv, hsv_to_rgb),
    "ycbcr": ColorSpace(("y", "cb", "cr"), "y", "y", rgb_to_ycbcr, ycbcr_to_rgb),
}


def channels_of(color_space: ColorSpaceName, channels: str) -> tuple[int, ...]:
    """Return the indices of the channels that the option `channels` names in a colour space.

    Parameters
    ----------
    color_space : {"rgb", "hsv", "ycbcr"}
    channels : str
        ``all``, ``primary`` (the paper's choice: H of HSV, Y of YCbCr) or one channel's name.

    Raises
    ------
    OptionError
        If the colour space or the channel is unknown, or RGB is asked for a primary channel.

    Examples
    --------
    >>> channels_of("ycbcr", "primary"), channels_of("hsv", "v"), channels_of("rgb", "all")
    ((0,), (2,), (0, 1, 2))
    """
    if color_space not in COLOR_SPACES:
        raise OptionError(f"color_space: expected one of {', '.join(COLOR_SPACES)}, got {color_space!r}")
    space = COLOR_SPACES[color_space]
    if channels == "all":
        return (0, 1, 2)
    name = space.primary if channels == "primary" else channels
    if name not in space.channels:
        choices = ["all", *(["primary"] if space.primary else []), *space.channels]
        raise OptionError(
            f"channels: expected one of {', '.join(choices)} for color_space {color_space}, got {channels!r}"
        )
    return (space.channels.index(name),)
