"""Fields of an options object: declared with default, help and range, and checked against them."""

from __future__ import annotations

from dataclasses import field
from numbers import Real
from typing import Any

import numpy as np

from relit.errors import OptionError

#: What options are about, in the order in which a page or a help text shows them.
GROUPS = ("light", "color", "where", "expert")


def option(
    default: Any,
    help_text: str,
    *,
    flag: str,
    group: str = "light",
    title: str = "",
    choices: tuple[Any, ...] = (),
    words: tuple[str, ...] = (),
    text: bool = False,
    at_least: float | None = None,
    at_most: float | None = None,
    above: float | None = None,
) -> Any:
    """Declare an option: default, help, command line flag, range, words that may stand for a number.

    `group` is one of `GROUPS`; `title` is what a photographer calls it, by default as its flag. `text` marks
    what is free text, though by default there is none.
    """
    about = {"group": group, "title": title or flag.strip("-").replace("-", " ").capitalize()}
    kind = {"choices": choices, "words": words, "text": text or isinstance(default, str)}
    limits = {"at_least": at_least, "at_most": at_most, "above": above}
    return field(default=default, metadata={"help": help_text, "flag": flag, **about, **kind, **limits})


def check(name: str, value: Any, default: Any, declared: Any) -> None:
    """Refuse a value that is not what its field declares; the declaration is the field's metadata."""
    if value is None and default is None:
        return
    if choices := declared["choices"]:
        # 4 == 4.0 == True in Python, but only the choice itself is one.
        if not any(type(value) is type(choice) and value == choice for choice in choices):
            raise OptionError(f"{name}: expected one of {', '.join(map(str, choices))}, got {value!r}")
    elif isinstance(default, bool):
        if not isinstance(value, bool):
            raise OptionError(f"{name}: expected True or False, got {value!r}")
    elif declared["text"]:
        if not isinstance(value, str):
            raise OptionError(f"{name}: expected a name, got {value!r}")
    elif not (isinstance(value, str) and value in declared["words"]):
        above, at_least, at_most = declared["above"], declared["at_least"], declared["at_most"]
        if not (
            is_finite(value)
            and (value > above if above is not None else value >= at_least)
            and (at_most is None or value <= at_most)
        ):
            raise OptionError(f"{name}: expected {number_wanted(declared)}, got {value!r}")


def number_wanted(declared: Any) -> str:
    """Return in words which numbers, and words for some, an option takes."""
    above, at_least, at_most = declared["above"], declared["at_least"], declared["at_most"]
    wanted = f"above {above}" if above is not None else f"of {at_least} or more"
    wanted += f" and at most {at_most}" if at_most is not None else ""
    return f"a finite number {wanted}" + "".join(f", or {word!r}" for word in declared["words"])


def is_share(declared: Any) -> bool:
    """Return whether an option is a share of something: what goes from nothing to a most."""
    return declared["at_least"] == 0 and declared["at_most"] is not None


def as_number(text: str, *, share: bool = False) -> float:
    """Return the number that a text is, or raise a `ValueError`; of a share, 80% is 0.8.

    Examples
    --------
    >>> as_number("0.5"), as_number("80%", share=True)
    (0.5, 0.8)
    """
    return float(text[:-1]) / 100 if share and text.endswith("%") else float(text)


def is_finite(value: Any) -> bool:
    """Return whether something is a finite real number."""
    if not isinstance(value, Real) or isinstance(value, bool):
        return False
    try:
        return bool(np.isfinite(float(value)))
    except OverflowError:  # a whole number beyond all floats
        return False
