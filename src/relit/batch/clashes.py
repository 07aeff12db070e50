"""Which rows of a batch would get into one another's way, before anything is written."""

from __future__ import annotations

import os
import sqlite3
from contextlib import closing
from functools import lru_cache
from typing import TYPE_CHECKING

from relit.batch import places
from relit.batch.portable import folded
from relit.errors import OptionError

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from relit.batch.jobs import Job, Row

RECENT = 1000  # places that are not looked at again when they come again
_SHOWN = 5  # clashes that a message names


def check_names(
    jobs: Iterable[tuple[Row, Job | str]], kind: str, folder: str, reserved: Iterable[str]
) -> None:
    """Refuse a batch that would write a file twice, write over what it reads, or a file for a folder.

    Upper and lower case, and the ways in which Unicode can spell a letter, count as one: some file systems
    do not tell them apart. Rows may be many, so they are compared on disk.

    `folder` is that of the batch, and `reserved` are places that the batch itself writes. The `OptionError`
    names the rows.
    """
    with closing(sqlite3.connect("", isolation_level=None)) as scratch:
        scratch.execute("CREATE TABLE uses (key BLOB, how TEXT, file BLOB)")
        own = [(_key_of(place), "the run itself writes it", _bytes(place)) for place in reserved]
        scratch.execute("BEGIN")
        scratch.executemany("INSERT INTO uses VALUES (?, ?, ?)", own)
        scratch.executemany("INSERT INTO uses VALUES (?, ?, ?)", _uses(jobs, kind, folder))
        found = "FROM uses GROUP BY key HAVING count(*) > 1 AND count(file) ORDER BY min(rowid)"
        clashes = scratch.execute(f"SELECT key, max(file) {found}").fetchall()
        told = []
        for key, file in clashes[:_SHOWN]:
            asked = "SELECT DISTINCT how FROM uses WHERE key = ? ORDER BY rowid LIMIT 3"
            hows = " and ".join(how for (how,) in scratch.execute(asked, [key]))
            told.append(f"{file.decode('utf-8', 'surrogatepass')}: {hows}")
    if told:
        more = f"; and {len(clashes) - _SHOWN} more" if len(clashes) > _SHOWN else ""
        raise OptionError(
            f"outputs: {'; '.join(told)}{more}; choose other names in the column output, or another folder"
        )


def _uses(
    jobs: Iterable[tuple[Row, Job | str]], kind: str, folder: str
) -> Iterator[tuple[bytes, str, bytes | None]]:
    """Go through the keys of places that rows use, how they do, and the names of files that they write."""
    root = _key_of(places.join(folder, "x")).rpartition(b"/")[0]
    read, parents = set[str](), set[bytes]()
    for row, job in jobs:
        if isinstance(job, str):
            continue
        fresh = {*job.inputs} - read  # references come again and again
        yield from ((_key_of(place), f"row {row.number} reads it", None) for place in fresh)
        read = fresh if len(read) > RECENT else read
        read |= fresh
        above = set[bytes]()
        for file in job.files(kind):
            key = _key_of(places.join(folder, file))
            yield key, f"row {row.number} writes it", _bytes(file)
            while len(key := key.rpartition(b"/")[0]) > len(root):
                above.add(key)
        yield from ((key, f"row {row.number} writes below it", None) for key in above - parents)
        parents = above


def is_below(place: str, folder: str) -> bool:
    """Return whether a place is in a folder, however deep."""
    return _key_of(place).startswith(_key_of(places.join(folder, "x"))[:-1])


def counted_from(folder: str) -> str:
    """Return where a folder counts from: caches must know."""
    return "" if folder.startswith(os.sep) else os.getcwd()  # noqa: PTH109 (pathlib is too slow)


def _key_of(place: str) -> bytes:
    """Return a place such that no file system has two files of one key."""
    if "://" not in place:
        folder, name = os.path.split(place)
        place = f"{_real(folder, counted_from(folder))}/{name}"
    return _bytes(folded(place))


def _bytes(text: str) -> bytes:
    return text.encode("utf-8", "surrogatepass")  # names of files need not be Unicode


@lru_cache(maxsize=4096)
def _real(folder: str, _: str) -> str:
    return os.path.realpath(folder).replace(os.sep, "/").rstrip("/")
