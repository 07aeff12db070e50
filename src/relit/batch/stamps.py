"""How to see that a file is what it was, without reading it."""

from __future__ import annotations

from hashlib import sha256
from typing import Any

from relit.batch.stores import path_of, store_of

Stamp = tuple[int, int]

#: Where stores say which version of a file they have, the surest first: fsspec leaves the names to them.
_VERSIONS = (
    "generation",  # gs://
    "md5Hash",
    "ETag",  # s3://, http://
    "etag",  # az://
    "content_md5",
    "mtime",  # sftp://, and of files
    "modificationTime",  # hdfs://
    "LastModified",
    "last_modified",
    "Last-Modified",
    "modified",
    "created",  # memory://
)


def stamp_of(place: str) -> Stamp | None:
    """Return the size of a file, and what changes whenever it does; None where that cannot be told.

    For a path, that is the time of the last change in ns; for a URL, a number made of what its store says:
    a generation, an ETag or a time.

    Examples
    --------
    >>> stamp_of("no-such-file") is None
    True
    """
    try:
        path = path_of(place)
        if path is not None:
            found = path.stat()
            return found.st_size, found.st_mtime_ns
        store, key = store_of(place)
        return _of_a_store(store.info(key))
    except Exception:  # each store has its own; whoever reads the file is told what is wrong
        return None


def _of_a_store(found: dict[str, Any]) -> Stamp | None:
    size = found.get("size")
    told = next(((name, found[name]) for name in _VERSIONS if found.get(name)), None)
    if size is None or told is None:
        return None
    return int(size), int.from_bytes(sha256(repr(told).encode()).digest()[:8])
