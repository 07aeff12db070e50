"""The journal of a batch: a line for each row that ended, safely on disk before the next is looked at.

It is what a run that was killed goes on from. Of several lines on one row, the last counts; what is no line,
as the last one may be when the power fails, is passed over.
"""

from __future__ import annotations

import json
import os
from array import array
from contextlib import ExitStack, contextmanager
from dataclasses import asdict
from typing import IO, TYPE_CHECKING, Any

import numpy as np
from filelock import FileLock, Timeout

from relit.batch.digests import short_digest
from relit.batch.jobs import File, Outcome
from relit.errors import OutputError

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator
    from pathlib import Path


class Journal:
    """The outcomes of rows, in a file that is only ever added to.

    It is opened by `writing`, or by `reading`, which makes no file.

    Parameters
    ----------
    path : Path

    Attributes
    ----------
    header : dict or None
        What the last run that wrote to it said of itself.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     with Journal(Path(folder, "journal.jsonl")).writing() as journal:
    ...         journal.begin({"kind": "transfer"})
    ...         journal.add([Outcome(1, "a.png", "failed", "no face found")])
    ...         journal.refresh()
    ...         journal.find("a.png").reason, journal.find("b.png"), journal.header
    ('no face found', None, {'kind': 'transfer'})
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.header: dict[str, Any] | None = None
        self._stream: IO[bytes] | None = None
        self._keys = np.zeros(0, np.uint64)
        self._places = np.zeros(0, np.uint64)

    @contextmanager
    def writing(self) -> Iterator[Journal]:
        """Keep the journal to this process, which may add to it.

        Raises
        ------
        OutputError
            If another process has it, or it cannot be written.
        """
        lock = FileLock(self.path.with_name(f"{self.path.name}.lock"))
        with ExitStack() as held:
            try:
                self.path.parent.mkdir(parents=True, exist_ok=True)
                held.enter_context(lock.acquire(timeout=0))
                self._stream = held.enter_context(self.path.open("a+b"))
                _cut_torn_line(self._stream)
            except Timeout:
                raise OutputError(
                    f"{self.path}: another run is at work here; wait for it, or choose another folder"
                ) from None
            except OSError as error:
                raise self._unwritable(error) from error
            self.refresh()
            yield self
        self._stream = None

    @contextmanager
    def reading(self) -> Iterator[Journal]:
        """Look into the journal, if there is one."""
        if not self.path.exists():
            yield self
            return
        with self.path.open("rb") as self._stream:
            self.refresh()
            yield self
        self._stream = None

    def begin(self, header: dict[str, Any]) -> None:
        """Add what a run says of itself."""
        self._append([{"run": header}])

    def add(self, outcomes: Iterable[Outcome]) -> None:
        """Add outcomes; when this returns, they are on disk."""
        self._append([asdict(outcome) for outcome in outcomes])

    def refresh(self) -> None:
        """Take note of what the journal holds."""
        keys, wheres = array("Q"), array("Q")
        for where, line in self._lines():
            try:
                record = json.loads(line)
                if "run" in record:
                    self.header = record["run"]
                else:
                    keys.append(short_digest(_outcome(record).key))
                    wheres.append(where)
            except (ValueError, TypeError, KeyError):
                continue
        given, places = np.frombuffer(keys, np.uint64), np.frombuffer(wheres, np.uint64)
        order = np.argsort(given, kind="stable")
        self._keys, self._places = given[order], places[order]

    def find(self, key: str) -> Outcome | None:
        """Return how a row ended the last time, by `Outcome.key`."""
        at = int(np.searchsorted(self._keys, np.uint64(short_digest(key)), side="right")) - 1
        if at < 0 or self._stream is None or int(self._keys[at]) != short_digest(key):
            return None
        self._stream.seek(int(self._places[at]))
        found = _outcome(json.loads(self._stream.readline()))
        return found if found.key == key else None

    def _append(self, records: list[dict[str, Any]]) -> None:
        if self._stream is None:
            raise RuntimeError("the journal is not open for writing")
        try:
            self._stream.write(b"".join(json.dumps(record).encode() + b"\n" for record in records))
            self._stream.flush()
            os.fsync(self._stream.fileno())
        except OSError as error:
            raise self._unwritable(error) from error

    def _unwritable(self, error: OSError) -> OutputError:
        return OutputError(
            f"{self.path}: cannot be written ({error.strerror or error}); choose another place with --journal"
        )

    def _lines(self) -> Iterator[tuple[int, bytes]]:
        if self._stream is not None:
            self._stream.seek(0)
            where = 0
            for line in self._stream:
                if line.endswith(b"\n"):
                    yield where, line
                where += len(line)


def _cut_torn_line(stream: IO[bytes]) -> None:
    """Take away what follows the last whole line, so that the next one starts anew."""
    size = stream.seek(0, os.SEEK_END)
    kept = size
    while kept > 0:
        start = max(kept - (1 << 16), 0)
        stream.seek(start)
        at = stream.read(kept - start).rfind(b"\n")
        kept = start + at + 1
        if at >= 0:
            break
    if kept < size:
        stream.truncate(kept)


def _outcome(record: dict[str, Any]) -> Outcome:
    """Return an outcome from its line."""
    files = {name: tuple(_file(*entry) for entry in record[name]) for name in ("inputs", "files")}
    return Outcome(**record | files)


def _file(digest: str, stamp: list[int] | None) -> File:
    return File(digest, (stamp[0], stamp[1]) if stamp else None)
