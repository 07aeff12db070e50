"""What a batch leaves beside its results: a table of all rows, and a record to repeat it by."""

from __future__ import annotations

import csv
import io
import json
import platform
from pathlib import Path
from typing import TYPE_CHECKING, Any

from relit._version import VERSION
from relit.batch import places
from relit.batch.jobs import Outcome
from relit.batch.libraries import versions
from relit.errors import OptionError

if TYPE_CHECKING:
    from collections.abc import Iterator

    from relit.batch.journal import Journal
    from relit.batch.run import Batch

_STAGES = ("read", "find the face", "relight", "split", "write")
_ROLES = ("target", "reference")
_METRICS = ("eye_distance", "folded", "change")
_TEXTS = ("status", "reason", "target", "reference", "output", "sha256")
_NUMBERS = (
    "seconds",
    *(f"seconds_{stage.replace(' ', '_')}" for stage in _STAGES),
    *(f"{role}_confidence" for role in _ROLES),
    *_METRICS,
)
_ROWS_AT_ONCE = 10_000


def check_table(place: str) -> None:
    """Refuse a table of unknown format.

    Raises
    ------
    OptionError
        If it is neither CSV nor Parquet, or Parquet cannot be written here.
    """
    suffix = Path(place).suffix.lower()
    if suffix not in (".csv", ".parquet"):
        raise OptionError(f"{place}: expected a table that ends in .csv or .parquet; choose another name")
    if suffix == ".parquet":
        _pyarrow(place)


def write_table(place: str, batch: Batch, journal: Journal) -> None:
    """Write how each row of a batch ended, in their order; the journal must be refreshed.

    Raises
    ------
    OutputError
        If it cannot be written.
    """
    make = _csv if Path(place).suffix.lower() == ".csv" else _parquet
    places.write_atomically(place, make(place, _records(batch, journal)), overwrite=True)


def _records(batch: Batch, journal: Journal) -> Iterator[dict[str, Any]]:
    for row, job in batch.rows():
        key = job.key if isinstance(job, Outcome) else job.output
        outcome = journal.find(key) or Outcome(row.number, "", "missing")
        yield {
            "row": row.number,
            "status": outcome.status,
            "reason": outcome.reason,
            "target": row.target,
            "reference": row.reference or "",
            "output": outcome.output,
            "sha256": " ".join(file.digest for file in outcome.files) if outcome.status == "ok" else "",
            "seconds": round(sum(outcome.seconds.values()), 4) if outcome.seconds else None,
            **{f"seconds_{stage.replace(' ', '_')}": outcome.seconds.get(stage) for stage in _STAGES},
            **{f"{role}_confidence": outcome.confidence.get(role) for role in _ROLES},
            **{name: outcome.metrics.get(name) for name in _METRICS},
        }


def _csv(_place: str, records: Iterator[dict[str, Any]]) -> bytes:
    whole = io.BytesIO()
    text = io.TextIOWrapper(whole, "utf-8", errors="surrogateescape", newline="")
    writer = csv.DictWriter(text, ["row", *_TEXTS, *_NUMBERS], lineterminator="\n")
    writer.writeheader()
    writer.writerows(records)
    text.flush()
    return whole.getvalue()


def _parquet(place: str, records: Iterator[dict[str, Any]]) -> bytes:
    pa, pq = _pyarrow(place)
    kinds = [("row", pa.int64()), *((n, pa.string()) for n in _TEXTS), *((n, pa.float64()) for n in _NUMBERS)]
    schema, whole = pa.schema(kinds), io.BytesIO()
    with pq.ParquetWriter(whole, schema) as writer:
        rows: list[dict[str, Any]] = []
        for record in records:
            # Parquet knows no text that is not Unicode, as names of files may be.
            rows.append(record | {n: record[n].encode("utf-8", "replace").decode() for n in _TEXTS})
            if len(rows) == _ROWS_AT_ONCE:
                writer.write_table(pa.Table.from_pylist(rows, schema))
                rows.clear()
        writer.write_table(pa.Table.from_pylist(rows, schema))
    return whole.getvalue()


def _pyarrow(place: str) -> tuple[Any, Any]:
    try:
        import pyarrow as pa
        from pyarrow import parquet
    except ImportError:
        raise OptionError(
            f'{place}: Parquet needs pyarrow; pip install "relit[parquet]", or choose a name in .csv'
        ) from None
    return pa, parquet


def write_record(place: str, facts: dict[str, Any]) -> None:
    """Write what a run was: the facts, and the versions of all that decides its results.

    Raises
    ------
    OutputError
        If it cannot be written.
    """
    record = {"relit": VERSION, "python": platform.python_version(), "platform": platform.platform()}
    data = json.dumps(record | {"libraries": versions()} | facts, indent=1)
    places.write_atomically(place, f"{data}\n".encode(), overwrite=True)
