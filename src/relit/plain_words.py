"""What the library says, without words of Python: for people at a terminal, and for other programs."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable

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
    (r"\bTrue or False\b", "true or false"),
    (r"\bgot (None|True|False)\b", lambda found: f"got {_JSON[found[1]]}"),
    (r"expected shape \(n, 2\).*|expected an \(n, 2\).*", "expected points of 2 numbers each, or of 3"),
    (r"\bshape \((\d+), (\d+)\)", r"\2x\1 px"),
    (r"\bgot \((\d+), (\d+)(?:, \d+)?\)", r"got \2x\1 px"),
    (r"\b(u?int|float|complex)(\d+) values", lambda found: f"{_KINDS[found[1]]} of {found[2]} bits"),
)


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
