"""Running a function on several items at once, in threads."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from typing import Protocol, TypeVar

from relit.errors import OptionError

Item = TypeVar("Item")
Result = TypeVar("Result")


class Run(Protocol):
    """What calls a function on every item and returns the results in order."""

    def __call__(self, function: Callable[[Item], Result], items: Iterable[Item], /) -> list[Result]:
        """Return ``[function(item) for item in items]``."""
        ...


def available() -> int:
    """Return how many threads can run at once here."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def check_threads(threads: int | None) -> int:
    """Return the number of threads to use: all that can run at once, by default."""
    if threads is None:
        return available()
    if not isinstance(threads, int) or isinstance(threads, bool) or threads < 1:
        raise OptionError(f"threads: expected an integer above 0, or None for all cores, got {threads!r}")
    return threads


@contextmanager
def pool(threads: int) -> Iterator[Run]:
    """Lend what runs a function on several items, in so many threads.

    Examples
    --------
    >>> with pool(2) as run:
    ...     run(abs, [-1, 2, -3])
    [1, 2, 3]
    """
    if threads == 1:
        yield lambda function, items: [function(item) for item in items]
        return
    with ThreadPoolExecutor(threads) as executor:
        yield lambda function, items: list(executor.map(function, items))


def split(size: int, parts: int) -> Sequence[tuple[int, int]]:
    """Return so many ranges that cover ``range(size)`` in order, of nearly one length.

    Examples
    --------
    >>> split(10, 3)
    [(0, 3), (3, 6), (6, 10)]
    """
    return [(size * part // parts, size * (part + 1) // parts) for part in range(parts)]
