"""Where photos are read from and written to: files by name, standard streams as "-", open binary files."""

from __future__ import annotations

import io
import os
import sys
from pathlib import Path
from typing import BinaryIO, TextIO

from relit.errors import ImageError, OutputError
from relit.photo.atomic_files import save_atomically

FileOrName = str | Path | BinaryIO
_PART = 1 << 20


def name_of(file: FileOrName) -> str:
    """Return what to call a file in a message."""
    if file == "":
        return "''"
    return str(file) if isinstance(file, (str, Path)) else str(getattr(file, "name", "binary file"))


def destination_of(file: FileOrName) -> Path | BinaryIO:
    """Return where to write: a path, or a binary file."""
    if not isinstance(file, (str, Path)):
        return file
    return _standard(sys.stdout) if str(file) == "-" else Path(file)


def _standard(stream: TextIO | None) -> BinaryIO:
    if stream is None:  # closed before Python started
        raise OutputError("-: this standard stream is closed; give the name of a file")
    return stream.buffer


def open_source(source: FileOrName, most: int) -> BinaryIO:
    """Open a file by name, or take what a stream still holds; the result is seekable.

    Raises
    ------
    ImageError
        If it cannot be opened or read, or has more than `most` bytes.
    """
    name = name_of(source)
    try:
        if not isinstance(source, (str, Path)):
            return _buffered(source, name, most)
        if source == "":
            raise ImageError(f"{name}: is no name; give the file name of a photo")
        if name == "-":
            return _buffered(_standard(sys.stdin), name, most)
        stream = Path(source).open("rb")  # noqa: SIM115 (the caller closes it)
        if stream.seekable() and os.fstat(stream.fileno()).st_size <= most:
            return stream
        with stream:
            return _buffered(stream, name, most)
    except ImageError:
        raise
    except FileNotFoundError:
        raise ImageError(f"{name}: there is no such file; check the name") from None
    except IsADirectoryError:
        raise ImageError(f"{name}: is a folder; give the name of one photo in it") from None
    except (OSError, ValueError, TypeError) as error:
        # ValueError: a NUL in the name, or a closed file; TypeError: a text file
        reason = getattr(error, "strerror", None) or error
        raise ImageError(f"{name}: cannot be read ({reason}); give the file name of a photo") from error


def _buffered(stream: BinaryIO, name: str, most: int) -> BinaryIO:
    """Take what a stream holds, which may be without end."""
    if type(stream) is io.BytesIO and stream.tell() == 0:
        buffer = stream  # its bytes are shared, not copied
        buffer.seek(0, io.SEEK_END)
    else:
        buffer = io.BytesIO()
        while buffer.tell() <= most and (part := stream.read(_PART)):
            buffer.write(part)
    if buffer.tell() > most:
        raise ImageError(f"{name}: is larger than {most >> 20} MB; raise max_pixels if you trust the file")
    return io.BytesIO(buffer.getvalue())


def save(data: bytes, destination: FileOrName, *, overwrite: bool) -> None:
    """Write bytes to a file, which appears whole or not at all, or to a stream; or raise an OutputError."""
    file = destination_of(destination)
    if isinstance(file, Path):
        save_atomically(file, data, overwrite=overwrite)
        return
    try:
        file.write(data)
        file.flush()
    except OSError as error:
        reason = error.strerror or error
        raise OutputError(
            f"{name_of(destination)}: cannot be written ({reason}); choose another place"
        ) from error
    except (ValueError, TypeError) as error:  # a closed file; a text file
        raise OutputError(
            f"{name_of(destination)}: cannot be written ({error}); give a binary file"
        ) from error
