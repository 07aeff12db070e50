"""Dask and Ray, started here or running elsewhere: they do what was in a process that died in another one."""

from __future__ import annotations

import asyncio
import logging
import socket
from concurrent.futures import CancelledError, ThreadPoolExecutor
from contextlib import ExitStack, contextmanager
from importlib import import_module
from typing import TYPE_CHECKING, Any

import relit
from relit.errors import ClusterLostError, OptionError, RelitError, WorkerLostError
from relit.runtime.engine import LOST, Engine, deaf_children, share, work

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

_PATIENCE = 10  # seconds for a cluster to answer
_GONE = "the cluster is gone; see that it runs, and start again: what was done stays done"


class _Dask(Engine[Any]):
    def __init__(self, distributed: Any, client: Any, workers: int, threads: int) -> None:
        self.workers = max(workers, sum(client.nthreads().values()))
        self._distributed, self._client, self._threads = distributed, client, threads

    def submit(self, function: Callable[..., Any], *args: Any) -> Any:
        if self._client.status in ("closing", "closed"):  # a future of such a client would never be done
            raise ClusterLostError(_GONE)
        return self._client.submit(work, self._threads, function, *args, pure=False)

    def wait(self, futures: list[Any], seconds: float) -> Iterable[Any]:
        try:
            with self._client.as_current():  # wait looks for a client by itself
                return list(self._distributed.wait(futures, seconds, "FIRST_COMPLETED").done)
        except TimeoutError:
            return ()
        except CancelledError as error:
            raise ClusterLostError(_GONE) from error

    def result(self, future: Any) -> Any:
        try:
            return future.result()  # where a worker dies with a result on its way, that is computed again
        except self._distributed.KilledWorker as error:
            raise WorkerLostError(LOST) from error
        except CancelledError as error:
            raise ClusterLostError(_GONE) from error


class _Ray(Engine[Any]):
    def __init__(self, ray: Any, workers: int, threads: int) -> None:
        self.workers = max(workers, int(ray.cluster_resources().get("CPU", 0)))
        self._ray, self._threads, self._remote = ray, threads, ray.remote(num_cpus=1)(work)

    def submit(self, function: Callable[..., Any], *args: Any) -> Any:
        return self._remote.remote(self._threads, function, *args)

    def wait(self, futures: list[Any], seconds: float) -> Iterable[Any]:
        some, _ = self._ray.wait(futures, timeout=seconds)  # one, of all that may be done
        return list(self._ray.wait(futures, num_returns=len(futures), timeout=0)[0]) if some else ()

    def result(self, future: Any) -> Any:
        told = self._ray.exceptions
        try:
            return self._ray.get(future)
        except (told.WorkerCrashedError, told.OutOfMemoryError, told.NodeDiedError) as error:
            raise WorkerLostError(LOST) from error
        except told.RayTaskError as error:
            raise error.cause from None


@contextmanager
def on_dask(workers: int, address: str | None) -> Iterator[Engine[Any]]:
    """Lend a Dask cluster."""
    distributed = _library("distributed", "cluster")
    with ExitStack() as stack:
        if address is None:
            cluster: Any = stack.enter_context(_started(distributed, workers))
        else:
            _greet(distributed, cluster := address)
        client = stack.enter_context(distributed.Client(cluster, set_as_default=False))
        _check_versions(client.get_versions(packages=["relit"]))
        yield _Dask(distributed, client, workers, share(workers, address))


def _started(distributed: Any, workers: int) -> Any:
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
        async with asyncio.timeout(_PATIENCE), distributed.rpc(address) as server:
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


@contextmanager
def on_ray(workers: int, address: str | None) -> Iterator[Engine[Any]]:
    """Lend a Ray."""
    ray = _library("ray", "ray")
    if ray.is_initialized():
        raise OptionError("engine: Ray runs in this process already; call ray.shutdown() first")
    where: dict[str, Any] = {"address": address}
    try:
        if address is None:
            where = {"num_cpus": workers, "include_dashboard": False}
        else:
            _knock(address)
        ray.init(log_to_driver=False, logging_level=logging.CRITICAL, **where)
    except (Exception, SystemExit) as error:  # Ray has many ways to say so
        raise OptionError(
            f"address: no Ray cluster answers at {address!r}; check it: expected one such as "
            f"10.0.0.1:6379, where ray start --head was called ({error})"
        ) from error
    try:
        yield _Ray(ray, workers, share(workers, address))
    finally:
        ray.shutdown()


def _knock(address: str) -> None:
    """Raise where nobody listens: Ray's client would wait for minutes."""
    host, _, port = address.removeprefix("ray://").rpartition(":")
    if port.isdecimal():  # not "auto" or "local"
        socket.create_connection((host, int(port)), timeout=_PATIENCE).close()


def _library(name: str, extra: str) -> Any:
    try:
        return import_module(name)
    except ImportError as error:
        raise OptionError(
            f"engine: needs a library that is not installed: pip install 'relit[{extra}]'"
        ) from error
