"""The run of a batch: rows through workers, each outcome on disk before the next is looked at."""

from __future__ import annotations

import os
import time
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from relit._version import VERSION
from relit.batch import places
from relit.batch.clashes import check_names
from relit.batch.jobs import KINDS, Outcome
from relit.batch.journal import Journal
from relit.batch.naming import STATE, Naming
from relit.batch.results import check_table, write_record, write_table
from relit.batch.work import do, is_settled
from relit.errors import OptionError, OutputError, WorkerLostError
from relit.photo.alone import alone_at

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from contextlib import AbstractContextManager

    from relit.batch.jobs import Job, Plan, Row, Rows
    from relit.runtime.engine import Engine
    from relit.settings.options import TransferOptions

    Tell = Callable[["Counts"], None]

_DIED = (
    "the worker died (out of memory, or a crash); give it more memory with fewer workers, or make the photos "
    "smaller"
)


@dataclass
class Counts:
    """How far a run is: rows in all; done before and as they were; done by it; that it could not do."""

    total: int
    kept: int = 0
    ok: int = 0
    failed: int = 0
    lossy: int = 0  # of those done by it, files that cannot keep all of the metadata

    @property
    def done(self) -> int:
        """All that are through."""
        return self.kept + self.ok + self.failed


class Places(NamedTuple):
    """Where a batch keeps what is no result: its journal, which is local; a table of all rows; its record."""

    journal: Path
    results: str
    record: str

    @classmethod
    def of(cls, folder: str, journal: str | None = None, results: str | None = None) -> Places:
        """Return the places that go with a folder for results, or raise an `OptionError`."""
        if journal is None and "://" in folder:
            raise OptionError(
                "--journal: expected a local file where the results are not; a run goes on from it, so give "
                "the same one again"
            )
        table = results or places.join(folder, "results.csv")
        check_table(table)
        own = Path(journal) if journal else Path(folder, STATE, "journal.sqlite")
        return cls(own, table, places.join(folder, "run.json"))


class Batch:
    """Rows with their names, checked: nothing has been written yet.

    The options count for rows that have none of their own; a suffix, for files that are written, instead of
    the targets' own; a limit, to do only so many rows, the first ones. Where rows cannot be read, or their
    names clash, an `OptionError` is raised.
    """

    def __init__(
        self,
        rows: Rows,
        plan: Plan,
        options: TransferOptions,
        where: Places,
        *,
        suffix: str | None = None,
        limit: int | None = None,
    ) -> None:
        self.plan, self.where, self._rows, self._limit = plan, where, rows, limit
        self._naming = Naming(rows, plan.kind, options, suffix)
        self.renamed = 0  # rows to do whose results have other names than their targets
        check_names(self._named(), plan.kind, plan.folder, map(str, where))
        self.total = min(self._naming.rows, limit or self._naming.rows)
        used = {name: getattr(options, name) for name in KINDS[plan.kind].options}
        #: What must be the same for a run to go on with what another has begun.
        self.settings = {"relit": VERSION, "kind": plan.kind, "options": used}

    def _named(self) -> Iterator[tuple[Row, Job | str]]:
        """Go through all rows, those beyond the limit too, whose names must not clash either."""
        for number, row in enumerate(self._rows):
            yield row, self._naming.job(row)
            if self._limit is None or number < self._limit:
                self.renamed = self._naming.renamed

    def rows(self) -> Iterator[tuple[Row, Job | str]]:
        """Go through the rows, each with what is to be done for it, or why that cannot be."""
        for row in islice(self._rows, self._limit):
            yield row, self._naming.job(row)

    def to_do(
        self, journal: Journal, counts: Counts, *, leave_stores: bool = False
    ) -> Iterator[tuple[Row, Job | str, Outcome | None]]:
        """Go through the rows that are not done yet, each with how it ended before; count the others.

        With `leave_stores`, it is left to the workers to ask stores, of many rows at a time, whether
        something changed there.
        """
        for row, job in self.rows():
            recorded = None
            if not isinstance(job, str) and (recorded := journal.find(job.output)):
                asks = not leave_stores or all(map(places.path_of, (self.plan.folder, *job.inputs)))
                if asks and is_settled(job, self.plan, recorded):
                    counts.kept += 1
                    continue
            yield row, job, recorded

    def check_journal(self, journal: Journal) -> None:
        """Refuse, by an `OptionError`, to go on with what was begun in another way."""
        folder, force = self.plan.folder, self.plan.force
        old = Path(folder, STATE, "journal.jsonl")
        if not places.exists(str(journal.path)) and places.exists(str(old)) and not force:
            raise OptionError(
                f"{old}: is the journal of an earlier relit, which this one does not go on from; choose "
                "another folder, or --force to make all anew"
            )
        if journal.settings is None:
            return
        before, now = _flat(journal.settings), _flat(self.settings)
        if before.get("kind") != now["kind"]:
            raise OptionError(
                f"{folder}: holds results of {before.get('kind')}; choose another folder for those of "
                f"{now['kind']}"
            )
        told = [
            f"{name} {before.get(name)} is now {new}" for name, new in now.items() if before.get(name) != new
        ]
        if told and not force:
            raise OptionError(
                f"{folder}: holds results of other settings ({', '.join(told)}); choose another folder, or "
                "--force to make them anew"
            )


