"""How far a run of many rows is: a bar on a terminal, else a line now and then."""

from __future__ import annotations

import sys
import time
from contextlib import contextmanager
from typing import TYPE_CHECKING

import click

from relit.cli.telling import is_quiet

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from relit.batch.run import Counts

    Tell = Callable[[Counts], None]

_EVERY = 30.0  # s between lines
_BLINK = 0.1  # s between changes of the bar


@contextmanager
def rows_done(total: int) -> Iterator[Tell]:
    """Lend what shows how far a run is: on a terminal a bar, else a line every half minute, on stderr."""
    start = time.monotonic()
    if is_quiet():
        yield lambda _counts: None
        return
    if not sys.stderr.isatty():
        yield _now_and_then(_EVERY, lambda counts: click.echo(_line(counts, start), err=True))
        return
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn

    columns = (TextColumn("Batch"), BarColumn(), MofNCompleteColumn(), TextColumn("{task.description}"))
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("", total=total)

        def show(counts: Counts) -> None:
            bar.update(task, completed=counts.done, description=_speed(counts, start))

        yield _now_and_then(_BLINK, show)


def _now_and_then(pause: float, show: Tell) -> Tell:
    last = time.monotonic()

    def tell(counts: Counts) -> None:
        nonlocal last
        if time.monotonic() - last >= pause:
            last = time.monotonic()
            show(counts)

    return tell


def _line(counts: Counts, start: float) -> str:
    return f"relit: {counts.done} of {counts.total} rows, {_speed(counts, start)}"


def _speed(counts: Counts, start: float) -> str:
    """Return the failures, the rate of what this run did, and the time that the rest takes at it."""
    told = f"{counts.failed} failed"
    ended = counts.ok + counts.failed
    if not ended:
        return told
    rate = ended / (time.monotonic() - start)
    left = round((counts.total - counts.done) / rate)
    return f"{told}, {rate:.3g} rows/s, {left // 3600}:{left // 60 % 60:02}:{left % 60:02} left"
