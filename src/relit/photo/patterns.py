"""What a pattern or a folder means: which photos, on this machine or in a store."""

from __future__ import annotations

import os
import re
from fnmatch import fnmatchcase
from pathlib import PurePosixPath
from typing import TYPE_CHECKING

from relit.photo.reading import PHOTO_SUFFIXES

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

_WILD = re.compile(r"[*?[]")
_TEMPORARY = (".tmp", ".part", "~")


def files_below(folder: str, deepest: int | None) -> Iterator[str]:
    """Find the files below a folder, as names from there; links are followed to files and not to folders.

    What cannot be told, as of a link in a circle, counts as a file: whoever reads it is told what is wrong.
    """
    with os.scandir(folder) as entries:
        for entry in entries:
            try:
                is_file = entry.is_file()
            except OSError:
                is_file = True
            if is_file:
                yield entry.name
            elif deepest != 1 and entry.is_dir(follow_symlinks=False) and not entry.name.startswith("."):
                for name in files_below(entry.path, deepest and deepest - 1):
                    yield f"{entry.name}/{name}"


def expand(
    pattern: str,
    *,
    is_file: Callable[[str], bool] = os.path.isfile,
    is_folder: Callable[[str], bool] = os.path.isdir,
    below: Callable[[str, int | None], Iterator[str]] = files_below,
) -> list[str]:
    """Return the files that a pattern means, sorted; none if there are none.

    ``*``, ``?`` and ``[...]`` stand for parts of one name, ``**`` for any folders between. A folder means all
    photos below it, told by their suffixes; the name of a file, that file. Hidden and temporary files are
    left out, and links to folders not followed. The results begin as the pattern does.

    Parameters
    ----------
    pattern : str
        With ``/`` between folders.
    is_file, is_folder, below : callable, optional
        Ask a place that is not of this machine; `below` is as `files_below`.

    Raises
    ------
    OSError
        If a folder cannot be listed.

    Examples
    --------
    >>> from relit.photo.samples import sample
    >>> folder = sample("target").parent
    >>> [PurePosixPath(name).name for name in expand(f"{folder}/t*.*")]
    ['target.png']
    """
    if is_file(pattern):
        return [pattern]
    root, wild = pattern, []
    if (first := _WILD.search(pattern)) and not is_folder(pattern):  # a name may have brackets of its own
        cut = pattern.rfind("/", 0, first.start()) + 1
        root, wild = pattern[:cut], pattern[cut:].split("/")
    try:
        names = list(below(root or ".", None if "**" in wild or not wild else len(wild)))
    except (FileNotFoundError, NotADirectoryError, ValueError):  # ValueError: a NUL in the name
        return []
    between = "" if not root or root.endswith("/") else "/"
    return sorted(f"{root}{between}{name}" for name in names if _is_meant(name, wild))


def _is_meant(name: str, wild: list[str]) -> bool:
    parts = name.split("/")
    if any(part.startswith(".") for part in parts) or name.endswith(_TEMPORARY):
        return False
    return _fits(parts, wild) if wild else PurePosixPath(name).suffix.lower() in PHOTO_SUFFIXES


def _fits(parts: list[str], wild: list[str]) -> bool:
    if not wild:
        return not parts
    if wild[0] == "**":
        return _fits(parts, wild[1:]) or (bool(parts) and _fits(parts[1:], wild))
    return bool(parts) and fnmatchcase(parts[0], wild[0]) and _fits(parts[1:], wild[1:])
