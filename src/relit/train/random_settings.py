"""Settings of a transfer at random: what may come, checked beforehand, and what comes of a key."""

from __future__ import annotations

from dataclasses import dataclass, fields
from itertools import product
from typing import TYPE_CHECKING, Any

import numpy as np

from relit.errors import OptionError
from relit.settings.methods import WITH_SECOND_REFERENCE
from relit.settings.option_fields import is_finite
from relit.settings.options import TransferOptions
from relit.settings.studio_lights import light_text, studio_light

if TYPE_CHECKING:
    from collections.abc import Sequence

    Lamp = tuple[float, float]
    Lights = str | Lamp | Sequence[str | Lamp]

RANDOM_LAMP = "random"

_FIELDS = [declared.name for declared in fields(TransferOptions)]
#: Options that are checked against one another; all others stand alone.
_LINKED = ("method", "color_space", "channels")


@dataclass(frozen=True)
class Draw:
    """What one call does.

    Attributes
    ----------
    applied : bool
        Whether the image is relit; the other attributes tell how it would be.
    reference : int or None
        Number of the reference; None of a light by name, which is in the options.
    options : TransferOptions
    """

    applied: bool
    reference: int | None
    options: TransferOptions


class RandomSettings:
    """What may be drawn.

    Parameters
    ----------
    references : int
        How many there are.
    lights, azimuth, elevation, p, options
        As of `relit.RelightAugment`.
    changes : dict
        Option → value, range ``(low, high)``, or list of values.

    Raises
    ------
    OptionError
        If one of them is out of range.

    Examples
    --------
    >>> settings = RandomSettings(0, lights="loop", p=1, changes={"strength": (0.5, 1.0)})
    >>> draw = settings.draw(np.random.SeedSequence(1))
    >>> draw.options.light, 0.5 <= draw.options.strength < 1
    ('loop', True)
    """

    def __init__(
        self,
        references: int,
        *,
        lights: Lights | None = None,
        azimuth: tuple[float, float] = (-90, 90),
        elevation: tuple[float, float] = (-20, 60),
        p: float = 0.5,
        options: TransferOptions | None = None,
        changes: dict[str, Any],
    ) -> None:
        if not (is_finite(p) and 0 <= p <= 1):
            raise OptionError(f"p: expected a probability, 0 to 1, got {p!r}")
        self.p = p
        self.references = references
        self.lights = _lights(lights, default=() if references else (RANDOM_LAMP,))
        self.azimuth = _angles("azimuth", azimuth, 180)
        self.elevation = _angles("elevation", elevation, 90)
        self.changes = changes
        self.options = _checked(options or TransferOptions(), changes)

    def draw(self, key: np.random.SeedSequence) -> Draw:
        """Return what comes of a key."""
        # All numbers are drawn, needed or not, so that none depends on what else is random.
        chances = np.random.Generator(np.random.PCG64(key)).random(5 + len(_FIELDS)).tolist()
        applied, kind, which, right, up = chances[:5]
        chosen = {
            name: _between(values, chances[5 + _FIELDS.index(name)]) for name, values in self.changes.items()
        }
        if self.references and (not self.lights or kind < 0.5):
            reference = int(which * self.references)
        else:
            reference = None
            light = self.lights[int(which * len(self.lights))]
            if light == RANDOM_LAMP:
                light = f"{_between(self.azimuth, right):.1f},{_between(self.elevation, up):.1f}"
            chosen["light"] = light
        return Draw(applied < self.p, reference, self.options.changed(**chosen))


def _between(values: Any, chance: float) -> Any:
    """Return the value that a chance in [0, 1) stands for."""
    if isinstance(values, tuple):
        low, high = values
        return low + chance * (high - low)
    return values[int(chance * len(values))] if isinstance(values, list) else values


def _checked(options: TransferOptions, changes: dict[str, Any]) -> TransferOptions:
    """Return options that hold one value of each change, after a look at all values that may come."""
    if options.light is not None or "light" in changes:
        raise OptionError("light: expected none; give lights=... instead")
    values = {name: _values(name, change) for name, change in changes.items()}
    linked = [name for name in _LINKED if name in values]
    alone = [[name] for name in values if name not in _LINKED]
    first = options.changed(**{name: some[0] for name, some in values.items()})
    for names in [linked, *alone]:
        for some in product(*(values[name] for name in names)):
            method = first.changed(**dict(zip(names, some, strict=True))).method
            if method in WITH_SECOND_REFERENCE:
                raise OptionError(f"method: expected one that takes no second reference, got {method!r}")
    return first


def _values(name: str, change: Any) -> list[Any]:
    """Return all values of a choice, or the ends and the middle of a range."""
    if isinstance(change, tuple):
        if not (len(change) == 2 and all(map(is_finite, change)) and change[0] <= change[1]):
            raise OptionError(
                f"{name}: expected two numbers (low, high), low first, for a range, got {change!r}; a choice "
                "is a list"
            )
        # The middle, in case only whole numbers go.
        return [float(change[0]), float(change[1]), (float(change[0]) + float(change[1])) / 2]
    if isinstance(change, list):
        if not change:
            raise OptionError(f"{name}: expected at least one value in the list, got none")
        return change
    return [change]


def _lights(lights: Any, default: tuple[str, ...]) -> tuple[str, ...]:
    """Return lights as options keep them, or the word for a random one."""
    if lights is None:
        return default
    if lights in ([], ()):
        raise OptionError("lights: expected at least one, got none; leave them out for the default")
    one = not isinstance(lights, (list, tuple)) or all(map(is_finite, lights))  # numbers are a lamp's angles
    given = [lights] if one else lights
    for light in given:
        try:
            if light != RANDOM_LAMP:
                studio_light(light)
        except OptionError as error:
            what = (
                str(error).removeprefix("light: ").replace("expected one of", f"expected {RANDOM_LAMP},", 1)
            )
            raise OptionError(f"lights: {what}") from None
    return tuple(map(light_text, given))


def _angles(name: str, angles: Any, most: float) -> tuple[float, float]:
    if not (
        isinstance(angles, (tuple, list))
        and len(angles) == 2
        and all(map(is_finite, angles))
        and -most <= angles[0] <= angles[1] <= most
    ):
        raise OptionError(f"{name}: expected (low, high) in degrees within ±{most}, got {angles!r}")
    return angles[0], angles[1]
