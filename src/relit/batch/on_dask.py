"""The dask engine: a cluster on this machine, or one that runs already."""

from __future__ import annotations

import asyncio
import logging
from concurrent.futures import CancelledError, ThreadPoolExecutor
from contextlib import ExitStack, contextmanager
from typing import TYPE_CHECKING, Any

import relit
from relit.batch.engine import PATIENCE, Engine, deaf_children, library, lost_worker, share, work
from relit.errors import ClusterLostError, OptionError, RelitError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator


class _Dask(Engine[Any]):
    """It runs what was in a process that died elsewhere, three times by default."""

    def __init__(self, distributed: Any, client: Any, workers: int, threads: int) -> None:
        self.workers = max(workers, sum(client.nthreads().values()))
        self._distributed, self._client, self._threads = distributed, client, threads

    def submit(self, function: Callable[..., Any], *args: Any) -> Any:
        if self._client.status in ("closing", "closed"):  # a future of such a client would never be done
            raise _gone()
        return self._client.submit(work, self._threads, function, *args, pure=False)

    def wait(self, futures: list[Any], seconds: float) -> Iterable[Any]:
        try:
            with self._client.as_current():  # wait asks for a client by itself
                return self._distributed.wait(futures, seconds, "FIRST_COMPLETED").done  # type: ignore[no-any-return]
        except TimeoutError:
            return ()
        except CancelledError as error:
            raise _gone() from error

    def result(self, future: Any) -> Any:
        try:
            return future.result()  # where a worker dies with a result on its way, that is computed again
        except self._distributed.KilledWorker as error:
            raise lost_worker() from error
        except CancelledError as error:
            raise _gone() from error


@contextmanager
def on_dask(workers: int, address: str | None) -> Iterator[Engine[Any]]:
    """Lend a Dask cluster."""
    distributed = library("distributed", "cluster")
    with ExitStack() as stack:
        if address is None:
            cluster: Any = stack.enter_context(_start(distributed, workers))
        else:
            _greet(distributed, cluster := address)
        client = stack.enter_context(distributed.Client(cluster, set_as_default=False))
        _check_versions(client.get_versions(packages=["relit"]))
        yield _Dask(distributed, client, workers, share(workers, address))


def _gone() -> ClusterLostError:
    return ClusterLostError(
        "the cluster is gone; see that it runs, and start again: what was done stays done"
    )


def _start(distributed: Any, workers: int) -> Any:
    """Return a cluster on this machine."""
    try:
        with deaf_children():
            return distributed.LocalCluster(
                n_workers=workers,
                threads_per_worker=1,
                memory_limit=None,
                dashboard_address="127.0.0.1:0",
                silence_logs=logging.CRITICAL,
            )
    except Exception as error:
        raise RelitError(
            f"engine: Dask cannot start {workers} workers here ({error}); use fewer, or the local engine"
        ) from error


def _greet(distributed: Any, address: str) -> None:
    """Refuse an address where no scheduler is; Dask's client waits for ever for a server that is silent."""

    async def greet() -> None:
        async with asyncio.timeout(PATIENCE), distributed.rpc(address) as server:
            await server.identity()

    try:
        with ThreadPoolExecutor(1) as thread:  # in this one, a loop may run: that of a notebook
            thread.submit(asyncio.run, greet()).result()
    except Exception as error:  # whatever another kind of server answers
        raise OptionError(
            f"address: no Dask scheduler answers at {address!r}; check it: expected one such as "
            "tcp://10.0.0.1:8786, where dask scheduler runs"
        ) from error


def _check_versions(found: dict[str, Any]) -> None:
    """Refuse a cluster with another relit than this one: rows would not be the same bytes."""
    for who, of_it in {"the scheduler": found["scheduler"], **found["workers"]}.items():
        if (version := of_it["packages"]["relit"]) != relit.__version__:
            there = f"has relit {version}" if version else "has no relit"
            raise OptionError(f"address: {who} {there}; install relit {relit.__version__} there, as here")
