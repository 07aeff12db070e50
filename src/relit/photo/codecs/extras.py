"""Libraries that only some formats need, and not every user has."""

from __future__ import annotations

from importlib import import_module
from typing import Any

from relit.errors import ImageError


def extra(library: str, name: str, what: str) -> Any:
    """Return an optional library.

    Parameters
    ----------
    library : str
        Its module.
    name : str
        The extra of relit that it comes with.
    what : str
        The files it is for, in plural.

    Raises
    ------
    ImageError
        If it is not installed.

    Examples
    --------
    >>> extra("absent", "heic", "HEIC files")
    Traceback (most recent call last):
        ...
    relit.errors.ImageError: HEIC files need an extra: pip install 'relit[heic]'
    """
    try:
        return import_module(library)
    except ImportError as error:
        raise ImageError(f"{what} need an extra: pip install 'relit[{name}]'") from error
