"""Put bytes into a file all at once, or not at all."""

from __future__ import annotations

import io
import os
import secrets
from contextlib import contextmanager
from typing import TYPE_CHECKING

from relit.errors import OutputError

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path


class NamedBytes(io.BytesIO):
    """A file in memory that has a name, which tells its format."""

    def __init__(self, name: str, data: bytes = b"") -> None:
        super().__init__(data)
        self.name = name


def save_atomically(path: Path, data: bytes, *, overwrite: bool = False) -> None:
    """Write `data` to `path`: whoever looks there finds the old state or the whole new file.

    Parameters
    ----------
    path : Path
        Where to write. A symbolic link that may be overwritten is followed, and stays.
    data : bytes
    overwrite : bool, optional
        Whether a file that exists may be replaced.

    Raises
    ------
    OutputError
        As `check_free` does, or if `path` cannot be written. Nothing is left behind then.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     save_atomically(Path(folder, "note.txt"), b"light")
    ...     Path(folder, "note.txt").read_bytes()
    b'light'
    """
    check_free(path, overwrite=True)
    with _as_output_errors(path):
        _save(path.resolve() if overwrite else path, data, overwrite)


def put_in_place(made: Path, path: Path, *, overwrite: bool = False) -> None:
    """Give a file that is whole, and lies on the same disk, the name by which it is to be found.

    Parameters
    ----------
    made : Path
        A file, which has no other name afterwards.
    path : Path
        Its name. A symbolic link that may be overwritten is followed, and stays.
    overwrite : bool, optional
        Whether a file that exists may be replaced.

    Raises
    ------
    OutputError
        As `save_atomically`. The file keeps its name then.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     made = Path(folder, "made")
    ...     _ = made.write_bytes(b"light")
    ...     put_in_place(made, Path(folder, "film.mp4"))
    ...     [path.name for path in Path(folder).iterdir()]
    ['film.mp4']
    """
    check_free(path, overwrite=True)
    with _as_output_errors(path):
        _name(made, path.resolve() if overwrite else path, overwrite)
        made.unlink(missing_ok=True)


def check_free(path: Path, *, overwrite: bool = False) -> None:
    """Refuse a path that `save_atomically` would refuse, before any work goes into the data.

    Raises
    ------
    OutputError
        If the folder does not exist, or `path` exists and may not be replaced or is something other than a
        file.
    """
    with _as_output_errors(path):
        if not path.parent.is_dir():
            raise OutputError(f"{path}: there is no folder {path.parent}; create it, or choose another")
        if path.exists() and not path.is_file():
            raise OutputError(f"{path}: is not a file, so it cannot be replaced; give the name of a file")
        if path.exists() and not overwrite:
            raise FileExistsError


@contextmanager
def _as_output_errors(path: Path) -> Iterator[None]:
    """Raise what goes wrong with a path as an `OutputError`."""
    try:
        yield
    except OutputError:
        raise
    except FileExistsError:
        raise OutputError(
            f"{path}: exists already; use --force or overwrite=True to replace it, or choose another name"
        ) from None
    except (OSError, ValueError, RuntimeError) as error:  # a NUL in the name; links in a circle
        reason = getattr(error, "strerror", None) or error
        raise OutputError(f"{path}: cannot be written ({reason}); choose another place or name") from error


def _save(path: Path, data: bytes, overwrite: bool) -> None:
    # In the same folder, because a rename is atomic only within one filesystem. Unlike tempfile's, this file
    # gets the permissions that the umask gives to any new file.
    temporary = path.with_name(f".relit-{secrets.token_hex(8)}.tmp")
    try:
        with temporary.open("xb") as stream:
            stream.write(data)
            stream.flush()
            os.fsync(stream.fileno())
        _name(temporary, path, overwrite)
    finally:
        temporary.unlink(missing_ok=True)


def _name(made: Path, path: Path, overwrite: bool) -> None:
    if overwrite:
        made.replace(path)
    else:
        _claim(path, made)


def _claim(path: Path, temporary: Path) -> None:
    """Give the file its name unless something has that name, also when it appeared a moment ago."""
    try:
        path.hardlink_to(temporary)
    except FileExistsError:
        raise
    except OSError:  # FAT and some network shares have no hard links: take the name first, then fill it
        path.touch(exist_ok=False)
        try:
            temporary.replace(path)
        except BaseException:
            path.unlink(missing_ok=True)
            raise
