"""Where files are: paths of this machine, and URLs that fsspec knows, such as ``s3://``, under one roof.

A place is a string: a URL if it has ``://`` in it, else a path; ``file://`` and what follows is a path too,
taken as it stands. ``http://`` and ``https://`` are only read from, one file at a time. What is in
``memory://`` is known to the process alone that put it there, so no worker of an engine finds it.
"""

from __future__ import annotations

import os
import re
import secrets
from contextlib import contextmanager
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING, Any

import fsspec
from fsspec.implementations.local import LocalFileSystem

from relit.batch.long_paths import extended
from relit.errors import ImageError, OptionError, OutputError, RelitError
from relit.photo import patterns
from relit.photo.atomic_files import save_atomically

if TYPE_CHECKING:
    from collections.abc import Iterator

_READ_ONLY = ("http", "https")

#: Where stores say which version of a file they have, the surest first: for gs, s3, http, az, sftp ...
_VERSIONS = (
    *("generation", "md5Hash", "ETag", "etag", "content_md5", "mtime", "modificationTime"),
    *("LastModified", "last_modified", "Last-Modified", "modified", "created"),
)


def masked(text: str) -> str:
    """Return a text without the passwords, keys and signatures that URLs in it may hold."""
    text = re.sub(r"(://)[^/\s]*@", r"\1***@", text)
    return re.sub(r"(://[^\s?'\"]*\?)[^\s'\"]*", r"\1***", text)


def path_of(place: str) -> Path | None:
    """Return the path of a place on this machine, None for one elsewhere."""
    if "://" in place and not place.startswith("file://"):
        return None
    path = place.removeprefix("file://")
    return Path(extended(os.path.abspath(path)) if os.name == "nt" else path)  # noqa: PTH100 (no links followed)


def join(root: str, relative: str) -> str:
    """Return the place that is so far below another."""
    return f"{root}{relative}" if not root or root.endswith("/") else f"{root}/{relative}"


@contextmanager
def _telling(place: str, what: str, hint: str, kind: type[RelitError]) -> Iterator[None]:
    """Turn whatever is raised into one of ours: each store has its own."""
    try:
        yield
    except RelitError:
        raise
    except Exception as error:
        reason = masked(str(getattr(error, "strerror", None) or error or type(error).__name__))
        raise kind(f"{masked(place)}: cannot be {what} ({reason}); {hint}") from None


def read_bytes(place: str) -> bytes:
    """Return what is in a file, or raise an `ImageError`; an `OptionError` where nobody knows such URLs."""
    with _telling(place, "read", "check the name", ImageError):
        try:
            if (path := path_of(place)) is not None:
                return path.read_bytes()
            store, key = _store_of(place)
            return bytes(store.cat_file(key))
        except FileNotFoundError:
            hint = "; what is in memory is known to its own process alone" if _is_of(place, "memory") else ""
            raise ImageError(f"{masked(place)}: there is no such file; check the name{hint}") from None
        except IsADirectoryError:
            raise ImageError(f"{masked(place)}: is a folder; give the name of one file in it") from None


def write_atomically(place: str, data: bytes, *, overwrite: bool) -> None:
    """Put bytes into a file, which appears whole or not at all; folders are made as needed.

    On this machine by `save_atomically`. Where a store can rename a file, as ``sftp://`` and ``hdfs://`` can,
    it is written under another name first, and to replace a file means to remove the old one just before.
    Object stores such as ``s3://`` and ``gs://`` cannot, and need not: what is put there appears when it is
    complete. Of two who write one new file at a time, the last may win in a store. What cannot be written, or
    exists and may not be replaced, raises an `OutputError`.
    """
    with _telling(place, "written", "choose another place", OutputError):
        path = path_of(place)
        if path is not None:
            path.parent.mkdir(parents=True, exist_ok=True)
            save_atomically(path, data, overwrite=overwrite)
        elif _is_of(place, *_READ_ONLY):
            kind = place.partition("://")[0]
            raise OutputError(
                f"{masked(place)}: {kind} can only be read from; write to a path, or to a store such as s3://"
            )
        else:
            _put(place, data, overwrite)


