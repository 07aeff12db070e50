"""What rows are called in the folder of a batch: as their targets are, and no two alike.

Rows may be many, so what must be known of all of them is kept as 8 bytes each.
"""

from __future__ import annotations

import os
import unicodedata
from array import array
from functools import lru_cache
from hashlib import blake2b
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from relit._photo.codecs import FORMATS
from relit.batch import places
from relit.batch.jobs import KINDS, Job, Outcome, options_with
from relit.errors import OptionError
from relit.landmark_files import FORMATS as LANDMARK_FORMATS

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

    from numpy.typing import NDArray

    from relit.batch.jobs import Row, Rows
    from relit.options import TransferOptions

#: The folder, in that of the batch, for what is not a result.
STATE = ".relit"

_PHOTOS = {extension for known in FORMATS.values() for extension in known.extensions}
_SHOWN = 5  # clashes that a message names


class Naming:
    """Gives rows their names; goes through all of them once.

    A target below the folder that all targets have in common keeps its name below the folder of the batch,
    as far as what is written can have its suffix. Where it occurs more than once, the name of the reference
    follows. Where a name would then fit several targets, or several references, it is told in full.

    Parameters
    ----------
    rows : Rows
    kind : str
        Of `jobs.KINDS`.
    options : TransferOptions
        Those of the command.
    suffix : str or None
        Of the files to write, instead of the targets' own.

    Attributes
    ----------
    rows : int
        How many there are.

    Examples
    --------
    >>> from relit.batch.pairing import Pairs
    >>> from relit.options import TransferOptions
    >>> pairs = Pairs(["in/a.png", "in/b/a.jpg"], ["ref/x.png", "ref/y.png"])
    >>> naming = Naming(pairs, "transfer", TransferOptions())
    >>> [naming.job(row).output for row in pairs]
    ['a__x.png', 'a__y.png', 'b/a__x.jpg', 'b/a__y.jpg']
    """

    def __init__(self, rows: Rows, kind: str, options: TransferOptions, suffix: str | None = None) -> None:
        self.kind, self.options, self.suffix = kind, options, suffix
        self.rows = 0
        targets, target_names = array("Q"), array("Q")
        references, reference_names = array("Q"), array("Q")
        self._root: tuple[str, ...] | None = None
        self._reference_root: tuple[str, ...] | None = None
        for row in rows:
            self.rows += 1
            if row.problem or row.output:
                continue
            targets.append(short_digest(row.target))
            target_names.append(_name_digest(row.target, whole=True))
            self._root = _common(self._root, row.target)
            if row.reference:
                references.append(short_digest(row.reference))
                reference_names.append(_name_digest(row.reference, whole=False))
                self._reference_root = _common(self._reference_root, row.reference)
        self._repeated = repeated(targets)
        self._alike = _of_several(target_names, targets)
        self._references_alike = _of_several(reference_names, references)

    def job(self, row: Row) -> Job | Outcome:
        """Return what is to be done for a row; or how it ended, if it cannot be done."""
        if row.problem:
            return Outcome(row.number, "", "failed", row.problem)
        try:
            output = _inside(row.output or self._mirrored(row))
            options = options_with(self.options, row.options)
        except OptionError as error:
            return Outcome(row.number, "", "failed", str(error))
        reference, marks = row.reference, row.reference_landmarks
        if self.kind != "transfer":
            reference = marks = None
        return Job(row.number, row.target, reference, output, row.target_landmarks, marks, options)

    def _mirrored(self, row: Row) -> str:
        *folders, last = _parts(row.target)[len(self._root or ()) :]
        if not last:
            raise OptionError(f"target: expected a photo, got {row.target!r}")
        stem, own = _split_suffix(last)
        suffix = KINDS[self.kind].suffix if self.suffix is None else self.suffix
        if suffix is None:
            suffix = own if own.lower() in _PHOTOS else ".png"
        told = last if suffix != own and _name_digest(row.target, whole=True) in self._alike else stem
        if self.kind == "transfer" and short_digest(row.target) in self._repeated:
            told += f"__{self._light(row)}"
        return "/".join([*filter(None, folders), told + suffix])

    def _light(self, row: Row) -> str:
        if row.reference is None:
            return str(dict(row.options).get("light", self.options.light))
        parts = _parts(row.reference)
        if _name_digest(row.reference, whole=False) in self._references_alike:
            return "-".join(parts[len(self._reference_root or ()) :])
        return _split_suffix(parts[-1])[0]


