"""The ``relit batch`` that does with many photos what was asked of ``relit transfer``."""

from __future__ import annotations

import os
import shlex
from dataclasses import fields
from itertools import takewhile
from pathlib import Path
from typing import Any

import click
from click.core import ParameterSource

from relit.settings.options import TransferOptions

_NAMED = 6  # photos that a command names one by one; of more, the pattern nearest to them


def batch_command(photos: tuple[str, ...], output: str | None, settings: TransferOptions) -> str:
    """Return the command, with the options that the one that runs was given."""
    pattern, exact = _pattern_of(photos)
    targets = [pattern] if exact or len(photos) > _NAMED else photos
    words = ["relit", "batch", *(word for place in targets for word in ("--targets", place))]
    source = click.get_current_context().get_parameter_source
    for option in fields(TransferOptions):
        if source(option.name) == ParameterSource.COMMANDLINE or option.name == "light":
            words += _flag(option.metadata["flag"], getattr(settings, option.name))
    folder = str(Path(output).with_suffix("")) if output and output != "-" else "lit"
    return shlex.join([*words, "-o", folder])


def _pattern_of(photos: tuple[str, ...]) -> tuple[str, bool]:
    """Return the shortest pattern that means the photos and nothing else, or else the nearest one."""
    from relit.photo.patterns import expand

    first, names = Path(photos[0]), [Path(photo).name for photo in photos]
    alike = takewhile(lambda letters: len(set(letters)) == 1, zip(*names, strict=False))
    start = "".join(letters[0] for letters in alike)
    patterns = [(first.parent / f"{begin}*{first.suffix}").as_posix() for begin in ("", start)]
    meant = {os.path.normpath(photo) for photo in photos}
    for pattern in patterns:
        if {os.path.normpath(found) for found in expand(pattern)} == meant:
            return pattern, True
    return patterns[-1], False


def _flag(flag: str, value: Any) -> list[str]:
    if isinstance(value, bool):
        return [flag if value else flag.replace("--", "--no-")]
    text = str(value)
    return [f"{flag}={text}"] if text.startswith("-") else [flag, text]
