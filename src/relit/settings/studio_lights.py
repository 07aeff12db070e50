"""Lights by name, as portraitists set them, or by where the lamp stands."""

from __future__ import annotations

import re
from typing import Any, NamedTuple

import numpy as np

from relit.errors import OptionError
from relit.settings.option_fields import is_finite


class StudioLight(NamedTuple):
    """A lamp and what fills its shadows.

    Attributes
    ----------
    azimuth, elevation : float
        Where the lamp stands, in degrees: from the camera towards the right of the picture, and upwards.
    ambient : float
        Light from everywhere, as a share of all that falls on what looks into the lamp.
    softness : float
        Degrees from the middle of the lamp to its rim.
    """

    azimuth: float
    elevation: float
    ambient: float = 0.2
    softness: float = 10.0


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


def light_text(light: Any) -> Any:
    """Return a light as options keep it: of ``(azimuth, elevation)`` the text, all else as it is.

    Raises
    ------
    OptionError
        If it is a tuple, but not of two angles within ±180 and ±90 degrees.

    Examples
    --------
    >>> light_text((-30, 12.5)), light_text("loop")
    ('-30,12.5', 'loop')
    """
    if not isinstance(light, tuple):  # a list comes from JSON, where a light is text
        return light
    if len(light) == 2 and all(map(is_finite, light)) and _is_in_range(*light):
        return ",".join(np.format_float_positional(float(angle), trim="-") for angle in light)
    raise _refusal(light)


def studio_light(light: Any) -> StudioLight:
    """Return the light that a name, or an azimuth and an elevation, stand for.

    Parameters
    ----------
    light : str or (float, float)
        One of `STUDIO_LIGHTS`; or ``"AZ,EL"`` or ``(AZ, EL)`` in degrees, within ±180 and ±90.

    Raises
    ------
    OptionError
        If it is neither.

    Examples
    --------
    >>> studio_light("butterfly").azimuth, studio_light("-30, 20").elevation
    (0, 20.0)
    """
    text = light_text(light)
    if isinstance(text, str):
        if text in STUDIO_LIGHTS:
            return STUDIO_LIGHTS[text]
        if found := _ANGLES.fullmatch(text):
            azimuth, elevation = map(float, found.groups())
            if _is_in_range(azimuth, elevation):
                return StudioLight(azimuth, elevation)
    raise _refusal(light)


def _is_in_range(azimuth: float, elevation: float) -> bool:
    return abs(azimuth) <= 180 and abs(elevation) <= 90


def _refusal(light: Any) -> OptionError:
    return OptionError(
        f"light: expected one of {', '.join(STUDIO_LIGHTS)}, or AZ,EL in degrees within ±180 and ±90, for "
        f"example -30,20, got {light!r}"
    )
