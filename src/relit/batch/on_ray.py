"""The ray engine: a Ray on this machine, or a cluster that runs already."""

from __future__ import annotations

import logging
import socket
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from relit.batch.lent import PATIENCE, Lent, library, share, work
from relit.errors import OptionError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from concurrent.futures import Future


@contextmanager
def on_ray(workers: int, address: str | None) -> Iterator[Lent]:
    """Lend a Ray; it runs what was in a process that died anew, three times by default."""
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
        threads = share(workers, address)
        remote = ray.remote(num_cpus=1)(work)

        def start(function: Callable[..., Any], *args: Any) -> Future[Any]:
            future: Future[Any] = remote.remote(threads, function, *args).future()
            return future

        of_ray = ray.exceptions
        lost = (of_ray.WorkerCrashedError, of_ray.OutOfMemoryError, of_ray.NodeDiedError)
        at_once = max(workers, int(ray.cluster_resources().get("CPU", 0)))
        yield Lent(at_once, start, lost, of_ray.RayTaskError)
    finally:
        ray.shutdown()


def _knock(address: str) -> None:
    """Raise where nobody listens: Ray's client would wait for minutes."""
    host, _, port = address.removeprefix("ray://").rpartition(":")
    if port.isdecimal():  # not "auto" or "local"
        socket.create_connection((host, int(port)), timeout=PATIENCE).close()
