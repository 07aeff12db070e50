"""Which rows of a batch would get into one another's way, before anything is written."""

from __future__ import annotations

import os
import unicodedata
from array import array
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from relit.batch import places
from relit.batch.digests import repeated, short_digest
from relit.batch.jobs import Outcome
from relit.errors import OptionError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

    from relit.batch.jobs import Job

_SHOWN = 5  # clashes that a message names


def check_names(
    jobs: Callable[[], Iterator[Job | Outcome]], kind: str, folder: str, reserved: Iterable[str]
) -> None:
    """Refuse a batch that would write a file twice, write over what it reads, or a file for a folder.

    Upper and lower case, and the ways in which Unicode can spell a letter, count as one: some file systems
    do not tell them apart.

    Parameters
    ----------
    jobs : callable
        Returns the jobs, each time from the start.
    kind : str
    folder : str
        Of the batch.
    reserved : iterable of str
        Places that the batch itself writes.

    Raises
    ------
    OptionError
        It names the rows.
    """
    written, folders = array("Q"), set[int]()
    read = {short_digest(_key_of(place)) for place in reserved}
    given = array("Q")
    for job in jobs():
        if isinstance(job, Outcome):
            continue
        given.extend(short_digest(_key_of(place)) for place in job.inputs)
        for file in job.files(kind):
            key = _key_of(places.join(folder, file))
            written.append(short_digest(key))
            folders.update(_folders_of(key.rpartition("/")[0]))
    known = np.frombuffer(written, np.uint64)
    suspects = {*map(int, repeated(written).values)}
    suspects |= {*map(int, np.intersect1d(known, np.frombuffer(given, np.uint64)))}
    suspects |= {*map(int, np.intersect1d(known, np.array([*read, *folders], np.uint64)))}
    if suspects:
        _tell(jobs, kind, folder, reserved, suspects)


def _tell(
    jobs: Callable[[], Iterator[Job | Outcome]],
    kind: str,
    folder: str,
    reserved: Iterable[str],
    suspects: set[int],
) -> None:
    """Say which rows clash, of those whose digests do: digests of different names may be alike."""
    users: dict[str, list[str]] = {}
    names: dict[str, str] = {}
    for place in reserved:
        users.setdefault(_key_of(place), []).append("the run itself writes it")
    for job in jobs():
        if isinstance(job, Outcome):
            continue
        for place in {*job.inputs}:
            if short_digest(key := _key_of(place)) in suspects:
                users.setdefault(key, []).append(f"row {job.number} reads it")
        for file in job.files(kind):
            key = _key_of(places.join(folder, file))
            if short_digest(key) in suspects:
                names[key] = file
                users.setdefault(key, []).append(f"row {job.number} writes it")
            for parent in _ancestors(key.rpartition("/")[0]):
                if short_digest(parent) in suspects:
                    users.setdefault(parent, []).append(f"row {job.number} writes below it")
    told = [
        f"{name}: {' and '.join(sorted({*users[key]}, key=users[key].index)[:3])}"
        for key, name in names.items()
        if len(users[key]) > 1
    ]
    if told:
        more = f"; and {len(told) - _SHOWN} more" if len(told) > _SHOWN else ""
        raise OptionError(
            f"outputs: {'; '.join(told[:_SHOWN])}{more}; choose other names in the column output, or another "
            "folder"
        )


def is_below(place: str, folder: str) -> bool:
    """Return whether a place is in a folder, however deep.

    Examples
    --------
    >>> is_below("out/a/b.png", "out"), is_below("outer/b.png", "out")
    (True, False)
    """
    return _key_of(place).startswith(f"{_key_of(places.join(folder, 'x'))[:-1]}")


def _key_of(place: str) -> str:
    """Return a place such that no file system has two files of one key."""
    if "://" not in place:
        folder, name = os.path.split(place)
        place = f"{_real(folder, counted_from(folder))}/{name}"
    return unicodedata.normalize("NFC", unicodedata.normalize("NFC", place).casefold())


@lru_cache(maxsize=4096)
def _real(folder: str, _: str) -> str:
    return os.path.realpath(folder).replace(os.sep, "/").rstrip("/")


@lru_cache(maxsize=4096)
def _folders_of(key: str) -> tuple[int, ...]:
    return tuple(map(short_digest, _ancestors(key)))


def _ancestors(key: str) -> Iterator[str]:
    while key:
        yield key
        key = key.rpartition("/")[0]


def counted_from(folder: str) -> str:
    """Return where a folder counts from: caches must know."""
    return "" if folder.startswith(os.sep) else os.getcwd()  # noqa: PTH109 (pathlib is too slow)
