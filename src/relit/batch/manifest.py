"""Rows from a manifest: a table in CSV, JSON lines or Parquet."""

from __future__ import annotations

import codecs
import csv
import io
import json
import os
from contextlib import closing, contextmanager
from dataclasses import dataclass, fields
from difflib import get_close_matches
from functools import partial
from hashlib import file_digest
from itertools import chain
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any

from relit.batch import places
from relit.batch.jobs import Row
from relit.errors import OptionError
from relit.settings.option_fields import as_number, is_share
from relit.settings.options import TransferOptions

if TYPE_CHECKING:
    from _csv import Reader
    from collections.abc import Callable, Generator, Iterable, Iterator, Sequence

_PLACES = ("target", "reference", "target_landmarks", "reference_landmarks", "output")
_FIELDS = {option.name: option for option in fields(TransferOptions)}
_COLUMNS = (*_PLACES, *_FIELDS)
_SHOWN = 5  # columns that a message names
_TRUTH = {"true": True, "yes": True, "1": True, "false": False, "no": False, "0": False}

# A row as a reader gives it: values by column, or what is wrong with it.
_Record = dict[str, Any] | str


@dataclass(frozen=True)
class Manifest:
    """The rows of a file, read anew each time.

    The columns are ``target``, ``reference``, ``target_landmarks``, ``reference_landmarks``, ``output``, and
    any field of `TransferOptions`; in JSON lines, options may also stand in an object ``options``. What is
    empty is as the command has it. Relative paths count from the manifest's own folder, and ``output`` from
    the folder of the batch.

    What is wrong with the whole raises an `OptionError`; a row that is wrong by itself has a `Row.problem`.
    """

    place: str

    def __post_init__(self) -> None:
        """Check its format."""
        if Path(self.place).suffix.lower() not in _READERS:
            raise OptionError(
                f"{self.place}: expected a manifest that ends in one of {', '.join(_READERS)}; convert it"
            )

    def __iter__(self) -> Iterator[Row]:
        """Go through the rows."""
        read = _READERS[Path(self.place).suffix.lower()]
        if "://" in self.place:
            below = partial(places.join, self.place.rpartition("/")[0])
        else:
            root = str(Path(self.place).parent)
            below = partial(os.path.join, "" if root == "." else root)
        with self._open() as stream, closing(read(stream, self.place)) as records:
            for number, record in enumerate(records, 1):
                if isinstance(record, dict):
                    yield _row(number, record, below)
                else:
                    yield Row(number, problem=record)

    def digest(self) -> str:
        """Return the SHA-256 of the file."""
        with self._open() as stream:
            return file_digest(stream, "sha256").hexdigest()  # type: ignore[arg-type]

    @contextmanager
    def _open(self) -> Iterator[IO[bytes]]:
        if "://" in self.place:
            yield io.BytesIO(places.read_bytes(self.place))
            return
        try:
            with Path(self.place).open("rb") as stream:
                yield stream
        except OptionError:
            raise
        except (OSError, ValueError) as error:  # ValueError: a NUL in the name
            told = f"cannot be read ({getattr(error, 'strerror', None) or error})"
            raise OptionError(f"{self.place}: {told}; give the file name of a manifest") from None


def _row(number: int, record: dict[str, Any], below: Callable[[str], str]) -> Row:
    """Return a row, its paths from the manifest's folder and its options as what they mean."""
    given = {
        name: value
        for name, value in record.items()
        if not (value is None or (isinstance(value, str) and not value.strip()))
    }
    for name in _PLACES:
        if not isinstance(given.get(name, ""), str) or "\0" in given.get(name, ""):
            return Row(number, problem=f"{name}: expected a path, got {given[name]!r}")
    if "target" not in given:
        return Row(number, problem="target: expected a photo, got nothing; fill it in")
    options = []
    for name in sorted({*given} & {*_FIELDS}):
        if not isinstance(given[name], (str, int, float)):
            return Row(number, problem=f"{name}: expected a number or a word, got {given[name]!r}")
        options.append((name, _meant(name, given[name])))
    inputs = {
        name: given[name] if "://" in given[name] else below(given[name])
        for name in _PLACES[:-1]
        if name in given
    }
    return Row(number, **inputs, output=given.get("output"), options=tuple(options))


def _meant(name: str, value: Any) -> Any:
    """Return what a value stands for that may be written as text; text that stands for nothing stays."""
    if not isinstance(value, str):
        return value
    declared, text = _FIELDS[name], value.strip()
    if choices := declared.metadata["choices"]:
        return next((choice for choice in choices if str(choice) == text), text)
    if isinstance(declared.default, bool):
        return _TRUTH.get(text.lower(), text)
    if declared.metadata["text"] or text in declared.metadata["words"]:
        return text
    try:
        return as_number(text, share=is_share(declared.metadata))
    except ValueError:
        return text


