"""What relit's plug-ins for GIMP and Krita share: the command that relights, what it needs, and what it says.

It runs in the editors' own Python, 3.8 or later, and needs nothing but that. ``install.py`` puts it beside
each plug-in, with the place of the ``relit`` command in ``command.txt``.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple

#: Stands for the light of a photo, among those by name.
FROM_PHOTO = "photo"
#: Lights by name, as ``relit transfer --light`` knows them.
LIGHTS = ("rembrandt", "butterfly", "split", "loop", "rim", "flat")


class Slider(NamedTuple):
    """A number that a dialog asks for."""

    name: str
    flag: str
    title: str
    default: float
    least: float
    most: float


#: Options of ``relit transfer`` that dialogs offer.
SLIDERS = (
    Slider("strength", "--strength", "Strength", 1.0, 0.0, 4.0),
    Slider("shadows", "--shadows", "Shadows", 1.0, 0.0, 4.0),
    Slider("highlights", "--highlights", "Highlights", 1.0, 0.0, 4.0),
    Slider("softness", "--softness", "Softness", 0.0, 0.0, 1.0),
    Slider("turn", "--turn", "Turn", 0.0, -180.0, 180.0),
    Slider("tilt", "--tilt", "Tilt", 0.0, -90.0, 90.0),
)

_SECONDS = 600  # a photo takes some; what takes longer has hung


class RelitError(Exception):
    """Why nothing was relit, in one line for a dialog."""


class Wanted(NamedTuple):
    """What a dialog asked for: a photo or a light, values of sliders by name, and where relit is."""

    reference: str | None
    light: str | None
    values: dict[str, float]
    command: str = ""


class Files(NamedTuple):
    """The files that go between an editor and relit, in a folder of their own."""

    target: Path
    result: Path
    mask: Path

    @classmethod
    def within(cls, folder: str) -> Files:
        """Return their names in a folder."""
        return cls(*(Path(folder) / f"{name}.png" for name in cls._fields))


def command_line(wanted: Wanted, files: Files) -> list[str]:
    """Return the command that relights.

    Raises
    ------
    RelitError
        If there is no light, or no relit.
    """
    words = [relit_command(wanted.command), "transfer", str(files.target)]
    if wanted.light:
        words += ["--light", wanted.light]
    elif wanted.reference:
        words.append(str(Path(wanted.reference).absolute()))
    else:
        raise RelitError("Choose a photo that gives the light, or a light by name.")
    for slider in SLIDERS:
        value = wanted.values.get(slider.name, slider.default)
        if value != slider.default:
            words += [slider.flag, repr(round(float(value), 4))]
    return [*words, "-o", str(files.result), "--changed", str(files.mask), "--quiet"]


def relight(wanted: Wanted, files: Files) -> None:
    """Relight the target, and wait for the result and its mask.

    Raises
    ------
    RelitError
        If that fails, in one line.
    """
    words = command_line(wanted, files)
    try:
        done = subprocess.run(
            words,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            encoding="utf-8",
            errors="replace",
            timeout=_SECONDS,
            env=_environment(),
            creationflags=getattr(subprocess, "CREATE_NO_WINDOW", 0),
        )
    except subprocess.TimeoutExpired:
        raise RelitError(f"relit gave no answer within {_SECONDS} s; try a smaller photo.") from None
    except OSError as error:
        raise RelitError(f"{words[0]} cannot be started: {error.strerror}") from None
    if done.returncode:
        raise RelitError(told(done.stderr))
    for file in (files.result, files.mask):
        if not file.is_file():
            raise RelitError(f"relit wrote no {file.name}; install the plug-in and relit anew, both alike.")


def relit_command(command: str = "") -> str:
    """Return the ``relit`` command: what is given, or what was noted at installation, or what is on the path.

    Raises
    ------
    RelitError
        If there is none.
    """
    noted = Path(__file__).with_name("command.txt")
    places = [command.strip(), noted.read_text("utf-8").strip() if noted.is_file() else "", "relit"]
    for place in places:
        found = shutil.which(place) if place else None
        if found:
            return found
        if place and place == places[0]:
            raise RelitError(f"{place} is no program; give the place of the relit command.")
    raise RelitError(
        "relit was not found: install it, then run install.py again, or give the place of its command."
    )


def told(said: str) -> str:
    r"""Return what relit said of a failure, in one line.

    Examples
    --------
    >>> told("relit: error: in.png: no face found; use a photo with a larger face\n")
    'in.png: no face found; use a photo with a larger face'
    >>> told("")
    'relit failed, and did not say why; try the same photo with the relit command.'
    """
    line = " ".join(re.split(r"(?:^|\n)relit: error: ", said)[-1].split())
    return line or "relit failed, and did not say why; try the same photo with the relit command."


def _environment() -> dict[str, str]:
    """Return the environment without what an editor's own Python needs, which would lead another astray."""
    ours = {name: value for name, value in os.environ.items() if name not in ("PYTHONHOME", "PYTHONPATH")}
    if sys.platform.startswith("linux") and "APPIMAGE" in ours:
        ours.pop("LD_LIBRARY_PATH", None)
    ours["PYTHONIOENCODING"] = "utf-8"
    ours["COLUMNS"] = "1000"  # messages are not to be wrapped
    return ours
