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
from relit.batch.cache import versions
from relit.batch.jobs import Outcome
from relit.errors import OptionError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

    from relit.batch.jobs import Job, Row
    from relit.batch.journal import Journal

_TEXTS = ("status", "reason", "target", "reference", "output", "sha256", "not_kept")
_NUMBERS = (
    "seconds",
    *(f"seconds_{stage}" for stage in ("read", "find_the_face", "relight", "split", "write")),
    *("target_confidence", "reference_confidence"),
    *("eye_distance", "folded", "change"),
)
_ROWS_AT_ONCE = 10_000


def check_table(place: str) -> None:
    """Refuse, by an `OptionError`, a table that is neither CSV nor Parquet, or cannot be written here."""
    suffix = Path(place).suffix.lower()
    if suffix not in (".csv", ".parquet"):
        raise OptionError(f"{place}: expected a table that ends in .csv or .parquet; choose another name")
    if suffix == ".parquet":
        _pyarrow(place)


def write_table(
    place: str,
    rows: Iterable[tuple[Row, Job | str]],
    journal: Journal,
    worded: Callable[[str], str] = str,
) -> None:
    """Write how each row of a batch ended, in their order, its reason `worded` for who reads it."""
    make = _csv if Path(place).suffix.lower() == ".csv" else _parquet
    records = (_record(row, job, journal, worded) for row, job in rows)
    places.write_atomically(place, make(place, records), overwrite=True)


def _record(row: Row, job: Job | str, journal: Journal, worded: Callable[[str], str]) -> dict[str, Any]:
    known = Outcome("", job) if isinstance(job, str) else journal.find(job.output)
    outcome = known or Outcome("")
    seconds = [taken for name, taken in outcome.measured.items() if name.startswith("seconds_")]
    return {
        "row": row.number,
        "status": "missing" if known is None else "failed" if outcome.reason else "ok",
        "reason": worded(outcome.reason),
        "target": row.target,
        "reference": row.reference or "",
        "output": outcome.output,
        "sha256": "" if outcome.reason else " ".join(file.digest for file in outcome.files),
        "not_kept": ", ".join(outcome.not_kept),
        **{name: outcome.measured.get(name) for name in _NUMBERS},
        "seconds": round(sum(seconds), 4) if seconds else None,
    }


def _csv(_place: str, records: Iterator[dict[str, Any]]) -> bytes:
    whole = io.BytesIO()
    text = io.TextIOWrapper(whole, "utf-8", errors="surrogateescape", newline="")
    writer = csv.DictWriter(text, ["row", *_TEXTS, *_NUMBERS], lineterminator="\n")
    writer.writeheader()
    writer.writerows(record | {name: harmless(record[name]) for name in _TEXTS} for record in records)
    text.flush()
    return whole.getvalue()


def harmless(text: str) -> str:
    """Return a text that no spreadsheet takes for a formula: with an apostrophe before what could be one.

    To come back to the text, take away one apostrophe where it begins with one.
    """
    return f"'{text}" if text.startswith(("=", "+", "-", "@", "\t", "\r", "'")) else text


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
    """Write what a run was: the facts, and the versions of all that decides its results."""
    record = {"relit": VERSION, "python": platform.python_version(), "platform": platform.platform()}
    data = json.dumps(record | {"libraries": versions()} | facts, indent=1)
    places.write_atomically(place, f"{data}\n".encode(), overwrite=True)
