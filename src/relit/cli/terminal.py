"""What the command line shows and saves: progress, reports, failures, folders of pictures."""

from __future__ import annotations

import contextlib
import json
import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import click

from relit.errors import OptionError, OutputError, RelitError
from relit.photo.atomic_files import check_free
from relit.photo.photo import Photo
from relit.photo.pixels import check_pixels
from relit.photo.reading import read_image
from relit.photo.writing import write_image

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence

    from numpy.typing import NDArray

    from relit.face.landmarks import Landmarks


def exit_code_of(command: Callable[[], int | None]) -> int:
    """Run a command; tell what went wrong in one line, and return the exit code."""
    try:
        return command() or 0
    except click.ClickException as error:
        error.show()
        return error.exit_code
    except RelitError as error:
        return _failed(str(error), 2 if isinstance(error, OptionError) else 1)
    except (KeyboardInterrupt, click.Abort):
        click.echo("relit: interrupted", err=True)
        return 130
    except MemoryError:
        return _failed("not enough memory for photos of this size; try smaller ones")
    except BrokenPipeError:
        # Whoever read us has gone. Nothing is left to say, also not when Python flushes stdout at its end.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1


def _failed(message: str, code: int = 1) -> int:
    click.echo(f"relit: error: {printable(message)}", err=True)
    return code


def printable(text: str) -> str:
    r"""Return `text` on one line and without control characters: file names may hold any.

    Examples
    --------
    >>> print(printable("café" + chr(10) + chr(27)))
    café\n\x1b
    """
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)


@contextlib.contextmanager
def progress(step: str) -> Iterator[None]:
    """Show what is going on, on a terminal only."""
    if not sys.stderr.isatty():
        yield
        return
    from rich.console import Console

    with Console(stderr=True).status(f"{step} ..."):
        yield


@contextlib.contextmanager
def solving(step: str) -> Iterator[None]:
    """Show that a solver is at work, and on its first use ever, why it takes longer."""
    from relit.runtime.jit import announcing

    with progress(step), announcing(_tell_of_compiling):
        yield


def _tell_of_compiling() -> None:
    if sys.stderr.isatty():
        click.echo("relit: compiling the solver, which takes some seconds on its first use", err=True)


@contextlib.contextmanager
def counted(step: str, total: int) -> Iterator[Callable[[], None]]:
    """Show how much of a long step is done, on a terminal only; what is lent counts one on."""
    if not sys.stderr.isatty():
        yield lambda: None
        return
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    columns = (TextColumn(step), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(step, total=total)
        yield lambda: bar.advance(task)


def report(as_json: bool, **facts: Any) -> None:
    """Print the facts as JSON, or on a terminal the names of the files."""
    if as_json:
        try:
            click.echo(json.dumps({name: fact for name, fact in facts.items() if fact not in (None, [])}))
            sys.stdout.flush()
        except BrokenPipeError:
            raise
        except OSError as error:
            raise OutputError(f"standard output: cannot be written ({error.strerror})") from error
    elif sys.stderr.isatty():
        for place in (facts.get(name) for name in ("output", "overlay", "sheet", "stages")):
            for path in [place] if isinstance(place, str) else place or []:
                click.echo(f"wrote {printable(path)}", err=True)


def show_timings(seconds: Mapping[str, float]) -> None:
    """Print how long each stage took, and all of them."""
    from rich.console import Console
    from rich.table import Table

    table = Table(box=None, show_header=False, padding=(0, 2, 0, 0))
    table.add_column()
    table.add_column(justify="right")
    for stage, taken in (*seconds.items(), ("in all", sum(seconds.values()))):
        table.add_row(stage, f"{taken:.2f} s")
    Console(stderr=True).print(table)


def warn_of_folds(folded: float) -> None:
    """Say so if the alignment cannot be trusted."""
    if folded > 0:
        click.echo(
            f"relit: warning: the alignment turns over on {folded:.1%} of the face or the frame; check the "
            "landmarks, or raise --smoothing",
            err=True,
        )


def about(path: str, photo: Photo, found: Landmarks) -> dict[str, Any]:
    """Return the facts of a photo and its face."""
    height, width = photo.pixels.shape[:2]
    return {
        "path": path,
        "width": width,
        "height": height,
        "scheme": found.scheme,
        "confidence": found.confidence,
        "interocular_distance": found.interocular_distance,
    }


def read_photo(path: str) -> Photo:
    """Read a photo that may hold a face."""
    photo = read_image(path)
    check_pixels(photo.pixels, path)
    return photo


class Source(NamedTuple):
    """A photo as the command line gives it: its argument's name, path, and where its face is."""

    argument: str
    path: str
    landmarks: str | None
    face: int | None
    known: Landmarks | None = None

    def knowing(self, landmarks: Landmarks | None) -> Source:
        """Return the same with landmarks that count where no others are given."""
        return self if self.landmarks is not None or self.face is not None else self._replace(known=landmarks)

    def face_in(self, photo: Photo) -> Landmarks:
        """Read the landmarks, or find them."""
        from relit.face.detect import detect_landmarks
        from relit.face.landmark_files import read_landmarks
        from relit.face.landmarks import check_inside

        if self.landmarks is not None:
            found = read_landmarks(self.landmarks, face=self.face)
            check_inside(found, photo.pixels.shape, f"{self.argument}_landmarks")
            return found
        if self.known is not None:
            check_inside(self.known, photo.pixels.shape, f"{self.argument}_landmarks")
            return self.known
        return detect_landmarks(photo.pixels, face=self.face or 0, name=self.argument)


class PictureFolder:
    """A folder for several pictures; refused before any work goes into them.

    Parameters
    ----------
    path : str
        The folder. It is made when pictures are saved, if its parent exists.
    names : sequence of str
        File names that it may get.
    force : bool
        Whether files that exist may be replaced.
    """

    def __init__(self, path: str, names: Sequence[str], force: bool) -> None:
        self.path, self.names, self.force = Path(path), names, force
        self._was_there = self.path.is_dir()
        if self._was_there:
            for name in names:
                check_free(self.path / name, overwrite=force)
        elif self.path.exists():
            raise OutputError(f"{path}: is not a folder; choose another name")
        else:
            check_free(self.path)

    def check_apart(self, output: str) -> None:
        """Refuse an output that would be one of the pictures too."""
        if output != "-" and Path(output).resolve() in [(self.path / name).resolve() for name in self.names]:
            raise OutputError(f"{output}: is one of the pictures in {self.path} as well; choose another name")

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
