"""What runs functions in other processes: loky here, Dask and Ray here or on a cluster.

Scheduling, restarting and moving work is theirs. They get one face: a function goes in, a future comes out,
and a process that dies is always a `WorkerLostError`.
"""

from __future__ import annotations

from concurrent.futures import wait
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, Literal, Protocol

from relit.batch.on_dask import on_dask
from relit.batch.on_loky import on_loky
from relit.batch.on_ray import on_ray
from relit.errors import OptionError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from concurrent.futures import Future

Name = Literal["local", "dask", "ray"]
_ENGINES: dict[str, Any] = {"local": on_loky, "dask": on_dask, "ray": on_ray}


class Engine(Protocol):
    """What runs functions in other processes."""

    @property
    def workers(self) -> int:
        """How many functions run at once; submit more than that, and no worker has to wait."""
        ...

    def submit(self, function: Callable[..., Any], *args: Any) -> Future[Any]:
        """Run a function in a worker.

        Parameters
        ----------
        function : callable
            Found by its name in a module that the workers can import, or small enough to be sent.
        *args
            Likewise small: give places of photos, not photos.

        Returns
        -------
        concurrent.futures.Future
            Of what the function returns or raises. If the process died that it ran in, `WorkerLostError`;
            with the local engine, that befalls all that was submitted and not done.

        Raises
        ------
        ClusterLostError
            If the whole cluster is gone; what was submitted before says so too.
        """
        ...


@contextmanager
def engine(name: Name, workers: int, *, address: str | None = None) -> Iterator[Engine]:
    """Lend an engine.

    At the end of the block, what was submitted is finished; if the block ends by an exception, it is
    given up at once. Workers do not hear Ctrl-C, and end when this process dies.

    Parameters
    ----------
    name : {"local", "dask", "ray"}
        loky processes on this machine; or Dask or Ray.
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
    >>> with engine("local", 1) as lent:
    ...     lent.submit(abs, -3).result()
    3
    """
    if name not in _ENGINES:
        raise OptionError(f"engine: expected one of {', '.join(_ENGINES)}, got {name!r}")
    if not isinstance(workers, int) or isinstance(workers, bool) or workers < 1:
        raise OptionError(f"workers: expected an integer above 0, got {workers!r}")
    if name == "local" and address is not None:
        raise OptionError("address: goes with the engines dask and ray; leave it out, or choose one of them")
    with _ENGINES[name](workers, address) as lent:
        yield lent
        wait(lent.pending)
