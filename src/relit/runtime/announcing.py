"""Saying that a step takes longer, this once: a function is compiled."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

_waiting: list[Callable[[], None]] = []


@contextmanager
def announcing(tell: Callable[[], None]) -> Iterator[None]:
    """Call `tell` once if a function of ours is compiled meanwhile: that takes seconds.

    Nothing is compiled, and no compiler is loaded, for the sake of asking.

    Examples
    --------
    >>> told = []
    >>> with announcing(lambda: told.append("compiling")):
    ...     announce()
    ...     announce()
    >>> told
    ['compiling']
    """
    _waiting.append(tell)
    try:
        yield
    finally:
        if tell in _waiting:
            _waiting.remove(tell)


def announce() -> None:
    """Tell all who wait."""
    while _waiting:
        _waiting.pop()()
