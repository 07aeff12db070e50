"""Where files are: paths of this machine, and URLs that fsspec knows, such as ``s3://``, under one roof.

A place is a string: a URL if it has ``://`` in it, else a path; ``file://`` and what follows is a path too,
taken as it stands. ``http://`` and ``https://`` are only read from, one file at a time. What is in
``memory://`` is known to the process alone that put it there, so no worker of an engine finds it.
"""

from __future__ import annotations

import os
import re
import secrets
from fnmatch import fnmatchcase
from importlib import import_module
from pathlib import PurePosixPath
from typing import TYPE_CHECKING

from relit.batch.stores import below, is_file, is_folder, kind_of, masked, path_of, reason, store_of
from relit.errors import ImageError, OptionError, OutputError, RelitError
from relit.photo.atomic_files import save_atomically
from relit.photo.reading import PHOTO_SUFFIXES

if TYPE_CHECKING:
    from collections.abc import Iterator

_READ_ONLY = ("http", "https")
_WILD = re.compile(r"[*?[]")
_TEMPORARY = (".tmp", ".part", "~")


def read_bytes(place: str) -> bytes:
    """Return what is in a file.

    Raises
    ------
    ImageError
        If there is none, or it cannot be read.
    OptionError
        If the URL is of a kind that is not known or not installed.

    Examples
    --------
    >>> read_bytes("no-such.jpg")
    Traceback (most recent call last):
        ...
    relit.errors.ImageError: no-such.jpg: there is no such file; check the name
    """
    path = path_of(place)
    try:
        if path is not None:
            return path.read_bytes()
        store, key = store_of(place)
        return bytes(store.cat_file(key))
    except RelitError:
        raise
    except FileNotFoundError:
        hint = "; what is in memory is known to its own process alone" if kind_of(place) == "memory" else ""
        raise ImageError(f"{masked(place)}: there is no such file; check the name{hint}") from None
    except IsADirectoryError:
        raise ImageError(f"{masked(place)}: is a folder; give the name of one file in it") from None
    except Exception as error:  # each store has its own
        raise ImageError(f"{masked(place)}: cannot be read ({reason(error)}); check the name") from None


def write_atomically(place: str, data: bytes, *, overwrite: bool) -> None:
    """Put bytes into a file, which appears whole or not at all; folders are made as needed.

    On this machine by `save_atomically`. Where a store can rename a file, as ``sftp://`` and ``hdfs://`` can,
    it is written under another name first, and to replace a file means to remove the old one just before.
    Object stores such as ``s3://`` and ``gs://`` cannot, and need not: what is put there appears when it is
    complete. Of two who write one new file at a time, the last may win in a store.

    Parameters
    ----------
    place : str
    data : bytes
    overwrite : bool
        Whether a file that exists may be replaced.

    Raises
    ------
    OutputError
        If the file exists and may not be replaced, or cannot be written.
    OptionError
        If the URL is of a kind that is not known or not installed.

    Examples
    --------
    >>> write_atomically("https://example.org/face.png", b"", overwrite=False)
    Traceback (most recent call last):
        ...
    relit.errors.OutputError: https://example.org/face.png: https can only be read from; write to a path, or \
to a store such as s3://
    """
    path = path_of(place)
    try:
        if path is not None:
            path.parent.mkdir(parents=True, exist_ok=True)
            save_atomically(path, data, overwrite=overwrite)
        else:
            _put(place, data, overwrite)
    except RelitError:
        raise
    except Exception as error:  # each store has its own
        raise OutputError(
            f"{masked(place)}: cannot be written ({reason(error)}); choose another place"
        ) from None


