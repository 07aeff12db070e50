"""The curve of sRGB, and colour profiles that have it with other primaries."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

_SRGB = (0.64, 0.33, 0.30, 0.60, 0.15, 0.06, 0.3127, 0.3290)


def encode(light: NDArray[Any]) -> NDArray[Any]:
    """Return linear light in [0, 1] as sRGB values.

    Examples
    --------
    >>> encode(np.array([0, 0.001, 0.2140411, 1])).round(5).tolist()
    [0.0, 0.01292, 0.5, 1.0]
    """
    return np.where(light <= 0.0031308, light * 12.92, 1.055 * light ** (1 / 2.4) - 0.055)


def to_light(values: NDArray[Any]) -> NDArray[Any]:
    """Return sRGB values as linear light.

    Examples
    --------
    >>> to_light(np.array([0, 0.01292, 0.5, 1])).round(7).tolist()
    [0.0, 0.001, 0.2140411, 1.0]
    """
    return np.where(values <= 0.04045, values / 12.92, ((values + 0.055) / 1.055) ** 2.4)


def profile_of(chromaticities: Sequence[float]) -> bytes | None:
    """Return an ICC profile of some primaries, with the curve of sRGB; None for those of sRGB.

    Parameters
    ----------
    chromaticities : sequence of 8 floats
        x and y of red, green, blue and white.
    """
    if np.allclose(chromaticities, _SRGB, rtol=0, atol=1e-3):
        return None
    import imagecodecs

    curve = np.rint(to_light(np.linspace(0, 1, 4096)) * 65535).astype(np.uint16)
    points = [[*chromaticities[n : n + 2], 1.0] for n in range(0, 8, 2)]
    profile = bytearray(
        imagecodecs.cms_profile(
            "rgb",
            primaries=[*points[0], *points[1], *points[2]],
            whitepoint=points[3],
            transferfunction=np.tile(curve, (3, 1)),
        )
    )
    profile[24:36] = bytes(12)  # when it was made: the same photo gives the same bytes
    return bytes(profile)
