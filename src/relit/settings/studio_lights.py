"""Lights by name, as portraitists set them, or by where the lamp stands."""

from __future__ import annotations

import re
from typing import NamedTuple

from relit.errors import OptionError


class StudioLight(NamedTuple):
    """A lamp and what fills its shadows.

    Attributes
    ----------
    azimuth, elevation : float
        Where the lamp stands, in degrees: from the camera towards the right of the picture, and upwards.
    ambient : float
        Light from everywhere, as a share of all that falls on what looks into the lamp.
    """

    azimuth: float
    elevation: float
    ambient: float = 0.2


#: The portraitist's setups. Those with a side are lit from the left of the picture.
STUDIO_LIGHTS = {
    "rembrandt": StudioLight(-50, 38, 0.12),
    "butterfly": StudioLight(0, 48, 0.2),
    "split": StudioLight(-75, 5, 0.12),
    "loop": StudioLight(-32, 28, 0.2),
    "rim": StudioLight(-125, 25, 0.25),
    "flat": StudioLight(0, 0, 0.6),
}

# The point stands between the two runs of digits, or matching would take the square of their length.
_NUMBER = r"\s*([+-]?(?:\d+(?:\.\d*)?|\.\d+))\s*"
_ANGLES = re.compile(f"{_NUMBER},{_NUMBER}")


def studio_light(text: str) -> StudioLight:
    """Return the light that a name, or an azimuth and an elevation, stand for.

    Parameters
    ----------
    text : str
        One of `STUDIO_LIGHTS`, or ``"AZ,EL"`` in degrees, within ±180 and ±90.

    Raises
    ------
    OptionError
        If it is neither.

    Examples
    --------
    >>> studio_light("butterfly").azimuth, studio_light("-30, 20").elevation
    (0, 20.0)
    """
    if text in STUDIO_LIGHTS:
        return STUDIO_LIGHTS[text]
    if found := _ANGLES.fullmatch(text):
        azimuth, elevation = (float(number) for number in found.groups())
        if abs(azimuth) <= 180 and abs(elevation) <= 90:
            return StudioLight(azimuth, elevation)
    raise OptionError(
        f"light: expected one of {', '.join(STUDIO_LIGHTS)}, or AZ,EL in degrees within ±180 and ±90, for "
        f"example -30,20, got {text!r}"
    )
