"""The journal of a batch: how each row ended, safely on disk before the next is looked at.

It is what a run that was killed goes on from: one SQLite file, a row for each output. Only one run writes to
it, which a lock beside it sees to; so its write-ahead log may lie on any disk that this machine can lock.
"""

from __future__ import annotations

import json
import os
import sqlite3
from contextlib import ExitStack, closing, contextmanager
from dataclasses import asdict
from typing import TYPE_CHECKING, Any
from urllib.parse import quote

from relit.batch.jobs import File, Outcome
from relit.errors import OutputError
from relit.photo.alone import alone_at

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator
    from pathlib import Path

_APPLICATION = 0x72656C74  # "relt": what the head of an SQLite file says of whose it is
#: SQLite's MAX_PATHNAME is 512, with a zero at the end, and the names of its write-ahead log are longer by 8.
_LONGEST = 503
_BEGINNING = (
    "BEGIN IMMEDIATE",  # one transaction, so that there is never a file that does not say whose it is
    f"PRAGMA application_id = {_APPLICATION}",
    "CREATE TABLE IF NOT EXISTS runs (settings TEXT)",
    "CREATE TABLE IF NOT EXISTS taken (place BLOB UNIQUE)",
    "CREATE TABLE IF NOT EXISTS rows (output BLOB UNIQUE, outcome TEXT)",
    "COMMIT",
    "PRAGMA journal_mode = WAL",
    "PRAGMA synchronous = FULL",  # an outcome outlives a power cut
)


class Journal:
    """The outcomes of rows; opened by `writing`, or by `reading`, which makes no file."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self._base: sqlite3.Connection | None = None

    @contextmanager
    def writing(self) -> Iterator[Journal]:
        """Keep the journal to this process, which may add to it.

        Where another process has it, or a file that no run wrote is in its place, an `OutputError` is raised.
        """
        self._is_there()
        with ExitStack() as held:
            try:
                held.enter_context(alone_at(self.path, self.path.with_name(f"{self.path.name}.lock")))
            except NotImplementedError as error:
                raise self._failed(error) from error
            held.enter_context(self._opened(str(self.path)))
            for command in _BEGINNING:
                self._ask(command)
            yield self

    @contextmanager
    def reading(self) -> Iterator[Journal]:
        """Look into the journal, if there is one; refuse another file in its place."""
        if not self._is_there():
            yield self
            return
        with self._opened(f"file:{quote(str(self.path.absolute()))}?mode=ro"):
            yield self

    @property
    def settings(self) -> dict[str, Any] | None:
        """What the last run that wrote to it said of itself; None where none did."""
        found = self._ask("SELECT settings FROM runs ORDER BY rowid DESC LIMIT 1")
        if not found:
            return None
        try:
            settings = json.loads(found[0][0])
        except (ValueError, TypeError, RecursionError):
            settings = None
        if not isinstance(settings, dict):
            raise self._failed(ValueError("it does not tell the settings"))
        return settings

    def begin(self, settings: dict[str, Any]) -> None:
        """Add what a run says of itself."""
        self._ask("INSERT INTO runs VALUES (?)", json.dumps(settings))

    def take(self, place: str) -> None:
        """Note that runs of this journal write a place besides the rows', such as that of their table."""
        self._ask("INSERT OR IGNORE INTO taken VALUES (?)", _key(place))

    def owns(self, place: str) -> bool:
        """Return whether a run has taken a place."""
        return bool(self._ask("SELECT 1 FROM taken WHERE place = ?", _key(place)))

    def add(self, outcomes: Iterable[Outcome]) -> None:
        """Add outcomes; when this returns, they are on disk."""
        self._ask("BEGIN")
        for outcome in outcomes:
            held = (_key(outcome.output), json.dumps(asdict(outcome)))
            self._ask("INSERT OR REPLACE INTO rows VALUES (?, ?)", *held)
        self._ask("COMMIT")

    def find(self, output: str) -> Outcome | None:
        """Return how the row of an output ended the last time; None where nothing sensible tells it."""
        found = self._ask("SELECT outcome FROM rows WHERE output = ?", _key(output))
        return _outcome(output, found[0][0]) if found else None

    def _is_there(self) -> bool:
        """Return whether there is a journal; refuse another file, before SQLite may touch it."""
        try:
            with self.path.open("rb") as stream:
                head = stream.read(100)
        except FileNotFoundError:
            return False
        except OSError as error:
            raise self._failed(error) from error
        ours = head.startswith(b"SQLite format 3\0") and head[68:72] == _APPLICATION.to_bytes(4)
        if head and not ours:
            told = "the journal of an earlier relit" if head.startswith(b'{"run": ') else "no journal"
            raise OutputError(f"{self.path}: is {told}, and stays as it is; choose another file by --journal")
        return bool(head)

    @contextmanager
    def _opened(self, name: str) -> Iterator[None]:
        try:
            base = sqlite3.connect(name, uri=name.startswith("file:"), isolation_level=None)
        except sqlite3.Error as error:
            raise self._failed(error) from error
        base.text_factory = bytes  # what is no UTF-8 is for json to say
        with closing(base) as self._base:
            yield
        self._base = None

    def _ask(self, command: str, *given: Any) -> list[Any]:
        if self._base is None:
            return []
        try:
            return self._base.execute(command, given).fetchall()
        except sqlite3.Error as error:
            raise self._failed(error) from error

    def _failed(self, error: Exception) -> OutputError:
        reason = getattr(error, "strerror", None) or error
        if isinstance(error, sqlite3.Error) and len(os.fsencode(self.path.absolute())) > _LONGEST:
            reason = f"SQLite takes paths of {_LONGEST} bytes at most"
        code = getattr(error, "sqlite_errorcode", None)  # SQLITE_ERROR: the tables are not what they were
        if (
            isinstance(error, (OSError, NotImplementedError, sqlite3.OperationalError))
            and code != sqlite3.SQLITE_ERROR
        ):
            told = f"cannot be written ({reason}); choose another place with --journal"
        else:
            told = f"is damaged ({reason}); move it away, and use --force, which does all rows again"
        return OutputError(f"{self.path}: {told}")


def _key(output: str) -> bytes:
    return output.encode("utf-8", "surrogatepass")  # names of files need not be Unicode


def _outcome(output: str, text: Any) -> Outcome | None:
    """Return an outcome from its text; None where that is none, as after a change by hand."""
    try:
        found: dict[str, Any] = json.loads(text)
        reason, recipe = map(_word, (found["reason"], found["recipe"]))
        inputs, files = (
            tuple(File(*map(_word, entry)) for entry in found[name]) for name in ("inputs", "files")
        )
        measured = {name: float(value) for name, value in found["measured"].items()}
        not_kept = tuple(map(_word, found.get("not_kept", ())))
        return Outcome(output, reason, recipe, inputs, files, measured, not_kept)
    except (ValueError, TypeError, KeyError, AttributeError, RecursionError):
        return None


def _word(value: Any) -> Any:
    if not isinstance(value, str | None):
        raise TypeError(f"expected a text, got {value!r}")
    return value
