"""The local engine: processes on this machine, which joblib's loky keeps."""

from __future__ import annotations

import os
import signal
import threading
import time
import warnings
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Future, wait
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from joblib.externals.loky import ProcessPoolExecutor

from relit.batch.engine import Engine, deaf_children, lost_worker, share, work

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

#: What the libraries of linear algebra read when they are loaded: relit's own threads are enough.
_ONE_BLAS_THREAD = {f"{library}_NUM_THREADS": "1" for library in ("OMP", "OPENBLAS", "MKL", "BLIS")} | {
    "VECLIB_MAXIMUM_THREADS": "1"
}


class _Loky(Engine[Future[Any]]):
    """Where one process dies, loky gives up all, and new ones follow."""

    def __init__(self, workers: int) -> None:
        self.workers, self._threads = workers, share(workers, None)
        self._executor = self._processes()

    def submit(self, function: Callable[..., Any], *args: Any) -> Future[Any]:
        with deaf_children():
            try:
                return self._executor.submit(work, self._threads, function, *args)  # type: ignore[no-any-return]
            except BrokenExecutor:
                self._executor = self._processes()
                return self._executor.submit(work, self._threads, function, *args)  # type: ignore[no-any-return]

    def wait(self, futures: list[Future[Any]], seconds: float) -> Iterable[Future[Any]]:
        return wait(futures, seconds, FIRST_COMPLETED).done

    def result(self, future: Future[Any]) -> Any:
        try:
            return future.result()
        except BrokenExecutor as error:
            raise lost_worker() from error

    def end(self, *, at_once: bool) -> None:
        if at_once:
            # loky's own kill_workers stumbles over what waits in its queue (joblib 1.6).
            for process in list(self._executor._processes.values()):
                process.terminate()
        self._executor.shutdown()

    def _processes(self) -> Any:
        return ProcessPoolExecutor(
            self.workers, initializer=_begin, initargs=(os.getpid(),), env=_ONE_BLAS_THREAD
        )


@contextmanager
def on_loky(workers: int, _address: None) -> Iterator[Engine[Any]]:
    """Lend processes of this machine."""
    lent = _Loky(workers)
    with warnings.catch_warnings():
        # It tells that it replaced a worker that has grown, and how it kills those that are given up.
        warnings.filterwarnings("ignore", module=r"joblib\.externals\.loky")
        try:
            yield lent
        except BaseException:
            lent.end(at_once=True)
            raise
        lent.end(at_once=False)


def _begin(parent: int) -> None:
    """Prepare a loky process: Ctrl-C is its parent's, and it ends when that is gone."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with, args=(parent,), daemon=True).start()


def _end_with(parent: int) -> None:
    # Nothing else would: the other workers hold the ends of the pipes that this one waits at.
    while os.getppid() == parent:
        time.sleep(1)
    os._exit(1)