def _put(place: str, data: bytes, overwrite: bool) -> None:
    if kind_of(place) in _READ_ONLY:
        raise OutputError(
            f"{masked(place)}: {kind_of(place)} can only be read from; write to a path, or to a store such "
            "as s3://"
        )
    store, key = store_of(place)
    there = store.exists(key)
    if there and not overwrite:
        raise OutputError(
            f"{masked(place)}: exists already; use --force or overwrite=True to replace it, or choose "
            "another name"
        )
    if type(store).mv is import_module("fsspec").AbstractFileSystem.mv:  # it copies, so it is no renaming
        store.pipe_file(key, data)
        return
    folder = key.rpartition("/")[0]
    temporary = f"{folder}/.relit-{secrets.token_hex(8)}.tmp"
    store.makedirs(folder, exist_ok=True)
    try:
        store.pipe_file(temporary, data)
        if there:
            store.rm_file(key)
        store.mv(temporary, key)
    except BaseException:
        if store.exists(temporary):
            store.rm_file(temporary)
        raise


def exists(place: str) -> bool:
    """Return whether there is a file or folder.

    Raises
    ------
    ImageError
        If that cannot be found out.
    OptionError
        If the URL is of a kind that is not known or not installed.

    Examples
    --------
    >>> exists("no-such.jpg"), exists(".")
    (False, True)
    """
    path = path_of(place)
    try:
        if path is not None:
            return path.exists()
        store, key = store_of(place)
        return bool(store.exists(key))
    except RelitError:
        raise
    except Exception as error:
        raise ImageError(f"{masked(place)}: cannot be reached ({reason(error)}); check the name") from None


def join(root: str, relative: str) -> str:
    """Return the place that is so far below another.

    Examples
    --------
    >>> join("s3://bucket/out", "ann/1.png"), join("out/", "1.png"), join("", "1.png")
    ('s3://bucket/out/ann/1.png', 'out/1.png', '1.png')
    """
    return f"{root}{relative}" if not root or root.endswith("/") else f"{root}/{relative}"


def expand(pattern: str) -> list[str]:
    """Return the files that a pattern means, sorted.

    ``*``, ``?`` and ``[...]`` stand for parts of one name, ``**`` for any folders between. A folder means all
    photos below it, told by their suffixes; the name of a file, that file. Hidden and temporary files are
    left out, and links to folders not followed. The results begin as the pattern does.

    Parameters
    ----------
    pattern : str
        Path or URL. An ``http`` address is never a pattern, since ``?`` means something else there.

    Returns
    -------
    list of str

    Raises
    ------
    OptionError
        If it means no file, or the folder cannot be listed.

    Examples
    --------
    >>> from relit.photo.samples import sample
    >>> folder = str(sample("target").parent)
    >>> [PurePosixPath(place).name for place in expand(folder + "/t*.*")]
    ['target.png']
    """
    if kind_of(pattern) in _READ_ONLY:
        return [pattern]
    try:
        found = sorted(_expand(pattern.replace(os.sep, "/")))
    except RelitError:
        raise
    except (FileNotFoundError, NotADirectoryError):
        found = []
    except Exception as error:
        where = getattr(error, "filename", None) or pattern  # of a local folder below
        raise OptionError(
            f"{masked(str(where))}: cannot be listed ({reason(error)}); check the name and its permissions"
        ) from None
    if not found:
        raise OptionError(
            f"{masked(pattern)}: means no file; expected the name of one, a folder with photos, or a pattern "
            "such as photos/**/*.jpg"
        )
    return found


def _expand(pattern: str) -> Iterator[str]:
    if is_file(pattern):
        yield pattern
        return
    root, wild = pattern, []
    if (first := _WILD.search(pattern)) and not is_folder(pattern):
        cut = pattern.rfind("/", 0, first.start()) + 1
        root, wild = pattern[:cut], pattern[cut:].split("/")
    for relative in below(root, None if "**" in wild or not wild else len(wild)):
        parts = relative.split("/")
        if any(part.startswith(".") for part in parts) or parts[-1].endswith(_TEMPORARY):
            continue
        if _fits(parts, wild) if wild else PurePosixPath(relative).suffix.lower() in PHOTO_SUFFIXES:
            yield join(root, relative)


def _fits(parts: list[str], wild: list[str]) -> bool:
    if not wild:
        return not parts
    if wild[0] == "**":
        return _fits(parts, wild[1:]) or (bool(parts) and _fits(parts[1:], wild))
    return bool(parts) and fnmatchcase(parts[0], wild[0]) and _fits(parts[1:], wild[1:])
