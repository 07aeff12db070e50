"""What rows are called in the folder of a batch: as their targets are, and no two alike."""

from __future__ import annotations

import os
import sqlite3
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any
from weakref import finalize

from relit.batch.clashes import RECENT, counted_from
from relit.batch.jobs import KINDS, Job, options_with
from relit.batch.portable import folded, marked, portable
from relit.errors import OptionError
from relit.face.landmark_files import FORMATS as LANDMARK_FORMATS
from relit.inputs import check_one_light
from relit.photo.codecs.formats import FORMATS
from relit.result_files import LAYERED

if TYPE_CHECKING:
    from relit.batch.jobs import Row, Rows
    from relit.settings.options import TransferOptions

#: The folder, in that of the batch, for what is not a result.
STATE = ".relit"

_IS_WINDOWS = os.name == "nt"
_PHOTOS = {extension for known in FORMATS.values() for extension in known.extensions}
_TABLE = """CREATE TABLE {0} (
    stem BLOB, whole BLOB, place BLOB, times INT, PRIMARY KEY (stem, whole, place)
) WITHOUT ROWID"""
_COUNT = "INSERT INTO {0} VALUES (?, ?, ?, 1) ON CONFLICT DO UPDATE SET times = times + 1"
_TIMES = "SELECT times FROM {0} WHERE stem = ? AND whole = ? AND place = ?"
_SAME_STEM = "SELECT 1 FROM {0} WHERE stem = ?1 AND place <> ?3 LIMIT 1"
_SAME_WHOLE = "SELECT place FROM {0} WHERE stem = ?1 AND whole = ?2 AND place <> ?3 LIMIT 9"


class Naming:
    """Gives rows their names; goes through all of them once, and keeps on disk what must be known of all.

    A target below the folder that all targets have in common keeps its name below the folder of the batch,
    as far as what is written can have its suffix. Where it occurs more than once, the name of the reference
    follows. Where a name would then fit several targets, or several references, it is told in full; and where
    they differ by what some system does not tell apart, upper and lower case or how an accent is spelled, a
    digest follows. Names that some system cannot hold are replaced, as `portable` has it. One in the column
    output stays as it is given.

    The options are those of the command; the suffix, that of the files to write instead of the targets' own.

    Examples
    --------
    >>> from relit.batch.pairing import Pairs
    >>> from relit.settings.options import TransferOptions
    >>> pairs = Pairs(["in/a.png", "in/b/a.jpg"], ["ref/x.png", "ref/y.png"])
    >>> naming = Naming(pairs, "transfer", TransferOptions())
    >>> [naming.job(row).output for row in pairs]
    ['a__x.png', 'a__y.png', 'b/a__x.jpg', 'b/a__y.jpg']
    """

    def __init__(self, rows: Rows, kind: str, options: TransferOptions, suffix: str | None = None) -> None:
        self.kind, self.options, self.suffix = kind, options, suffix
        self.rows = 0  # how many there are
        self.renamed = 0  # how many jobs were given the name of a target that some system could not hold
        self._known = sqlite3.connect("", isolation_level=None)  # a temporary file of its own
        finalize(self, self._known.close)
        self._root: tuple[str, ...] | None = None
        self._reference_root: tuple[str, ...] | None = None
        for table in ("targets", "lights"):
            self._known.execute(_TABLE.format(table))
        self._known.execute("BEGIN")
        noted = set[str]()  # references come again and again
        for row in rows:
            self.rows += 1
            if row.problem or row.output:
                continue
            self._ask(_COUNT, "targets", row.target)
            self._root = _common(self._root, row.target)
            if row.reference and row.reference not in noted:
                noted = noted if len(noted) < RECENT else set()
                noted.add(row.reference)
                self._ask(_COUNT, "lights", row.reference)
                self._reference_root = _common(self._reference_root, row.reference)
        self._known.execute("COMMIT")

    def job(self, row: Row) -> Job | str:
        """Return what is to be done for a row; or why it cannot be done."""
        if row.problem:
            return row.problem
        try:
            output = _inside(row.output or self._mirrored(row))
            options = options_with(self.options, row.options)
            if self.kind == "transfer":
                check_one_light(row.reference is not None, options)
                if options.record.needs_second:
                    raise OptionError(
                        f"method: {options.method!r} takes a second reference, for which a batch has no "
                        "place; choose another"
                    )
        except OptionError as error:
            return str(error)
        reference, marks = row.reference, row.reference_landmarks
        if self.kind != "transfer":
            reference = marks = None
        return Job(row.target, reference, output, row.target_landmarks, marks, options)

    def _mirrored(self, row: Row) -> str:
        *folders, last = _parts(row.target)[len(self._root or ()) :]
        if not last:
            raise OptionError(f"target: expected a photo, got {row.target!r}")
        stem, own = _split_suffix(last)
        suffix = KINDS[self.kind].suffix if self.suffix is None else self.suffix
        if suffix is None:
            suffix = own if own.lower() in _PHOTOS else ".png"
        is_alike = self._is_alike("targets", row.target)
        in_full = suffix != own and not is_alike and self._ask(_SAME_STEM, "targets", row.target)
        told = last if in_full else stem
        if self.kind == "transfer" and self._ask(_TIMES, "targets", row.target)[0][0] > 1:
            told += f"__{self._light(row)}"
        wanted = [*filter(None, folders), told + suffix]
        end = marked(wanted[-1], "/".join([*folders, last])) if is_alike else wanted[-1]
        safe = [portable(name) for name in (*wanted[:-1], end)]
        self.renamed += safe != wanted
        return "/".join(safe)

    def _light(self, row: Row) -> str:
        if row.reference is None:
            return str(dict(row.options).get("light", self.options.light))
        parts = _parts(row.reference)
        if not self._ask(_SAME_STEM, "lights", row.reference):
            return _split_suffix(parts[-1])[0]
        told = "-".join(below := parts[len(self._reference_root or ()) :])
        return marked(told, "/".join(below)) if self._is_alike("lights", row.reference) else told

    def _is_alike(self, table: str, place: str) -> bool:
        """Return whether some system takes another place for this one, though it is written otherwise."""
        others = self._ask(_SAME_WHOLE, table, place)
        return any(_parts(other.decode("utf-8", "surrogatepass")) != _parts(place) for (other,) in others)

    def _ask(self, command: str, table: str, place: str) -> list[Any]:
        given = _keys_from(table, place, counted_from(place))
        return self._known.execute(command.format(table), given).fetchall()


