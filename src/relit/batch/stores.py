"""What `relit.batch.places` stands on: paths and fsspec's stores, each asked in its own way."""

from __future__ import annotations

import os
import re
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

from relit.errors import OptionError

if TYPE_CHECKING:
    from collections.abc import Iterator

_LOCAL = "file://"


def masked(text: str) -> str:
    """Return a text without the passwords, keys and signatures that URLs in it may hold.

    Examples
    --------
    >>> masked("sftp://ann:secret@host/1.png"), masked("https://host/1.png?signature=secret")
    ('sftp://***@host/1.png', 'https://host/1.png?***')
    """
    text = re.sub(r"(://)[^/\s]*@", r"\1***@", text)
    return re.sub(r"(://[^\s?'\"]*\?)[^\s'\"]*", r"\1***", text)


def reason(error: BaseException) -> str:
    """Return what an exception says, without secrets."""
    return masked(str(getattr(error, "strerror", None) or error or type(error).__name__))


def path_of(place: str) -> Path | None:
    """Return the path of a place on this machine, None for one elsewhere."""
    if "://" in place and not place.startswith(_LOCAL):
        return None
    return Path(place.removeprefix(_LOCAL))


def kind_of(place: str) -> str:
    """Return what is before ``://``."""
    return place.partition("://")[0].lower() if "://" in place else "file"


def store_of(place: str) -> tuple[Any, str]:
    """Return the file system that a URL is of, and the name of the file in it."""
    try:
        fsspec = import_module("fsspec")
    except ImportError:
        raise OptionError(f"{masked(place)}: URLs need an extra: pip install 'relit[cluster]'") from None
    try:
        store, key = fsspec.core.url_to_fs(place)
    except (ImportError, ValueError) as error:
        raise OptionError(
            f"{masked(place)}: {reason(error)}; install what it needs, or check what is before ://"
        ) from None
    store.invalidate_cache()  # other processes write there too
    return store, key


def is_file(place: str) -> bool:
    """Return whether a file is there."""
    path = path_of(place)
    if path is not None:
        return path.is_file()
    store, key = store_of(place)
    return bool(store.isfile(key))


def is_folder(place: str) -> bool:
    """Return whether a folder is there."""
    path = path_of(place)
    if path is not None:
        return path.is_dir()
    store, key = store_of(place)
    return bool(store.isdir(key))


def below(root: str, deepest: int | None) -> Iterator[str]:
    """Find the files below a folder, as names from there."""
    path = path_of(root)
    if path is not None:
        yield from _walk(path, deepest)
        return
    store, key = store_of(root)
    for name in store.find(key, maxdepth=deepest):
        if relative := name.removeprefix(key).lstrip("/"):  # a file is found below itself
            yield relative


def _walk(folder: Path, deepest: int | None) -> Iterator[str]:
    with os.scandir(folder) as entries:
        for entry in entries:
            if entry.is_file():
                yield entry.name
            elif deepest != 1 and entry.is_dir(follow_symlinks=False) and not entry.name.startswith("."):
                for name in _walk(Path(entry), deepest and deepest - 1):
                    yield f"{entry.name}/{name}"
