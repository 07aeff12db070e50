"""What the library says, in the words of the command line: flags for arguments, and nothing of Python."""

from __future__ import annotations

import re
from dataclasses import fields

from relit.plain_words import in_plain_words
from relit.settings.options import TransferOptions

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
    **{name: f"--{name}" for name in ("address", "from", "to", "codec", "crf", "host", "port")},
    "token": "--token or RELIT_TOKEN",
}
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
