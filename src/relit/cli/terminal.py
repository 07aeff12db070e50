"""How a run ends: with pictures in a folder, or with one line on what went wrong."""

from __future__ import annotations

import contextlib
import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from relit.cli.telling import printable
from relit.cli.wording import in_flags
from relit.errors import OptionError, OutputError, RelitError
from relit.photo.atomic_files import check_free
from relit.photo.writing import write_image

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray


def exit_code_of(command: Callable[[], int | None]) -> int:
    """Run a command; print what went wrong in one line, and return the exit code."""
    try:
        return command() or 0
    except click.ClickException as error:
        error.show()
        return error.exit_code
    except RelitError as error:
        return _failed(in_flags(str(error)), 2 if isinstance(error, OptionError) else 1)
    except (KeyboardInterrupt, click.Abort):
        click.echo("relit: interrupted", err=True)
        return 130
    except MemoryError:
        return _failed("not enough memory for photos of this size; try smaller ones")
    except BrokenPipeError:
        # Nobody reads our output any more: write nothing, also not when Python flushes stdout at its end.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1


def _failed(message: str, code: int = 1) -> int:
    click.echo(f"relit: error: {printable(message)}", err=True)
    return code


class PictureFolder:
    """A folder for pictures of some names, refused before any work goes into them.

    It is made when pictures are saved, if its parent exists. `output` is another file that is written, which
    must not be one of the pictures.
    """

    def __init__(self, path: str, names: Sequence[str], force: bool, output: str = "-") -> None:
        self.path, self.force = Path(path), force
        self._was_there = self.path.is_dir()
        if self._was_there:
            for name in names:
                check_free(self.path / name, overwrite=force)
        elif self.path.exists():
            raise OutputError(f"{path}: is not a folder; choose another name")
        else:
            check_free(self.path)
        if output != "-" and Path(output).resolve() in [(self.path / name).resolve() for name in names]:
            raise OutputError(f"{output}: is one of the pictures in {path} as well; choose another name")

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
