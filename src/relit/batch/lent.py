"""What all engines have in common: their futures become ours, and their ways to say that a process died."""

from __future__ import annotations

import signal
from concurrent.futures import Future
from contextlib import contextmanager
from functools import partial
from importlib import import_module
from multiprocessing import resource_tracker
from typing import TYPE_CHECKING, Any

from relit.errors import ClusterLostError, OptionError, WorkerLostError
from relit.runtime.threads import available, limit

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

PATIENCE = 10  # seconds for a cluster to answer
GONE = "the cluster is gone; see that it runs, and start again: what was done stays done"


class Lent:
    """An engine, made of a library's way to start work and to say that a process died.

    Parameters
    ----------
    workers : int
        How many functions run at once.
    start : callable
        Takes a function and its arguments, returns the library's own future.
    lost : tuple of exception types
        What the library says of a process that died.
    wrapper : exception type, optional
        What the library wraps around an exception of a function, as its `cause`.
    """

    def __init__(
        self,
        workers: int,
        start: Callable[..., Future[Any]],
        lost: tuple[type[BaseException], ...],
        wrapper: Any = (),
    ) -> None:
        self.workers, self._start, self._lost = workers, start, lost
        self._wrapper = wrapper
        self.pending: set[Future[Any]] = set()

    def submit(self, function: Callable[..., Any], *args: Any) -> Future[Any]:
        """Start a function, as `Engine.submit` says."""
        inner, outer = self._start(function, *args), Future[Any]()
        self.pending.add(outer)
        outer.add_done_callback(self.pending.discard)
        outer.add_done_callback(lambda outer: inner.cancel() if outer.cancelled() else None)
        inner.add_done_callback(partial(self._hand_on, outer=outer))
        return outer

    def _hand_on(self, inner: Future[Any], outer: Future[Any]) -> None:
        if not outer.set_running_or_notify_cancel():
            return
        if inner.cancelled():
            outer.set_exception(ClusterLostError(GONE))
        elif (error := inner.exception()) is None:
            outer.set_result(inner.result())
        elif isinstance(error, self._lost):
            lost = WorkerLostError("the process that worked on it died, as it does where memory runs out")
            lost.__cause__ = error
            outer.set_exception(lost)
        else:
            outer.set_exception(error.cause if isinstance(error, self._wrapper) else error)


def share(workers: int, address: str | None) -> int:
    """Return how many threads a function may take: its part of the cores; one on a cluster, as it counts."""
    return max(1, available() // workers) if address is None else 1


def work(threads: int, function: Callable[..., Any], *args: Any) -> Any:
    """Call a function: what the libraries run in the workers."""
    with limit(threads):
        return function(*args)


@contextmanager
def deaf_children() -> Iterator[None]:
    """Let processes that start in the block not hear Ctrl-C, from their first moment."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    resource_tracker.ensure_running()  # its own start would lift the mask
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def library(name: str, extra: str) -> Any:
    """Return an optional library, or say which extra of relit it comes with.

    Examples
    --------
    >>> library("absent", "cluster")
    Traceback (most recent call last):
        ...
    relit.errors.OptionError: engine: needs a library that is not installed: pip install 'relit[cluster]'
    """
    try:
        return import_module(name)
    except ImportError as error:
        raise OptionError(
            f"engine: needs a library that is not installed: pip install 'relit[{extra}]'"
        ) from error
