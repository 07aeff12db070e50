"""The dask engine: a cluster on this machine, or one that runs already."""

from __future__ import annotations

import asyncio
import logging
from concurrent.futures import CancelledError, Future, ThreadPoolExecutor
from contextlib import ExitStack, contextmanager
from functools import partial
from typing import TYPE_CHECKING, Any

import relit
from relit.batch.lent import GONE, PATIENCE, Lent, deaf_children, library, share, work
from relit.errors import ClusterLostError, OptionError, RelitError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator


@contextmanager
def on_dask(workers: int, address: str | None) -> Iterator[Lent]:
    """Lend a Dask cluster; it runs what was in a process that died elsewhere, three times by default."""
    distributed = library("distributed", "cluster")
    with ExitStack() as stack:
        if address is None:
            cluster: Any = stack.enter_context(_start(distributed, workers))
        else:
            _greet(distributed, cluster := address)
        client = stack.enter_context(distributed.Client(cluster, set_as_default=False))
        _check_versions(client.get_versions(packages=["relit"]))
        threads = share(workers, address)

        def start(function: Callable[..., Any], *args: Any) -> Future[Any]:
            if client.status in ("closing", "closed"):  # a future of such a client would never be done
                raise ClusterLostError(GONE)
            # Not by client.get_executor: where a worker dies with a result that is on its way, its futures
            # raise a TypeError (distributed 2026.8); result() waits until that is computed again.
            future, outer = client.submit(work, threads, function, *args, pure=False), Future[Any]()
            outer.add_done_callback(lambda _: None if future.done() else future.cancel())
            future.add_done_callback(partial(_hand_over, outer=outer))
            return outer

        at_once = max(workers, sum(client.nthreads().values()))
        yield Lent(at_once, start, (distributed.scheduler.KilledWorker,))


def _hand_over(future: Any, outer: Future[Any]) -> None:
    """Let a future of ours end as Dask's did."""
    try:
        result = future.result()
    except CancelledError:
        outer.cancel()
        outer.set_running_or_notify_cancel()  # wakes who waits for it
    except BaseException as error:
        if outer.set_running_or_notify_cancel():
            outer.set_exception(error)
    else:
        if outer.set_running_or_notify_cancel():
            outer.set_result(result)


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
