"""The run of a batch: rows through workers, each outcome on disk before the next is looked at."""

from __future__ import annotations

import os
import time
from contextlib import suppress
from dataclasses import asdict, dataclass, field
from datetime import UTC, datetime
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from relit._version import VERSION
from relit.batch import places
from relit.batch.clashes import check_names
from relit.batch.engines import engine
from relit.batch.jobs import KINDS, Outcome
from relit.batch.journal import Journal
from relit.batch.naming import STATE, Naming
from relit.batch.results import check_table, write_record, write_table
from relit.batch.work import do, is_settled
from relit.errors import OptionError, OutputError, WorkerLostError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

    from relit.batch.engine import Engine
    from relit.batch.jobs import Job, Plan, Row, Rows
    from relit.settings.options import TransferOptions

    Item = tuple[Job, Plan, Outcome | None]  # what `work.do` takes
    Tell = Callable[["Counts"], None]

_DIED = (
    "the worker died (out of memory, or a crash); give it more memory with fewer workers, or make the photos "
    "smaller"
)


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


@dataclass(frozen=True)
class Places:
    """Where a batch keeps what is not a result.

    Attributes
    ----------
    journal : Path
        Local, even where results are not.
    results, record : str
        The table of all rows, and what the run was.
    """

    journal: Path
    results: str
    record: str

    @classmethod
    def of(cls, folder: str, journal: str | None = None, results: str | None = None) -> Places:
        """Return the places that go with a folder for results.

        Raises
        ------
        OptionError
            If the folder is not local and no journal is given, or the table is of unknown format.
        """
        if journal is None and "://" in folder:
            raise OptionError(
                "--journal: expected a local file where the results are not; a run goes on from it, so give "
                "the same one again"
            )
        found = cls(
            Path(journal) if journal else Path(folder, STATE, "journal.sqlite"),
            results or places.join(folder, "results.csv"),
            places.join(folder, "run.json"),
        )
        check_table(found.results)
        return found


@dataclass(frozen=True)
class Workers:
    """Who does the work: an engine of so many workers, in a cluster at an address if it is there already."""

    engine: Literal["local", "dask", "ray"] = "local"
    workers: int = 1
    address: str | None = None


@dataclass
class Foreseen:
    """What a run would do: how much, the first rows that it would do, and the first that cannot be done."""

    counts: Counts
    jobs: list[Job] = field(default_factory=list)
    failing: list[tuple[Row, str]] = field(default_factory=list)


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
        every = ((row, self._naming.job(row)) for row in rows)
        check_names(every, plan.kind, plan.folder, reserved)
        self.total = min(self._naming.rows, limit or self._naming.rows)

    @property
    def settings(self) -> dict[str, Any]:
        """What must be the same for a run to go on with what another has begun."""
        options = {name: getattr(self.options, name) for name in KINDS[self.plan.kind].options}
        return {"relit": VERSION, "kind": self.plan.kind, "options": options}

    def rows(self) -> Iterator[tuple[Row, Job | str]]:
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
        before, now, folder = journal.settings, self.settings, self.plan.folder
        if before is None:
            return
        if before.get("kind") != now["kind"]:
            raise OptionError(
                f"{folder}: holds results of {before.get('kind')}; choose another folder for those of "
                f"{now['kind']}"
            )
        given = before.get("options")
        then = given if isinstance(given, dict) else {}
        changes = {"relit": (before.get("relit"), now["relit"])} | {
            name: (then.get(name), value) for name, value in now["options"].items()
        }
        told = [f"{name} {old} is now {new}" for name, (old, new) in changes.items() if old != new]
        if told and not self.plan.force:
            raise OptionError(
                f"{folder}: holds results of other settings ({', '.join(told)}); choose another folder, or "
                "--force to make them anew"
            )

    def to_do(
        self, journal: Journal, counts: Counts, *, leave_stores: bool = False
    ) -> Iterator[tuple[Row, Job | str, Outcome | None]]:
        """Go through the rows that are not done yet, each with how it ended before; count the others.

        With `leave_stores`, it is left to the workers to ask stores, of many rows at a time, whether
        something changed there.
        """
        for row, job in self.rows():
            recorded = None if isinstance(job, str) else journal.find(job.output)
            if recorded and not isinstance(job, str):
                asks = not leave_stores or all(map(places.path_of, (self.plan.folder, *job.inputs)))
                if asks and is_settled(job, self.plan, recorded):
                    counts.kept += 1
                    continue
            yield row, job, recorded


