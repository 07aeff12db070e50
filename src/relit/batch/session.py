"""A batch from its start to its end: journal, workers, table and record."""

from __future__ import annotations

import time
from dataclasses import asdict, dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from relit.batch import places
from relit.batch.engines import engine
from relit.batch.journal import Journal
from relit.batch.naming import STATE
from relit.batch.results import check_table, write_record, write_table
from relit.batch.run import Counts, run
from relit.errors import OptionError, OutputError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from relit.batch.jobs import Job, Outcome
    from relit.batch.run import Batch

    Tell = Callable[[Counts], None]


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

        Examples
        --------
        >>> Places.of("out").results
        'out/results.csv'
        """
        if journal is None and "://" in folder:
            raise OptionError(
                "--journal: expected a local file where the results are not; a run goes on from it, so give "
                "the same one again"
            )
        found = cls(
            Path(journal) if journal else Path(folder, STATE, "journal.jsonl"),
            results or places.join(folder, "results.csv"),
            places.join(folder, "run.json"),
        )
        check_table(found.results)
        return found

    def __iter__(self) -> Iterator[str]:
        """Go through them."""
        yield from (str(self.journal), self.results, self.record)


@dataclass(frozen=True)
class Workers:
    """Who does the work.

    Attributes
    ----------
    engine : {"local", "dask", "ray"}
    workers : int
    address : str or None
        Of a cluster that is there.
    """

    engine: Literal["local", "dask", "ray"] = "local"
    workers: int = 1
    address: str | None = None


@dataclass
class Foreseen:
    """What a run would do.

    Attributes
    ----------
    jobs : list of Job
        The first rows that it would do.
    failing : list of Outcome
        The first that cannot be done.
    """

    counts: Counts
    jobs: list[Job] = field(default_factory=list)
    failing: list[Outcome] = field(default_factory=list)


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
        What the record shall hold besides.
    tell : callable, optional
        Gets the counts as they change.

    Returns
    -------
    Counts

    Raises
    ------
    OptionError
        If results of other settings are there.
    OutputError
        If another run is at work there, or a file that none has written is in the way.
    """
    start = time.time()
    with Journal(where.journal).writing() as journal:
        if journal.header is None and not batch.plan.force:
            for place in (where.results, where.record):
                if places.exists(place):
                    raise OutputError(
                        f"{place}: exists already, and no batch wrote it; choose another folder, or use "
                        "--force"
                    )
        with engine(workers.engine, workers.workers, address=workers.address) as lent:
            # As many again wait at the workers' doors, so that none stands idle while one row is recorded.
            counts = run(batch, journal, lent, window=2 * lent.workers, tell=tell)
        journal.refresh()
        write_table(where.results, batch, journal)
        times = {
            "started": _time(start),
            "ended": _time(time.time()),
            "seconds": round(time.time() - start, 3),
        }
        write_record(where.record, batch.settings | facts | asdict(workers) | asdict(counts) | times)
    return counts


def look_ahead(batch: Batch, where: Places, most: int) -> Foreseen:
    """Return what a run would do; nothing is written.

    Raises
    ------
    OptionError
        If results of other settings are there.
    """
    found = Foreseen(Counts(batch.total))
    with Journal(where.journal).reading() as journal:
        batch.check_journal(journal)
        for item in batch.to_do(journal, found.counts):
            if isinstance(item, tuple):
                found.counts.ok += 1
                found.jobs += [item[0]] if len(found.jobs) < most else []
            else:
                found.counts.failed += 1
                found.failing += [item] if len(found.failing) < most else []
    return found


def _time(seconds: float) -> str:
    return datetime.fromtimestamp(seconds, UTC).isoformat(timespec="seconds")
