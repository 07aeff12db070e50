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
from relit.runtime.announcing import announcing

_UNSURE = 0.2  # confidence below which a light is a guess: of ten references, those of two fringes

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence

    from numpy.typing import NDArray

    from relit.face.landmarks import Landmarks


def exit_code_of(command: Callable[[], int | None]) -> int:
    """Run a command; print what went wrong in one line, and return the exit code."""
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
        # Nobody reads our output any more: write nothing, also not when Python flushes stdout at its end.
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
    """Show that a solver is running, and on its first use ever, why it takes longer."""

    def tell() -> None:
        if sys.stderr.isatty():
            click.echo("relit: compiling the solver, which takes some seconds on its first use", err=True)

    with progress(step), announcing(tell):
        yield


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
    rows = {**seconds, "in all": sum(seconds.values())}
    width = max(map(len, rows))
    for stage, taken in rows.items():
        click.echo(f"{stage:{width}} {taken:8.2f} s", err=True)


def warn_of_folds(folded: float) -> None:
    """Say so if the alignment cannot be trusted."""
    if folded > 0:
        click.echo(
            f"relit: warning: the alignment turns over on {folded:.1%} of the face or the frame; check the "
            "landmarks, or raise --smoothing",
            err=True,
        )


def warn_of_confidence(confidence: float) -> None:
    """Say so if the reference hardly tells its light."""
    if confidence < _UNSURE:
        click.echo(
            f"relit: warning: the light of the reference is a guess (confidence {confidence:.2f}): little of "
            "its face is seen, or lamps explain little of it; try a reference that looks as the target does",
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

    @classmethod
    def of(cls, given: dict[str, Any], argument: str, path: str) -> Source:
        """Take the options of `options.face_options` for a photo out of those that a command was given."""
        return cls(argument, path, given.pop(f"{argument}_landmarks"), given.pop(f"{argument}_face"))

    @property
    def face_is_given(self) -> bool:
        """Whether an option says where the face is."""
        return self.landmarks is not None or self.face is not None

    def knowing(self, landmarks: Landmarks | None) -> Source:
        """Return the same with landmarks that count where no option says where the face is."""
        return self if self.face_is_given else self._replace(known=landmarks)

    def face_in(self, photo: Photo) -> Landmarks:
        """Read the landmarks, or find them."""
        from relit.face.detect import detect_landmarks
        from relit.face.landmark_files import read_landmarks
        from relit.face.landmarks import check_inside

        found = self.known if self.landmarks is None else read_landmarks(self.landmarks, face=self.face)
        if found is None:
            return detect_landmarks(photo.pixels, face=self.face or 0, name=self.argument)
        check_inside(found, photo.pixels.shape, f"{self.argument}_landmarks")
        return found


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