def run(batch: Batch, journal: Journal, lent: Engine[Any], tell: Tell = lambda _: None) -> Counts:
    """Do all rows that are not done yet.

    Parameters
    ----------
    batch : Batch
    journal : Journal
        Open for writing.
    lent : Engine
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
    journal.begin(batch.settings)
    counts, folders = Counts(batch.total), {batch.plan.folder}

    def items() -> Iterator[Item]:
        for _, job, recorded in batch.to_do(journal, counts, leave_stores=True):
            if isinstance(job, str):
                counts.failed += 1
            else:
                folders.update(
                    places.join(batch.plan.folder, file).rpartition("/")[0]
                    for file in job.files(batch.plan.kind)
                )
                yield job, batch.plan, recorded

    for ended in lent.run(do, items()):
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
        tell(counts)
    _clear(folders)
    return counts


def _clear(folders: Iterable[str]) -> None:
    """Take away the unfinished files of workers that were killed; nobody else is at work there."""
    for path in filter(None, map(places.path_of, folders)):
        for left in path.glob(".relit-*.tmp"):
            with suppress(OSError):
                left.unlink()


def carry_out(
    batch: Batch, where: Places, workers: Workers, facts: dict[str, Any], tell: Tell = lambda _: None
) -> Counts:
    """Do what is left to do of a batch, and write its table and its record.

    Parameters
    ----------
    batch : Batch
    where : Places
    workers : Workers
    facts : dict
        What else the record shall tell.
    tell : callable, optional
        As for `run`.

    Raises
    ------
    OptionError
        If results of other settings are there.
    OutputError
        If another run is at work there, or a file that none has written is in the way.
    """
    start = time.time()
    _check_state(where, batch.plan)
    with Journal(where.journal).writing() as journal:
        batch.check_journal(journal)
        for place in (where.results, where.record):
            name = _from(batch.plan.folder, place)
            if not (journal.owns(name) or batch.plan.force) and places.exists(place):
                raise OutputError(
                    f"{place}: exists already, and no batch wrote it; choose another folder, or use --force"
                )
            journal.take(name)
        with engine(workers.engine, workers.workers, address=workers.address) as lent:
            counts = run(batch, journal, lent, tell)
        write_table(where.results, batch.rows(), journal)
    times = {"started": _time(start), "ended": _time(time.time()), "seconds": round(time.time() - start, 3)}
    write_record(where.record, batch.settings | facts | asdict(workers) | asdict(counts) | times)
    return counts


def look_ahead(batch: Batch, where: Places, most: int) -> Foreseen:
    """Return what a run would do; nothing is written.

    Raises
    ------
    OptionError
        If results of other settings are there.
    """
    _check_state(where, batch.plan)
    found = Foreseen(Counts(batch.total))
    with Journal(where.journal).reading() as journal:
        batch.check_journal(journal)
        for row, job, _ in batch.to_do(journal, found.counts):
            if isinstance(job, str):
                found.counts.failed += 1
                found.failing += [(row, job)] if len(found.failing) < most else []
            else:
                found.counts.ok += 1
                found.jobs += [job] if len(found.jobs) < most else []
    return found


def _check_state(where: Places, plan: Plan) -> None:
    """Refuse to start anew beside the journal of an earlier relit."""
    old = where.journal.with_name("journal.jsonl")
    if not where.journal.exists() and old.exists() and not plan.force:
        raise OptionError(
            f"{old}: is the journal of an earlier relit, which this one does not go on from; choose another "
            "folder, or --force to make all anew"
        )


def _from(folder: str, place: str) -> str:
    """Return a place as it is told from a folder, so that both can be moved together."""
    path, start = places.path_of(place), places.path_of(folder)
    return place if path is None or start is None else os.path.relpath(path, start)


def _time(seconds: float) -> str:
    return datetime.fromtimestamp(seconds, UTC).isoformat(timespec="seconds")
