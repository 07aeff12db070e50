"""One run at a time in a place: a lock that ends with the process that has it, and a note of who that is."""

from __future__ import annotations

import os
import re
import socket
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING

from filelock import FileLock, Timeout

from relit.errors import OutputError
from relit.photo.atomic_files import save_atomically

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path


@contextmanager
def alone_at(place: Path | str, lock: Path, *, leaves_lock: bool = True) -> Iterator[None]:
    """Keep other runs out of a place, by a lock that the system frees when this process dies in any way.

    Nothing is told by the time of day or by whether a process of some number lives, which may be another by
    now: where the lock is free, nobody is there, whatever the note beside it says.

    Parameters
    ----------
    place : Path or str
        What messages call it.
    lock : Path
        The file that is locked. Its folder is made.
    leaves_lock : bool, optional
        Whether the file stays. Where it goes, two runs that start in the instant in which a third ends, one
        just before and one just after the file went, both find themselves alone.

    Raises
    ------
    OutputError
        If another process has the lock, which the message names; or if it cannot be made.
    NotImplementedError
        If the disk knows no locks.
    """
    note, held = lock.with_name(f"{lock.name}.by"), FileLock(lock)
    try:
        lock.parent.mkdir(parents=True, exist_ok=True)
        lock.touch()  # what cannot be made is no lock of another's
        held.acquire(timeout=0)
    except Timeout:
        raise OutputError(
            f"{place}: another run is at work here{_who(note)}; wait for it, or choose another place"
        ) from None
    except OSError as error:
        reason = error.strerror or error
        raise OutputError(f"{place}: cannot be written ({reason}); choose another place") from error
    try:
        with suppress(OutputError):  # of a full disk: it only tells
            save_atomically(note, f"{os.getpid()} {socket.gethostname()}".encode(), overwrite=True)
        yield
    finally:
        with suppress(OSError):
            note.unlink(missing_ok=True)
        held.release()
        if not leaves_lock:
            with suppress(OSError):  # of Windows, where another has it open by now
                lock.unlink(missing_ok=True)


def _who(note: Path) -> str:
    with suppress(OSError):
        if told := re.fullmatch(r"(\d{1,20}) ([\w.-]{1,255})", note.read_text("utf-8", "replace")):
            return f" (process {told[1]} on {told[2]})"
    return ""
