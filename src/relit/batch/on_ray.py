"""The ray engine: a Ray on this machine, or a cluster that runs already."""

from __future__ import annotations

import logging
import socket
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from relit.batch.engine import PATIENCE, Engine, library, lost_worker, share, work
from relit.errors import OptionError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator


class _Ray(Engine[Any]):
    """It runs what was in a process that died anew, three times by default."""

    def __init__(self, ray: Any, workers: int, threads: int) -> None:
        self.workers = max(workers, int(ray.cluster_resources().get("CPU", 0)))
        self._ray, self._threads = ray, threads
        self._remote = ray.remote(num_cpus=1)(work)

    def submit(self, function: Callable[..., Any], *args: Any) -> Any:
        return self._remote.remote(self._threads, function, *args)

    def wait(self, futures: list[Any], seconds: float) -> Iterable[Any]:
        return self._ray.wait(futures, timeout=seconds)[0]  # type: ignore[no-any-return]

    def result(self, future: Any) -> Any:
        told = self._ray.exceptions
        try:
            return self._ray.get(future)
        except (told.WorkerCrashedError, told.OutOfMemoryError, told.NodeDiedError) as error:
            raise lost_worker() from error
        except told.RayTaskError as error:
            raise error.cause from None


@contextmanager
def on_ray(workers: int, address: str | None) -> Iterator[Engine[Any]]:
    """Lend a Ray."""
    ray = library("ray", "ray")
    if ray.is_initialized():
        raise OptionError("engine: Ray runs in this process already; call ray.shutdown() first")
    quiet = {"log_to_driver": False, "logging_level": logging.CRITICAL}
    try:
        if address is None:
            ray.init(num_cpus=workers, include_dashboard=False, **quiet)
        else:
            _knock(address)
            ray.init(address=address, **quiet)
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
        socket.create_connection((host, int(port)), timeout=PATIENCE).close()
