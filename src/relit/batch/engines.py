"""What runs functions in other processes."""

from __future__ import annotations

import signal
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, Literal, Protocol

from joblib.externals.loky import ProcessPoolExecutor
from joblib.externals.loky.process_executor import BrokenProcessPool

from relit.errors import RelitError, WorkerLostError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from concurrent.futures import Future


class Engine(Protocol):
    """What takes work."""

    @property
    def workers(self) -> int:
        """How many rows run at once."""
        ...

    def submit(self, function: Callable[..., Any], *args: Any) -> Future[Any]:
        """Begin with `function(*args)` somewhere."""
        ...


class _Local:
    def __init__(self, workers: int) -> None:
        self.workers = workers
        self.executor = self._start()

    def _start(self) -> Any:
        return ProcessPoolExecutor(self.workers, initializer=_begin, env={"OMP_NUM_THREADS": "1"})

    def submit(self, function: Callable[..., Any], *args: Any) -> Any:
        try:
            future = self.executor.submit(function, *args)
        except BrokenProcessPool:
            self.executor = self._start()
            future = self.executor.submit(function, *args)
        result = future.result

        def told(timeout: float | None = None) -> Any:
            try:
                return result(timeout)
            except BrokenProcessPool as error:
                raise WorkerLostError("the worker died") from error

        future.result = told
        return future


def _begin() -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)


@contextmanager
def engine(
    name: Literal["local", "dask", "ray"],
    workers: int,
    *,
    address: str | None = None,  # noqa: ARG001
) -> Iterator[Engine]:
    """Lend an engine."""
    if name != "local":
        raise RelitError(f"engine: {name} is not there")
    lent = _Local(workers)
    try:
        yield lent
    finally:
        lent.executor.shutdown(wait=True, kill_workers=True)