def _flat(settings: dict[str, Any]) -> dict[str, Any]:
    options = settings.get("options")
    return settings | (options if isinstance(options, dict) else {}) | {"options": None}


def run(batch: Batch, journal: Journal, engine: Engine[Any], tell: Tell = lambda _: None) -> Counts:
    """Do all rows that are not done yet; `tell` gets the counts whenever they change, and every second.

    Where all workers are gone for good, a `ClusterLostError` is raised: the same run goes on once they are
    there again.
    """
    batch.check_journal(journal)
    journal.begin(batch.settings)
    counts, plan = Counts(batch.total), batch.plan
    folders = {plan.folder}

    def items() -> Iterator[tuple[Job, Plan, Outcome | None]]:
        for _, job, recorded in batch.to_do(journal, counts, leave_stores=True):
            if isinstance(job, str):
                counts.failed += 1
                continue
            folders.update(places.join(plan.folder, file).rpartition("/")[0] for file in job.files(plan.kind))
            yield job, plan, recorded

    for ended in engine.run(do, items()):
        fresh = []
        for (job, _, recorded), outcome in ended:
            if isinstance(outcome, WorkerLostError):
                outcome = Outcome(job.output, _DIED, files=recorded.files if recorded else ())
            if outcome == recorded and not outcome.reason:
                counts.kept += 1
            else:
                fresh.append(outcome)
        if fresh:
            journal.add(fresh)
        failed = sum(bool(outcome.reason) for outcome in fresh)
        counts.failed += failed
        counts.ok += len(fresh) - failed
        counts.lossy += sum(bool(outcome.not_kept) for outcome in fresh)
        tell(counts)
    # What killed workers left unfinished; nobody else is at work there.
    for path in filter(None, map(places.path_of, folders)):
        for left in path.glob(".relit-*.tmp"):
            left.unlink(missing_ok=True)
    return counts


def carry_out(
    batch: Batch,
    workers: AbstractContextManager[Engine[Any]],
    facts: dict[str, Any],
    tell: Tell = lambda _: None,
    worded: Callable[[str], str] = str,
) -> Counts:
    """Do what is left to do of a batch in an engine that is not open yet, and write its table and its record.

    Of `facts`, the record tells; `tell` is as for `run`, and `worded` as for `write_table`. An `OptionError`
    is raised where results of other settings are there, an `OutputError` where another run is at work, or a
    file of another is in the way.
    """
    started, start, where = datetime.now(UTC), time.monotonic(), batch.where
    batch.check_journal(Journal(where.journal))  # before there is one
    with Journal(where.journal).writing() as journal, _alone_in(batch.plan.folder):
        batch.check_journal(journal)
        for place in (where.results, where.record):
            name = _from(batch.plan.folder, place)
            if not (journal.owns(name) or batch.plan.force) and places.exists(place):
                raise OutputError(
                    f"{place}: exists already, and no batch wrote it; choose another folder, or use --force"
                )
            journal.take(name)
        with workers as engine:
            counts = run(batch, journal, engine, tell)
        write_table(where.results, batch.rows(), journal, worded)
    times = {
        "started": started.isoformat(timespec="seconds"),
        "ended": datetime.now(UTC).isoformat(timespec="seconds"),
        "seconds": round(time.monotonic() - start, 3),  # whatever happens to the clock
    }
    told = batch.settings | facts | asdict(counts) | {"renamed": batch.renamed} | times
    write_record(where.record, told)
    return counts


@contextmanager
def _alone_in(folder: str) -> Iterator[None]:
    """Keep out runs whose journal is another, so that they do not write one file or clear up at a time."""
    path = places.path_of(folder)
    with ExitStack() as held:
        if path is not None:
            with suppress(NotImplementedError):  # the disk knows no locks; the journal, elsewhere, has one
                held.enter_context(alone_at(folder, Path(path, STATE, "folder.lock")))
        yield


def _from(folder: str, place: str) -> str:
    """Return a place as it is told from a folder, so that both can be moved together."""
    path, start = places.path_of(place), places.path_of(folder)
    return place if path is None or start is None else os.path.relpath(path, start)
