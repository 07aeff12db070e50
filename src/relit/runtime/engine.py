"""What runs functions in other processes: items go in, results come out, whatever dies meanwhile.

Scheduling, restarting and moving work is the libraries' own. joblib's `Parallel` would be one face for all of
them, but it waits for ever where Dask gives up a row, yields nothing before the end on Ray, and works in this
very process where there is one worker (joblib 1.6); so here is a loop over their futures.
"""

from __future__ import annotations

import multiprocessing
import signal
from abc import ABC, abstractmethod
from collections import deque
from contextlib import contextmanager
from itertools import islice
from multiprocessing import resource_tracker
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from relit.errors import ClusterLostError, WorkerLostError
from relit.runtime.threads import available, limit

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

Future = TypeVar("Future")
_Item = tuple[Any, ...]

LOST = "the process that worked on it died, as it does where memory runs out"
_TICK = 1.0  # seconds that nothing may end until the caller has a turn


class Engine(ABC, Generic[Future]):
    """What runs functions in other processes.

    Attributes
    ----------
    workers : int
        How many functions run at once. As many again wait at the workers' doors, so that none stands idle.
    """

    workers: int

    def run(self, function: Callable[..., Any], items: Iterable[_Item]) -> Iterator[list[tuple[_Item, Any]]]:
        """Call a function with the arguments that each item is; yield those that ended, with their results.

        Items are asked for when there is room for them, and come back in any order. Where a process dies, all
        that was under way is tried again, one by one; the result of an item that is lost alone is a
        `WorkerLostError`. Now and then nothing has ended.

        Parameters
        ----------
        function : callable
            Found by its name in a module that the workers can import.
        items : iterable of tuple
            Small, as they are sent to the workers: places of photos, not photos.

        Raises
        ------
        ClusterLostError
            If the whole cluster is gone.
        """
        to_do = iter(items)
        lost: deque[_Item] = deque()
        under_way: dict[Future, _Item] = {}
        alone = False
        while True:
            if not under_way:
                alone = bool(lost)
            more = [] if lost else islice(to_do, 2 * self.workers - len(under_way))
            if alone:
                more = [] if under_way else [lost.popleft()]
            for item in more:
                under_way[self.submit(function, *item)] = item
            if not under_way:
                return
            ended: list[tuple[_Item, Any]] = []
            for future in self.wait(list(under_way), _TICK):
                item = under_way.pop(future)
                try:
                    ended.append((item, self.result(future)))
                except ClusterLostError:
                    raise
                except WorkerLostError as error:
                    if alone:
                        ended.append((item, error))
                    else:
                        lost.append(item)
            yield ended

    @abstractmethod
    def submit(self, function: Callable[..., Any], *args: Any) -> Future:
        """Start a function in a worker."""

    @abstractmethod
    def wait(self, futures: list[Future], seconds: float) -> Iterable[Future]:
        """Return those that are done, as soon as there are some, or when so many seconds are over."""

    @abstractmethod
    def result(self, future: Future) -> Any:
        """Return what a function returned, or raise what it raised; `WorkerLostError` if its process died."""


def share(workers: int, address: str | None) -> int:
    """Return how many threads a function may take: its part of the cores; one on a cluster, as it counts."""
    return max(1, available() // workers) if address is None else 1


def work(threads: int, function: Callable[..., Any], *args: Any) -> Any:
    """Call a function: what the libraries run in the workers."""
    with limit(threads):
        return function(*args)


def check_main() -> None:
    """End a process that is only to work, and comes here while it imports the script that started it.

    Python's own word takes forty lines, and says it for every process.
    """
    if getattr(multiprocessing.current_process(), "_inheriting", False):
        raise SystemExit(
            "relit: this script starts processes, and each of them imports it: put what it does below a line "
            'if __name__ == "__main__":'
        )


@contextmanager
def deaf_children() -> Iterator[None]:
    """Let processes that start in the block not hear Ctrl-C, from their first moment."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    resource_tracker.ensure_running()  # its own start would lift the mask
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
