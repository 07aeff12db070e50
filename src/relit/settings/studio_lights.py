"""Lights that a person sets: lamps by name, as portraitists set them, or by where they stand; and their fill.

A light is text, one lamp or several joined by ``+``::

    rembrandt
    -30,20:size=25:color=#ffd9a0+120,10:power=0.4:color=#4060ff
"""

from __future__ import annotations

import re
from typing import Any, NamedTuple

import numpy as np

from relit.errors import OptionError
from relit.photo.profile import decode_srgb
from relit.settings.option_fields import is_finite

#: How many lamps a light may have: as many as the studio tells of one that was found.
MOST_LAMPS = 24

_WHITE = (1.0, 1.0, 1.0)


class Lamp(NamedTuple):
    """A lamp.

    Attributes
    ----------
    azimuth, elevation : float
        Where it stands, in degrees: from the camera towards the right of the picture, and upwards.
    size : float
        Degrees from the middle of the lamp to its rim.
    power : float
        How bright it is, beside the other lamps.
    color : (float, float, float)
        Linear red, green and blue that its filter lets through, the brightest of them 1.
    """

    azimuth: float
    elevation: float
    size: float = 10.0
    power: float = 1.0
    color: tuple[float, float, float] = _WHITE


class StudioLight(NamedTuple):
    """Lamps, and what fills their shadows.

    Attributes
    ----------
    lamps : tuple of Lamp
    fill : float
        White light from everywhere, as a share of all that falls on what looks into a lamp.
    """

    lamps: tuple[Lamp, ...]
    fill: float = 0.2

    @property
    def colored(self) -> bool:
        """Whether any lamp has a colour."""
        return any(lamp.color != _WHITE for lamp in self.lamps)


#: The portraitist's setups. Those with a side are lit from the left of the picture.
STUDIO_LIGHTS = {
    "rembrandt": StudioLight((Lamp(-50, 38),), 0.12),
    "butterfly": StudioLight((Lamp(0, 48),), 0.2),
    "split": StudioLight((Lamp(-75, 5),), 0.12),
    "loop": StudioLight((Lamp(-32, 28),), 0.2),
    "rim": StudioLight((Lamp(-125, 25),), 0.25),
    "flat": StudioLight((Lamp(0, 0),), 0.6),
}

# The point stands between the two runs of digits, or matching would take the square of their length.
_NUMBER = r"\s*([+-]?(?:\d+(?:\.\d*)?|\.\d+))\s*"
_ANGLES = re.compile(f"{_NUMBER},{_NUMBER}")
_JOINED = re.compile(r"(?<=[\w.])\s*\+")  # and not a sign, which follows on a comma, an = or another +
_COLOR = re.compile(r"\s*#([0-9a-fA-F]{2})([0-9a-fA-F]{2})([0-9a-fA-F]{2})\s*")
_EXPECTED = f"one of {', '.join(STUDIO_LIGHTS)}, or AZ,EL in degrees within ±180 and ±90, for example -30,20"
#: Of numbers that may follow on a lamp: the least, the most, and what they are.
_NUMBERS = {"size": (1, 60, "degrees from its middle to its rim"), "power": (0, 10, "times that of others")}


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
    raise OptionError(f"light: expected {_EXPECTED}, got {light!r}")


def studio_light(light: Any, fill: float | None = None) -> StudioLight:
    """Return the light that a text, or an azimuth and an elevation, stand for.

    Parameters
    ----------
    light : str or (float, float)
        ``(AZ, EL)``, or lamps joined by ``+``. Each is one of `STUDIO_LIGHTS`, or ``AZ,EL`` in degrees,
        within ±180 and ±90; then may follow ``:size=DEG``, ``:power=P`` and ``:color=#rrggbb``, in sRGB, of
        which the hue counts, and not how dark it is.
    fill : float, optional
        Light from everywhere, 0 to 1; by default, that of the lamps by name, and 0.2 of others: of several
        lamps, the mean by their power.

    Raises
    ------
    OptionError
        If it is neither.

    Examples
    --------
    >>> studio_light("butterfly").lamps[0].elevation, studio_light("-30, 20").lamps[0].elevation
    (48, 20.0)
    >>> key, rim = studio_light("loop:size=25+120,10:power=0.4:color=#ff0000").lamps
    >>> key.size, rim.power, rim.color
    (25.0, 0.4, (1.0, 0.0, 0.0))
    """
    text = light_text(light)
    if not isinstance(text, str):
        raise OptionError(f"light: expected {_EXPECTED}, got {light!r}")
    texts = _JOINED.split(text)
    if len(texts) > MOST_LAMPS:
        raise OptionError(f"light: expected at most {MOST_LAMPS} lamps, got {len(texts)}")
    lights = [_one(one, text) for one in texts]
    lamps = tuple(one.lamps[0] for one in lights)
    if fill is None:
        fill = lights[0].fill
        if len(lights) > 1:
            powers = [lamp.power for lamp in lamps] if any(lamp.power for lamp in lamps) else None
            fill = float(np.average([one.fill for one in lights], weights=powers))
    return StudioLight(lamps, fill)


def _one(text: str, among: str) -> StudioLight:
    """Return the light of a lamp alone."""
    place, *changes = text.split(":")
    if place in STUDIO_LIGHTS:
        light = STUDIO_LIGHTS[place]
    else:
        found = _ANGLES.fullmatch(place)
        if not found or not _is_in_range(*map(float, found.groups())):
            place = repr(place) + (f" in {among!r}" if among != place else "")
            raise OptionError(f"light: expected {_EXPECTED}, got {place}")
        azimuth, elevation = map(float, found.groups())
        light = StudioLight((Lamp(azimuth, elevation),))
    changed: dict[str, Any] = {}
    for change in changes:
        name, _, value = change.partition("=")
        name = name.strip()
        if name in changed:
            raise OptionError(f"light: lamp {text!r}: expected one {name}, got several")
        changed[name] = _value(name, value, text)
    return light._replace(lamps=(light.lamps[0]._replace(**changed),)) if changed else light


def _value(name: str, value: str, lamp: str) -> float | tuple[float, float, float]:
    """Return a size, a power or a colour."""
    if name in _NUMBERS:
        least, most, what = _NUMBERS[name]
        found = re.fullmatch(_NUMBER, value)
        if found and least <= float(found[1]) <= most:
            return float(found[1])
        raise OptionError(
            f"light: lamp {lamp!r}: expected a {name} of {least} to {most}, {what}, got {value!r}"
        )
    if name == "color":
        found = _COLOR.fullmatch(value)
        if found and any(levels := [int(level, 16) for level in found.groups()]):
            red, green, blue = decode_srgb(np.array(levels) / 255).tolist()
            most = max(red, green, blue)
            return red / most, green / most, blue / most
        raise OptionError(f"light: lamp {lamp!r}: expected a color #rrggbb that is not black, got {value!r}")
    raise OptionError(f"light: lamp {lamp!r}: expected size=, power= or color= after a colon, got {name!r}")


def _is_in_range(azimuth: float, elevation: float) -> bool:
    return abs(azimuth) <= 180 and abs(elevation) <= 90
