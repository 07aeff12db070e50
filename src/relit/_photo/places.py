"""Where photos come from and go to: files by name, the standard streams as "-", open binary files."""

from __future__ import annotations

import io
import sys
from pathlib import Path
from typing import BinaryIO, TextIO

from relit.errors import ImageError, OutputError
from relit.files import save_atomically

Place = str | Path | BinaryIO


def name_of(place: Place) -> str:
    """Return what to call a place in a message."""
    return str(place) if isinstance(place, (str, Path)) else str(getattr(place, "name", "binary file"))


def place_of(destination: Place) -> Path | BinaryIO:
    """Return where to write: a path, or a binary file."""
    if isinstance(destination, (str, Path)):
        return _standard(sys.stdout, destination) if str(destination) == "-" else Path(destination)
    return destination


def _standard(stream: TextIO | None, place: str | Path) -> BinaryIO:
    if stream is None:  # closed before Python started
        raise OutputError(f"{place}: this standard stream is closed; give the name of a file")
    return stream.buffer


def open_source(source: Place) -> BinaryIO:
    """Open a file by name, or take what a stream still holds; codecs can seek in the result.

    Raises
    ------
    ImageError
        If it cannot be opened or read.
    """
    name = name_of(source)
    try:
        if not isinstance(source, (str, Path)):
            return io.BytesIO(source.read())
        if name == "-":
            return io.BytesIO(_standard(sys.stdin, source).read())
        stream = Path(source).open("rb")  # noqa: SIM115 (the caller closes it)
        if stream.seekable():
            return stream
        with stream:
            return io.BytesIO(stream.read())
    except FileNotFoundError:
        raise ImageError(f"{name}: there is no such file; check the name") from None
    except IsADirectoryError:
        raise ImageError(f"{name}: is a folder; give the name of one photo in it") from None
    except (OSError, ValueError, TypeError) as error:
        # ValueError: a NUL in the name, or a closed file; TypeError: a text file
        reason = getattr(error, "strerror", None) or error
        raise ImageError(f"{name}: cannot be read ({reason}); give the file name of a photo") from error


def put(data: bytes, destination: Place, *, overwrite: bool) -> None:
    """Write bytes to a file, which appears whole or not at all, or to a stream.

    Raises
    ------
    OutputError
        If that cannot be done.
    """
    place = place_of(destination)
    if isinstance(place, Path):
        save_atomically(place, data, overwrite=overwrite)
        return
    try:
        place.write(data)
        place.flush()
    except (OSError, ValueError, TypeError) as error:  # ValueError: a closed file; TypeError: a text file
        raise OutputError(
            f"{name_of(destination)}: cannot be written ({error}); give a binary file"
        ) from error
