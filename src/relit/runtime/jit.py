"""Compiling functions with numba: cached where a cache can be written, and announced to whoever asks."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any, TypeVar

from filelock import FileLock
from numba import njit
from numba.core import event

from relit.runtime.announcing import announce

Function = TypeVar("Function", bound=Callable[..., Any])


def compiled(function: Function) -> Function:
    """Compile a function on its first call, free of Python's lock, and keep the result on disk.

    The cache sees by its date whether the function's own file has changed, and no other: a compiled function
    calls compiled functions of its own module alone, or an old one of them would live on in it. Where neither
    the package's folder nor the user's cache can be written, every process compiles anew.
    """
    return _compile(function)


def inlined(function: Function) -> Function:
    """Compile a function as a part of those that call it."""
    return _compile(function, inline="always")


def _compile(function: Function, **options: Any) -> Function:
    try:
        result: Any = njit(cache=True, nogil=True, **options)(function)
    except RuntimeError as error:
        if "cannot cache" not in str(error):
            raise
        return njit(nogil=True, **options)(function)  # type: ignore[no-any-return]
    save = result._cache.save_overload

    def save_if_possible(*compiled: Any) -> None:
        # On a full disk, numba would let the call fail. Of two processes that save one function for two types
        # at once, one would give the other's code its own name.
        with suppress(OSError), FileLock(Path(result._cache.cache_path, ".relit.lock")):
            save(*compiled)

    result._cache.save_overload = save_if_possible
    return result  # type: ignore[no-any-return]


class _Compilations(event.Listener):
    """Announces when a function of ours is compiled."""

    def on_start(self, event: Any) -> None:
        if event.data["dispatcher"].py_func.__module__.startswith("relit."):
            announce()

    def on_end(self, event: Any) -> None:
        pass


event.register("numba:compile", _Compilations())  # type: ignore[no-untyped-call]
