"""Running a function on several items at once, in threads."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from contextvars import ContextVar, copy_context
from functools import cache
from typing import Protocol, TypeVar

from threadpoolctl import ThreadpoolController

from relit.errors import OptionError
from relit.runtime.held import Held

_LEAST_PIXELS = 2**15  # of a band; below, a thread does not pay
_LEAST_ROWS = 16  # the most that a band shares with its neighbour

#: What the libraries of linear algebra read when they are loaded: relit's own threads are enough.
ONE_BLAS_THREAD = dict.fromkeys(
    (f"{name}_NUM_THREADS" for name in ("OMP", "OPENBLAS", "MKL", "BLIS")), "1"
) | {"VECLIB_MAXIMUM_THREADS": "1"}

_most: ContextVar[int | None] = ContextVar("most", default=None)

Item = TypeVar("Item")
Result = TypeVar("Result")


class Run(Protocol):
    """What calls a function on every item and returns the results in order."""

    def __call__(self, function: Callable[[Item], Result], items: Iterable[Item], /) -> list[Result]:
        """Return ``[function(item) for item in items]``."""
        ...


def available() -> int:
    """Return how many threads can run at once here: the cores, or fewer inside `limit`."""
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return min(cores, _most.get() or cores)


@contextmanager
def limit(threads: int) -> Iterator[None]:
    """Let what runs here, and in the threads of a `pool`, take at most so many threads at once.

    So workers side by side share the cores. Linear algebra has threads of its own: see `one_blas_thread`.

    Examples
    --------
    >>> with limit(1):
    ...     available()
    1
    """
    token = _most.set(check_threads(threads))
    try:
        yield
    finally:
        _most.reset(token)


def check_threads(threads: int | None) -> int:
    """Return the number of threads to use: all that can run at once, by default."""
    if threads is None:
        return available()
    if not isinstance(threads, int) or isinstance(threads, bool) or threads < 1:
        raise OptionError(f"threads: expected an integer above 0, or None for all cores, got {threads!r}")
    return threads


@contextmanager
def pool(threads: int) -> Iterator[Run]:
    """Start so many threads, and give what runs a function on several items in them.

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

        def run(function: Callable[[Item], Result], items: Iterable[Item]) -> list[Result]:
            waiting = [executor.submit(copy_context().run, function, item) for item in items]
            return [one.result() for one in waiting]

        try:
            yield run
        except BaseException:
            executor.shutdown(
                wait=False, cancel_futures=True
            )  # who stops does not wait for what has not begun
            raise


def bands(shape: tuple[int, int], threads: int | None) -> list[tuple[int, int]]:
    """Return the ranges of rows of an image that so many threads work on: fewer where it is small.

    Examples
    --------
    >>> bands((512, 512), 2), bands((100, 100), 2)
    ([(0, 256), (256, 512)], [(0, 100)])
    """
    height, width = shape
    most = min(check_threads(threads), height * width // _LEAST_PIXELS, height // _LEAST_ROWS)
    return split(height, max(1, most))


def split(size: int, parts: int) -> list[tuple[int, int]]:
    """Return so many ranges that cover ``range(size)`` in order, of nearly one length.

    Examples
    --------
    >>> split(10, 3)
    [(0, 3), (3, 6), (6, 10)]
    """
    return [(size * part // parts, size * (part + 1) // parts) for part in range(parts)]


@contextmanager
def one_blas_thread() -> Iterator[None]:
    """Keep BLAS to one thread: more change the rounding, and on a busy machine wait for one another.

    What a user has set is set again when nobody is inside: to go in again costs nothing.

    Examples
    --------
    >>> import numpy as np
    >>> with one_blas_thread():
    ...     np.linalg.solve(2 * np.eye(2), [1, 2]).tolist()
    [0.5, 1.0]
    """
    with _one_blas.inside():
        yield


@cache
def _blas() -> ThreadpoolController:
    return ThreadpoolController()


def _hold_blas() -> Callable[[], None]:
    restore: Callable[[], None] = _blas().limit(limits=1, user_api="blas").restore_original_limits
    return restore


_one_blas = Held(_hold_blas)
