"""Settings in a file: what a transfer was made with, so that it can be made again, byte for byte."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from relit._version import VERSION
from relit.errors import LandmarkError, OptionError
from relit.face.landmarks import Landmarks
from relit.settings.options import TransferOptions

if TYPE_CHECKING:
    from collections.abc import Mapping

_LARGEST = 4_000_000  # bytes
_LONGEST_LINE = 400  # letters: all options take 260 to name
_ROLES = ("target", "reference")


@dataclass(frozen=True)
class Settings:
    """Options and landmarks of a transfer.

    Attributes
    ----------
    options : TransferOptions
    target, reference : Landmarks or None
        None where the face is to be detected.
    """

    options: TransferOptions
    target: Landmarks | None = None
    reference: Landmarks | None = None


def as_json(settings: Settings) -> bytes:
    """Return settings as the content of a file.

    Examples
    --------
    >>> settings = from_json(as_json(Settings(TransferOptions(strength=0.5))))
    >>> settings.options.strength, settings.target is None
    (0.5, True)
    """
    landmarks = {
        role: {"scheme": given.scheme, "points": given.points.tolist()}
        for role in _ROLES
        if (given := getattr(settings, role)) is not None
    }
    record = {"relit": VERSION, "options": asdict(settings.options), "landmarks": landmarks}
    return (json.dumps(record, indent=1) + "\n").encode()


def from_json(data: bytes) -> Settings:
    """Read settings from the content of a file.

    Parameters
    ----------
    data : bytes
        JSON: an object with ``options``, of any of the fields of `TransferOptions`, and ``landmarks`` of
        ``target`` and ``reference``, each with a ``scheme`` and ``points``; all may be left out.

    Raises
    ------
    OptionError
        If it is no such object, or an option is unknown or out of range.
    LandmarkError
        If landmarks are unusable.
    """
    try:
        record = json.loads(data)
    except (ValueError, RecursionError) as error:
        raise OptionError(f"settings: expected JSON ({error}); save them anew") from None
    if not isinstance(record, dict) or not {*record} <= {"relit", "options", "landmarks"}:
        raise OptionError('settings: expected an object with "options" and "landmarks"; save them anew')
    options, landmarks = record.get("options", {}), record.get("landmarks", {})
    if not isinstance(options, dict) or not isinstance(landmarks, dict) or not {*landmarks} <= {*_ROLES}:
        raise OptionError('settings: expected objects as "options" and "landmarks"; save them anew')
    return Settings(
        TransferOptions().changed(**options),
        **{role: as_points(given, f"{role}_landmarks") for role, given in landmarks.items()},
    )


def as_points(record: Mapping[str, Any], name: str) -> Landmarks:
    """Return landmarks that JSON holds as ``scheme`` and ``points``.

    Raises
    ------
    LandmarkError
        If they are unusable; the message names them as `name`.
    """
    try:
        scheme, points = record.get("scheme"), record["points"]
        if scheme is not None and not isinstance(scheme, str):
            raise LandmarkError(f"landmarks: unknown scheme {scheme!r}")
        return Landmarks(points, scheme)  # type: ignore[arg-type]
    except LandmarkError as error:
        raise LandmarkError(str(error).replace("landmarks", name, 1)) from None
    except (AttributeError, KeyError, TypeError):
        raise LandmarkError(f'{name}: expected an object with "scheme" and "points"') from None


def read_settings(path: str | Path) -> Settings:
    """Read settings from a file.

    Raises
    ------
    OptionError
        If it cannot be read or holds no settings.
    LandmarkError
        If it holds unusable landmarks.
    """
    try:
        with Path(path).open("rb") as stream:
            data = stream.read(_LARGEST + 1)
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise OptionError(f"{path}: cannot be read ({reason}); give a file of settings") from None
    if len(data) > _LARGEST:
        raise OptionError(f"{path}: is larger than {_LARGEST} bytes, which no settings are")
    try:
        return from_json(data)
    except (OptionError, LandmarkError) as error:
        raise type(error)(f"{path}: {_in_short(str(error))}") from None


def _in_short(told: str) -> str:
    """Return what is wrong as one line that ends: names and values in a file may be anything."""
    line = "".join(letter if letter.isprintable() else " " for letter in told)
    return line if len(line) <= _LONGEST_LINE else f"{line[:_LONGEST_LINE]} ..."
