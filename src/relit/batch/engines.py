"""Engines by name."""

from __future__ import annotations

from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, Literal

from relit.batch.on_dask import on_dask
from relit.batch.on_loky import on_loky
from relit.batch.on_ray import on_ray
from relit.errors import OptionError

if TYPE_CHECKING:
    from collections.abc import Iterator

    from relit.batch.engine import Engine

Name = Literal["local", "dask", "ray"]
_ENGINES: dict[str, Any] = {"local": on_loky, "dask": on_dask, "ray": on_ray}


@contextmanager
def engine(name: Name, workers: int, *, address: str | None = None) -> Iterator[Engine[Any]]:
    """Lend an engine; when the block ends, what is under way is given up.

    Workers do not hear Ctrl-C, and end when this process dies.

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
    ...     [result for ended in lent.run(abs, [(-3,)]) for _, result in ended]
    [3]
    """
    if name not in _ENGINES:
        raise OptionError(f"engine: expected one of {', '.join(_ENGINES)}, got {name!r}")
    if not isinstance(workers, int) or isinstance(workers, bool) or workers < 1:
        raise OptionError(f"workers: expected an integer above 0, got {workers!r}")
    if name == "local" and address is not None:
        raise OptionError("address: goes with the engines dask and ray; leave it out, or choose one of them")
    with _ENGINES[name](workers, address) as lent:
        yield lent