def _check_columns(names: Sequence[str], where: str, *, of_all_rows: bool = True) -> None:
    unknown = [name for name in names if name not in _COLUMNS]
    if unknown:
        near = get_close_matches(unknown[0], _COLUMNS, 1)
        told = f"did you mean {near[0]!r}?" if near else f"expected some of {', '.join(_COLUMNS)}"
        several = "s" if len(unknown) > 1 else ""
        named = ", ".join(map(repr, unknown[:_SHOWN])) + (", ..." if len(unknown) > _SHOWN else "")
        raise OptionError(f"{where}: unknown column{several} {named}; {told}")
    if twice := [name for name in _COLUMNS if names.count(name) > 1]:
        raise OptionError(f"{where}: has column {twice[0]!r} more than once; keep one")
    if of_all_rows and "target" not in names:
        raise OptionError(f"{where}: has no column 'target'; name the columns in the first row")


def _text(stream: IO[bytes], newline: str) -> io.TextIOWrapper:
    """Return a file's text: UTF-8, or UTF-16 as Excel writes it, which a byte order mark tells."""
    head = stream.read(2)
    stream.seek(0)
    if head in (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE):
        return io.TextIOWrapper(stream, "utf-16", errors="replace", newline=newline)
    # File names need not be UTF-8; bytes that are not go through unharmed.
    return io.TextIOWrapper(stream, "utf-8-sig", errors="surrogateescape", newline=newline)


def _csv_records(stream: IO[bytes], place: str) -> Generator[_Record]:
    text = _text(stream, "")
    try:
        head = next((line for line in text if line.strip()), "")
        yield from _csv_lines(csv.reader(chain([head], text), delimiter=_delimiter(head), strict=True), place)
    finally:
        text.detach()


def _delimiter(head: str) -> str:
    """Return what is between columns: where commas are in numbers, Excel takes semicolons; else, or tabs."""
    columns = {mark: [name.strip(' \t\r\n"') for name in head.split(mark)] for mark in ",;\t"}
    return max(columns, key=lambda mark: sum(name in _COLUMNS for name in columns[mark]))


def _csv_lines(reader: Reader, place: str) -> Iterator[_Record]:
    names: list[str] = []
    while True:
        try:
            cells = next(reader)
        except StopIteration:
            break
        except csv.Error as error:
            if not names:
                raise OptionError(f"{place}: expected CSV ({error}); export the table again") from None
            yield f"expected CSV ({error}, line {reader.line_num}); check the quotes of this row"
            continue
        if not any(cell.strip() for cell in cells):
            continue
        if not names:
            names = [name.strip() for name in cells]
            _check_columns(names, place)
        elif any(cell.strip() for cell in cells[len(names) :]):
            yield f"expected {len(names)} cells, got {len(cells)}; quote cells that hold what parts them"
        else:
            yield dict(zip(names, cells, strict=False))
    if not names:
        raise OptionError(f"{place}: is empty; name the columns in the first row")


def _json_records(stream: IO[bytes], place: str) -> Generator[_Record]:
    text = _text(stream, "\n")
    try:
        yield from _json_lines(text, place)
    finally:
        text.detach()


def _json_lines(lines: Iterable[str], place: str) -> Iterator[_Record]:
    number = 0
    for line in lines:
        if not line.strip():
            continue
        number += 1
        try:
            record = json.loads(line)
        except (ValueError, RecursionError) as error:
            yield f"expected a line of JSON ({error}); write it anew"
            continue
        if not isinstance(record, dict) or not isinstance(record.get("options") or {}, dict):
            yield 'expected a JSON object, and "options" in it to be one; write it anew'
            continue
        nested = record.pop("options", None) or {}
        _check_columns([*record, *nested], f"{place}: row {number}", of_all_rows=False)
        if misplaced := {*nested} & {*_PLACES}:
            yield f'{misplaced.pop()}: is no option; put it beside "options"'
            continue
        yield record | nested


def _parquet_records(stream: IO[bytes], place: str) -> Generator[_Record]:
    try:
        from pyarrow.parquet import ParquetFile
    except ImportError:
        raise OptionError(
            f'{place}: Parquet needs pyarrow; pip install "relit[parquet]", or give CSV or JSON lines'
        ) from None
    try:
        file = ParquetFile(stream)
        _check_columns(file.schema_arrow.names, place)
        for batch in file.iter_batches(batch_size=1024):
            yield from batch.to_pylist()
    except OptionError:
        raise
    except (OSError, ValueError) as error:  # pyarrow's own are of these
        told = " ".join(str(error).split())
        raise OptionError(f"{place}: expected Parquet ({told}); write it anew") from None


_READERS: dict[str, Callable[[IO[bytes], str], Generator[_Record]]] = {
    ".csv": _csv_records,
    **dict.fromkeys((".jsonl", ".ndjson"), _json_records),
    **dict.fromkeys((".parquet", ".pq"), _parquet_records),
}