def _put(place: str, data: bytes, overwrite: bool) -> None:
    store, key = _store_of(place)
    there = store.exists(key)
    if there and not overwrite:
        raise OutputError(
            f"{masked(place)}: exists already; use --force or overwrite=True to replace it, or choose "
            "another name"
        )
    if type(store).mv is fsspec.AbstractFileSystem.mv:  # it copies, so it is no renaming
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
    """Return whether there is a file or folder, or raise an `ImageError` where that cannot be found out."""
    with _telling(place, "reached", "check the name", ImageError):
        path = path_of(place)
        if path is not None:
            return path.exists()
        store, key = _store_of(place)
        return bool(store.exists(key))


def version_of(place: str) -> str | None:
    """Return what changes whenever a file does; None where that cannot be told.

    For a path, that is its size and two times in ns: that of its content, which copying tools set to what it
    was elsewhere, and that of its entry, which nobody can set. They are compared for being the same, not for
    which is later, so no clock has to be right. For a URL, it is the size and a digest of what its store
    says: a generation, an ETag or a time.
    """
    path = path_of(place)
    try:
        if path is not None:
            found = path.stat()
            return f"{found.st_size} {found.st_mtime_ns} {found.st_ctime_ns}"
        store, key = _store_of(place)
        info = store.info(key)
        told = next((name, info[name]) for name in _VERSIONS if info.get(name))
        return f"{info['size']} {sha256(repr(told).encode()).hexdigest()[:16]}"
    except Exception:  # each store has its own; whoever reads the file is told what is wrong
        return None


def expand(pattern: str) -> list[str]:
    """Return the files that a pattern means, as `patterns.expand` has it; there is at least one.

    Where it means none, or a folder cannot be listed, an `OptionError` is raised. An ``http`` address is no
    pattern, since ``?`` means something else there.
    """
    if _is_of(pattern, *_READ_ONLY):
        return [pattern]
    with _telling(pattern, "listed", "check the name and its permissions", OptionError):
        found = patterns.expand(
            pattern.replace(os.sep, "/"),
            is_file=lambda place: _ask(place, "isfile"),
            is_folder=lambda place: _ask(place, "isdir"),
            below=_below,
        )
    if not found:
        raise OptionError(
            f"{masked(pattern)}: means no file; expected the name of one, a folder with photos, or a pattern "
            "such as photos/**/*.jpg"
        )
    return found


def _ask(place: str, what: str) -> bool:
    store, key = _store_of(place)
    return bool(getattr(store, what)(key))


def _below(root: str, deepest: int | None) -> Iterator[str]:
    path = path_of(root)
    if path is not None:
        try:  # fsspec would follow links, and leave out errors
            yield from patterns.files_below(str(path), deepest)
        except PermissionError as error:
            with _telling(error.filename, "listed", "check its permissions", OptionError):
                raise
        return
    store, key = _store_of(root)
    for name in store.find(key, maxdepth=deepest):
        if relative := name.removeprefix(key).lstrip("/"):  # a file is found below itself
            yield relative


def _store_of(place: str) -> tuple[Any, str]:
    """Return the file system that a place is of, and the name of the file in it."""
    path = path_of(place)
    if path is not None:
        return LocalFileSystem(), str(path.absolute())
    try:
        store, key = fsspec.core.url_to_fs(place)
    except (ImportError, ValueError) as error:
        told = f"{masked(place)}: {masked(str(error))}; install what it needs, or check what is before ://"
        raise OptionError(told) from None
    store.invalidate_cache()  # other processes write there too
    return store, key


def _is_of(place: str, *kinds: str) -> bool:
    """Return whether one of the kinds is before ``://``."""
    return place.lower().startswith(tuple(f"{kind}://" for kind in kinds))