def check_suffix(kind: str, suffix: str) -> None:
    """Refuse a suffix of files that no row of a kind can write.

    Raises
    ------
    OptionError

    Examples
    --------
    >>> check_suffix("landmarks", ".pts")
    """
    known = {} if KINDS[kind].parts else LANDMARK_FORMATS if kind == "landmarks" else _PHOTOS
    if suffix.lower() not in known:
        told = f"expected one of {', '.join(sorted(known))}" if known else f"expected none with {kind}"
        raise OptionError(f"format: {told}, got {suffix!r}")


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


def short_digest(text: str) -> int:
    """Return 8 bytes that stand for a text."""
    return int.from_bytes(blake2b(text.encode("utf-8", "surrogatepass"), digest_size=8).digest())


class Digests:
    """A set of 8-byte digests that takes no more than these."""

    def __init__(self, values: NDArray[np.uint64]) -> None:
        self.values = values  # sorted

    def __contains__(self, digest: int) -> bool:
        """Return whether it is one of them."""
        at = int(np.searchsorted(self.values, np.uint64(digest)))
        return at < len(self.values) and int(self.values[at]) == digest


def repeated(digests: array[int]) -> Digests:
    """Return those that occur more than once.

    Examples
    --------
    >>> 3 in repeated(array("Q", [3, 1, 3])), 1 in repeated(array("Q", [3, 1, 3]))
    (True, False)
    """
    values, counts = np.unique(np.frombuffer(digests, np.uint64), return_counts=True)
    return Digests(values[counts > 1])


def _of_several(names: array[int], things: array[int]) -> Digests:
    """Return the names that belong to more than one thing."""
    pairs = np.stack([np.frombuffer(names, np.uint64), np.frombuffer(things, np.uint64)], axis=1)
    values, counts = np.unique(np.unique(pairs, axis=0)[:, 0], return_counts=True)
    return Digests(values[counts > 1])


def _name_digest(place: str, *, whole: bool) -> int:
    """Return the digest of a place without its suffix: of its whole path, or of its last part."""
    *folders, name = _parts(place)
    stem = _split_suffix(name)[0]
    return short_digest("/".join([*folders, stem]) if whole else stem)


def _split_suffix(name: str) -> tuple[str, str]:
    """Return a name before its suffix, and that; pathlib is too slow for millions of names."""
    at = name.rfind(".")
    return (name[:at], name[at:]) if at > 0 else (name, "")


def _parts(place: str) -> tuple[str, ...]:
    """Return the folders of a place, from the root, and its name."""
    if "://" in place:
        scheme, _, rest = place.partition("://")
        return (scheme, *(part for part in rest.split("/") if part not in ("", ".", "..")))
    folder, name = os.path.split(place)
    return (*_folder_parts(folder, _from(folder)), "" if name in (".", "..") else name)


def _from(folder: str) -> str:
    """Return where a folder counts from: caches must know."""
    return "" if folder.startswith(os.sep) else os.getcwd()  # noqa: PTH109 (pathlib is too slow)


@lru_cache(maxsize=4096)
def _folder_parts(folder: str, _: str) -> tuple[str, ...]:
    path = Path(os.path.abspath(folder))  # noqa: PTH100 (pathlib has nothing that leaves links as they are)
    return (path.drive.strip(":\\/"), *path.parts[1:])


def _common(root: tuple[str, ...] | None, place: str) -> tuple[str, ...]:
    """Return the folders that a place has in common with a root."""
    folders = _parts(place)[:-1]
    if root is None or folders[: len(root)] == root:
        return folders if root is None else root
    alike = [one == other for one, other in zip(root, folders, strict=False)]
    return root[: alike.index(False) if False in alike else len(alike)]


def _inside(output: str) -> str:
    """Return an output as rows have it, with ``/`` between folders, if it stays in the folder."""
    parts = [part for part in output.replace(os.sep, "/").split("/") if part not in ("", ".")]
    outside = output.startswith(("/", os.sep)) or os.path.splitdrive(output)[0] or "://" in output
    if outside or ".." in parts:
        raise OptionError(f"output: expected a path below the folder of the batch, got {output!r}")
    if not parts or parts[0].casefold() == STATE:
        raise OptionError(f"output: expected the name of a file, got {output!r}")
    return "/".join(parts)


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
        place = f"{_real(folder, _from(folder))}/{name}"
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
