"""What the library says, in the words of the command line: flags for arguments, and nothing of Python."""

from __future__ import annotations

import re
from dataclasses import fields
from typing import TYPE_CHECKING

from relit.settings.options import TransferOptions

if TYPE_CHECKING:
    from collections.abc import Callable

#: Arguments of the library by what the command line calls them.
_CALLED = {
    **{option.name: option.metadata["flag"] for option in fields(TransferOptions)},
    "target": "TARGET",
    "reference": "REFERENCE",
    "image": "IMAGE",
    "landmarks": "--landmarks",
    "target_landmarks": "--target-landmarks",
    "reference_landmarks": "--reference-landmarks",
    "second_landmarks": "--second-landmarks",
    "second_reference": "--second-reference",
    "region_mask": "--region-mask",
    "interocular_distance": "--eye-distance",
    "address": "--address",
    **{name: f"--{name}" for name in ("from", "to", "codec", "crf")},
}
_JSON = {"None": "nothing", "True": "true", "False": "false"}
_KINDS = {
    "int": "signed numbers",
    "uint": "whole numbers",
    "float": "floating-point numbers",
    "complex": "complex numbers",
}
_PHRASES: tuple[tuple[str, str | Callable[[re.Match[str]], str]], ...] = (
    (r"--force or overwrite=True", "--force"),
    (r"raise max_pixels if you trust the file", "save it smaller"),
    (r"\(light=\.\.\.\)", "(--light)"),
    (r" as extension or as format=$", " as extension"),
    (r"\bfound version None", "found no version"),
    (r"\bTrue or False\b", "true or false"),
    (r"\bgot (None|True|False)\b", lambda found: f"got {_JSON[found[1]]}"),
    (r"\bshape \((\d+), (\d+)\)", r"\2x\1 px"),
    (r"\bgot \((\d+), (\d+)(?:, \d+)?\)", r"got \2x\1 px"),
    (r"\b(u?int|float|complex)(\d+) values", lambda found: f"{_KINDS[found[1]]} of {found[2]} bits"),
)
# No part of a file's name, and no value in quotes.
_NAMES = re.compile(rf"(?<![\w./'-])({'|'.join(name for name in _CALLED if '_' in name)})(?![\w./'-])")


def in_flags(message: str) -> str:
    """Return a message of the library with flags for its arguments, and without words of Python.

    What a file is to blame for keeps its names: they are keys of settings, or columns of a table.

    Examples
    --------
    >>> in_flags("lam: expected a finite number above 0, or 'auto', got -1.0")
    "--lambda: expected a finite number above 0, or 'auto', got -1.0"
    >>> in_flags("settings.json: lam: expected a finite number above 0, or 'auto', got None")
    "settings.json: lam: expected a finite number above 0, or 'auto', got nothing"
    """
    argument, colon, rest = message.partition(": ")
    if argument in _CALLED:
        argument = _CALLED[argument]
    elif not _NAMES.search(argument):
        return in_plain_words(message)
    return _NAMES.sub(lambda found: _CALLED[found[1]], in_plain_words(f"{argument}{colon}{rest}"))


def in_plain_words(message: str) -> str:
    """Return a message of the library without words of Python; its first part may be a file's name.

    Examples
    --------
    >>> in_plain_words("None.png: exists already; use --force or overwrite=True to replace it")
    'None.png: exists already; use --force to replace it'
    """
    subject, colon, rest = message.partition(": ")
    for python, plain in _PHRASES:
        rest = re.sub(python, plain, rest)
    return f"{subject}{colon}{rest}"
