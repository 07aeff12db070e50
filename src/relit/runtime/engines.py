"""Engines by name; the local one is here, processes of this machine that joblib's loky keeps."""

from __future__ import annotations

import os
import signal
import threading
import time
import warnings
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Future, wait
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, Literal

from joblib.externals.loky import ProcessPoolExecutor

from relit.errors import OptionError, WorkerLostError
from relit.runtime.clusters import on_dask, on_ray
from relit.runtime.engine import LOST, Engine, check_main, deaf_children, share, work
from relit.runtime.threads import ONE_BLAS_THREAD

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator


class _Loky(Engine[Future[Any]]):
    """Where one process dies, loky gives up all, and new ones follow."""

    def __init__(self, workers: int) -> None:
        self.workers, self._threads = workers, share(workers, None)
        self.executor = self._processes()

    def submit(self, function: Callable[..., Any], *args: Any) -> Future[Any]:
        given = work, self._threads, function, *args
        with deaf_children():
            try:
                return self.executor.submit(*given)  # type: ignore[no-any-return]
            except BrokenExecutor:
                self.executor = self._processes()
                return self.executor.submit(*given)  # type: ignore[no-any-return]

    def wait(self, futures: list[Future[Any]], seconds: float) -> Iterable[Future[Any]]:
        return wait(futures, seconds, FIRST_COMPLETED).done

    def result(self, future: Future[Any]) -> Any:
        try:
            return future.result()
        except BrokenExecutor as error:
            raise WorkerLostError(LOST) from error

    def _processes(self) -> Any:
        parent = (os.getpid(),)
        return ProcessPoolExecutor(self.workers, initializer=_begin, initargs=parent, env=ONE_BLAS_THREAD)


def _begin(parent: int) -> None:
    """Prepare a loky process: Ctrl-C is its parent's, warnings are a line, and it ends when that is gone."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    warnings.formatwarning = _in_one_line
    threading.Thread(target=_end_with, args=(parent,), daemon=True).start()


def _in_one_line(message: Warning | str, *_: Any, **__: Any) -> str:
    """Say what a worker warns of as the command does, without where in the code that was."""
    return f"relit: warning: {message}\n"


def _end_with(parent: int) -> None:
    # Nothing else would: the other workers hold the ends of the pipes that this one waits at.
    while os.getppid() == parent:
        time.sleep(1)
    os._exit(1)


@contextmanager
def _on_loky(workers: int, _address: None) -> Iterator[Engine[Any]]:
    running = _Loky(workers)
    with warnings.catch_warnings():
        # It tells that it replaced a worker that has grown, and how it kills those that are given up.
        warnings.filterwarnings("ignore", module=r"joblib\.externals\.loky")
        try:
            yield running
        except BaseException:
            # loky's own kill_workers stumbles over what waits in its queue (joblib 1.6).
            for process in list(running.executor._processes.values()):
                process.terminate()
            raise
        finally:
            running.executor.shutdown()


_ENGINES: dict[str, Any] = {"local": _on_loky, "dask": on_dask, "ray": on_ray}


@contextmanager
def engine(
    name: Literal["local", "dask", "ray"], workers: int, *, address: str | None = None
) -> Iterator[Engine[Any]]:
    """Lend an engine; if the block ends by an exception, what is under way is given up at once.

    Workers do not hear Ctrl-C, and end when this process dies.

    Parameters
    ----------
    name : {"local", "dask", "ray"}
    workers : int
        How many processes, which share the cores of this machine. With an address that is the cluster's
        affair: a function takes one thread there, and of a cluster that is smaller, or grows when there
        is work, this is what `Engine.workers` says.
    address : str, optional
        Of a running Dask scheduler or Ray cluster. Without it, one is started on this machine, for as long
        as the block lasts.

    Raises
    ------
    OptionError
        If there is no such engine or it is not installed, or nobody answers at the address.

    Examples
    --------
    >>> with engine("local", 1) as running:
    ...     [result for ended in running.run(abs, [(-3,)]) for _, result in ended]
    [3]
    """
    check_main()
    if name not in _ENGINES:
        raise OptionError(f"engine: expected one of {', '.join(_ENGINES)}, got {name!r}")
    if not isinstance(workers, int) or isinstance(workers, bool) or workers < 1:
        raise OptionError(f"workers: expected an integer above 0, got {workers!r}")
    if name == "local" and address is not None:
        raise OptionError("address: goes with the engines dask and ray; leave it out, or choose one of them")
    with _ENGINES[name](workers, address) as running:
        yield running
