"""The local engine: processes on this machine, which loky keeps."""

from __future__ import annotations

import os
import signal
import threading
import time
import warnings
from concurrent.futures import BrokenExecutor
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from joblib.externals.loky import ProcessPoolExecutor

from relit.batch.lent import Lent, deaf_children, share, work

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from concurrent.futures import Future

#: What the libraries of linear algebra read when they are loaded: relit's own threads are enough.
_ONE_BLAS_THREAD = dict.fromkeys(
    (
        "OMP_NUM_THREADS",
        "OPENBLAS_NUM_THREADS",
        "MKL_NUM_THREADS",
        "BLIS_NUM_THREADS",
        "VECLIB_MAXIMUM_THREADS",
    ),
    "1",
)


@contextmanager
def on_loky(workers: int, address: None) -> Iterator[Lent]:
    """Lend processes of this machine; where one dies, loky gives up all, and new ones follow."""
    threads, lock = share(workers, address), threading.Lock()
    executor = _processes(workers)

    def start(function: Callable[..., Any], *args: Any) -> Future[Any]:
        nonlocal executor
        with lock, deaf_children():
            try:
                future: Future[Any] = executor.submit(work, threads, function, *args)
            except BrokenExecutor:
                executor = _processes(workers)
                future = executor.submit(work, threads, function, *args)
            return future

    lent = Lent(workers, start, (BrokenExecutor,))
    with warnings.catch_warnings():
        # It tells that it replaced a worker that has grown, and how it kills those that are given up.
        warnings.filterwarnings("ignore", module=r"joblib\.externals\.loky")
        try:
            yield lent
        finally:
            if lent.pending:
                # loky's own kill_workers stumbles over what waits in its queue (joblib 1.6).
                for process in list(executor._processes.values()):
                    process.terminate()
            executor.shutdown()


def _processes(workers: int) -> Any:
    return ProcessPoolExecutor(workers, initializer=_begin, initargs=(os.getpid(),), env=_ONE_BLAS_THREAD)


def _begin(parent: int) -> None:
    """Prepare a loky process: Ctrl-C is its parent's, and it ends when that is gone."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with, args=(parent,), daemon=True).start()


def _end_with(parent: int) -> None:
    # Nothing else would: the other workers hold the ends of the pipes that this one waits at.
    while os.getppid() == parent:
        time.sleep(1)
    os._exit(1)
