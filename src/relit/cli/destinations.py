"""Where a command writes: files that are no input of it and not one another, and pictures in a folder."""

from __future__ import annotations

import contextlib
import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

from relit.errors import OptionError, OutputError
from relit.photo.atomic_files import check_free
from relit.photo.writing import write_image

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from numpy.typing import NDArray


def check_apart(
    output: str | None, others: Mapping[str, Iterable[str | None]], inputs: Iterable[str | None]
) -> None:
    """Refuse, by an `OptionError`, to write two things into one file, or any but the result into an input.

    Parameters
    ----------
    output : str or None
        The file that -o names. Whoever names an input there, and forces it, means it.
    others : mapping
        Flag → files that are written because of it.
    inputs : iterable
        Files that are read. None is passed over, here as there.
    """
    read = {_real(path) for path in inputs if path and path != "-"}
    written = {} if output is None else {_real(output): "-o"}
    for flag, paths in others.items():
        for path in filter(None, paths):
            known = _real(path)
            taken = "which is an input" if known in read else f"which {written.get(known)} writes"
            if known in read or known in written:
                raise OptionError(
                    f"{flag}: expected a file of its own, got {path!r}, {taken}; choose another name"
                )
            written[known] = flag


def _real(path: str) -> object:
    """Return what is the same of all names of one file."""
    try:
        status = Path(path).stat()
    except OSError:  # not there yet
        return os.path.realpath(path)
    except ValueError:  # a NUL in the name, which whoever opens it tells
        return path
    return status.st_dev, status.st_ino


class PictureFolder:
    """A folder for pictures of some names, refused before any work goes into them.

    It is made when pictures are saved, if its parent exists.
    """

    def __init__(self, path: str, names: Sequence[str], force: bool) -> None:
        self.path, self.force = Path(path), force
        self.files = [str(self.path / name) for name in names]
        self._was_there = self.path.is_dir()
        if self._was_there:
            for file in self.files:
                check_free(Path(file), overwrite=force)
        elif self.path.exists():
            raise OutputError(f"{path}: is not a folder; choose another name")
        else:
            check_free(self.path)

    def save(self, pictures: dict[str, NDArray[Any]]) -> list[str]:
        """Write the pictures and return their paths; a folder that got none is not left behind."""
        try:
            self.path.mkdir(exist_ok=True)
        except OSError as error:
            raise OutputError(
                f"{self.path}: this folder cannot be made ({error.strerror}); choose another"
            ) from error
        try:
            for name, picture in pictures.items():
                write_image(self.path / name, picture, overwrite=self.force)
        except BaseException:
            with contextlib.suppress(OSError):  # it was there before, or holds pictures by now
                if not self._was_there:
                    self.path.rmdir()
            raise
        return [str(self.path / name) for name in pictures]