def suffixes_of(kind: str) -> list[str]:
    """Return the suffixes that files of a kind can have; none where nobody may choose."""
    layered = LAYERED if kind == "transfer" else ()
    return (
        [] if KINDS[kind].parts else sorted(LANDMARK_FORMATS if kind == "landmarks" else {*_PHOTOS, *layered})
    )


@lru_cache(maxsize=4096)
def _keys_from(table: str, place: str, cwd: str) -> tuple[bytes, bytes, bytes]:
    """Return what a place goes by: targets by their folders and stem, references by their stem alone."""
    *folders, name = _parts_from(place, cwd)
    stem = [*(folders if table == "targets" else ()), _split_suffix(name)[0]]
    return _blob(folded("/".join(stem))), _blob(folded("/".join([*folders, name]))), _blob(place)


def _blob(text: str) -> bytes:
    return text.encode("utf-8", "surrogatepass")  # names of files need not be Unicode


def _split_suffix(name: str) -> tuple[str, str]:
    """Return a name before its suffix, and that; pathlib is too slow for millions of names."""
    at = name.rfind(".")
    return (name[:at], name[at:]) if at > 0 else (name, "")


def _parts(place: str) -> tuple[str, ...]:
    """Return the folders of a place, from the root, and its name."""
    return _parts_from(place, counted_from(place))


@lru_cache(maxsize=4096)
def _parts_from(place: str, cwd: str) -> tuple[str, ...]:
    if "://" in place:
        scheme, _, rest = place.partition("://")
        return (scheme, *(part for part in rest.split("/") if part not in ("", ".", "..")))
    folder, name = os.path.split(place)
    return (*_folder_parts(folder, cwd), "" if name in (".", "..") else name)


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
    if _IS_WINDOWS and (safe := [portable(part) for part in parts]) != parts:
        raise OptionError(
            f"output: Windows cannot hold {output!r}; choose another, such as {'/'.join(safe)!r}"
        )
    return "/".join(parts)
