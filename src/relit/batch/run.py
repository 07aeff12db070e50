"""The run of a batch: rows through workers, each outcome written down before the next is looked at."""

from __future__ import annotations

from collections import deque
from concurrent.futures import FIRST_COMPLETED, wait
from dataclasses import dataclass
from itertools import islice
from typing import TYPE_CHECKING, Any

from relit._version import VERSION
from relit.batch.clashes import check_names
from relit.batch.jobs import KINDS, Job, Outcome
from relit.batch.naming import Naming
from relit.batch.stores import path_of
from relit.batch.sweep import Sweep
from relit.batch.work import do, is_settled
from relit.errors import ClusterLostError, OptionError, WorkerLostError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator
    from concurrent.futures import Future

    from relit.batch.engines import Engine
    from relit.batch.jobs import Plan, Row, Rows
    from relit.batch.journal import Journal
    from relit.settings.options import TransferOptions

    Item = tuple[Job, Outcome | None]

_AT_ONCE = 1000  # rows that cannot be done, written down together
_TICK = 1.0  # s between looks at the progress, at most


@dataclass
class Counts:
    """How far a run is.

    Attributes
    ----------
    total : int
        Rows in all.
    kept : int
        Done by an earlier run, and still as they were.
    ok, failed : int
        That this run did, and that it could not do.
    """

    total: int
    kept: int = 0
    ok: int = 0
    failed: int = 0

    @property
    def done(self) -> int:
        """All that are through."""
        return self.kept + self.ok + self.failed


class Batch:
    """Rows with their names, checked: nothing has been written yet.

    Parameters
    ----------
    rows : Rows
    plan : Plan
    options : TransferOptions
        Of all rows that say nothing else.
    suffix : str, optional
        Of the files to write, instead of the targets' own.
    limit : int, optional
        Only so many rows, the first ones.
    reserved : iterable of str
        Places that no row may write.

    Raises
    ------
    OptionError
        If rows cannot be read, or their names clash.
    """

    def __init__(
        self,
        rows: Rows,
        plan: Plan,
        options: TransferOptions,
        *,
        suffix: str | None = None,
        limit: int | None = None,
        reserved: Iterable[str] = (),
    ) -> None:
        self.plan, self.options, self._rows, self._limit = plan, options, rows, limit
        self._naming = Naming(rows, plan.kind, options, suffix)
        check_names(lambda: map(self._naming.job, rows), plan.kind, plan.folder, reserved)
        self.total = min(self._naming.rows, limit or self._naming.rows)

    @property
    def settings(self) -> dict[str, Any]:
        """What must be the same for a run to go on with what another has begun."""
        options = {name: getattr(self.options, name) for name in KINDS[self.plan.kind].options}
        return {"relit": VERSION, "kind": self.plan.kind, "options": options}

    def rows(self) -> Iterator[tuple[Row, Job | Outcome]]:
        """Go through the rows, each with what is to be done for it, or why that cannot be."""
        for row in islice(self._rows, self._limit):
            yield row, self._naming.job(row)

    def check_journal(self, journal: Journal) -> None:
        """Refuse to go on with what was begun in another way.

        Raises
        ------
        OptionError
            If its results are of another kind; or of other settings, and are not to be replaced.
        """
        before, now = journal.header, self.settings
        if before is None:
            return
        if before["kind"] != now["kind"]:
            raise OptionError(
                f"{self.plan.folder}: holds results of {before['kind']}; choose another folder for those of "
                f"{now['kind']}"
            )
        changes = {"relit": (before["relit"], now["relit"])} | {
            name: (before["options"].get(name), value) for name, value in now["options"].items()
        }
        told = [f"{name} {old} is now {new}" for name, (old, new) in changes.items() if old != new]
        if told and not self.plan.force:
            raise OptionError(
                f"{self.plan.folder}: holds results of other settings ({', '.join(told)}); choose another "
                "folder, or --force to make them anew"
            )

    def to_do(
        self, journal: Journal, counts: Counts, *, leave_stores: bool = False
    ) -> Iterator[Item | Outcome]:
        """Go through the rows that are not done yet, each with how it ended before; count the others.

        Parameters
        ----------
        journal : Journal
        counts : Counts
        leave_stores : bool, optional
            Leave it to the workers to ask stores, of many rows at a time, whether something changed there.
        """
        for _, job in self.rows():
            if isinstance(job, Outcome):
                yield job
                continue
            recorded = journal.find(job.output)
            asks = not leave_stores or all(map(path_of, (self.plan.folder, *job.inputs)))
            if recorded and asks and is_settled(job, self.plan, recorded):
                counts.kept += 1
            else:
                yield job, recorded


def run(
    batch: Batch,
    journal: Journal,
    engine: Engine,
    *,
    window: int,
    tell: Callable[[Counts], None] = lambda _: None,
) -> Counts:
    """Do all rows that are not done yet.

    When a worker dies, the rows that were under way are tried again one at a time; one that is lost alone
    has failed.

    Parameters
    ----------
    batch : Batch
    journal : Journal
        Open for writing.
    engine : Engine
    window : int
        How many rows are under way at once.
    tell : callable, optional
        Gets the counts whenever they change, and every second.

    Raises
    ------
    OptionError
        If the journal was begun in another way.
    ClusterLostError
        If all workers are gone for good; the same run goes on once they are there again.
    """
    batch.check_journal(journal)
    sweep = Sweep(batch.plan.folder, after_another=journal.header is not None)
    sweep.enter(["results.csv"])
    journal.begin(batch.settings)
    counts = Counts(batch.total)
    to_do = batch.to_do(journal, counts, leave_stores=True)
    under_way: dict[Future[Outcome], Item] = {}
    lost: deque[Item] = deque()
    ended: list[Outcome] = []
    alone = False
    gone: ClusterLostError | None = None

    def submit(job: Job, recorded: Outcome | None) -> None:
        sweep.enter(job.files(batch.plan.kind))
        under_way[engine.submit(do, job, batch.plan, recorded)] = job, recorded

    while True:
        if not under_way:
            alone = bool(lost)
        if alone and not under_way:
            submit(*lost.popleft())
        while not (alone or lost) and len(under_way) < window and len(ended) < _AT_ONCE:
            item = next(to_do, None)
            if item is None:
                break
            if isinstance(item, Outcome):
                ended.append(item)
            else:
                submit(*item)
        if not (under_way or ended):
            sweep.leave()
            return counts
        finished = wait(under_way, _TICK, FIRST_COMPLETED).done if under_way else ()
        for future in finished:
            item = under_way.pop(future)
            try:
                outcome = future.result()
                if outcome == item[1] and outcome.status == "ok":
                    counts.kept += 1
                else:
                    ended.append(outcome)
            except ClusterLostError as error:
                gone = error
            except WorkerLostError:
                if alone:
                    ended.append(_died(*item))
                else:
                    lost.append(item)
        if ended:
            journal.add(ended)
            failed = sum(outcome.status == "failed" for outcome in ended)
            counts.failed += failed
            counts.ok += len(ended) - failed
            ended.clear()
        if gone:
            raise gone
        tell(counts)


def _died(job: Job, recorded: Outcome | None) -> Outcome:
    reason = (
        "the worker died (out of memory, or a crash); give it more memory with fewer workers, or make the "
        "photos smaller"
    )
    return Outcome(job.number, job.output, "failed", reason, files=recorded.files if recorded else ())
