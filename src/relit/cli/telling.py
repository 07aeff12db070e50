"""What the commands say of their work, and how loudly: nothing, what a terminal shows, or all."""

from __future__ import annotations

import contextlib
import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from relit.errors import OutputError
from relit.runtime.announcing import announcing

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence

    Command = Callable[..., None]

_LOUDNESS = "relit.loudness"  # key of click's context
_QUIET, _VERBOSE = -1, 1
_UNSURE = 0.2  # confidence below which a light is a guess: of ten references, those of two fringes


def loudness_options(command: Command) -> Command:
    """Add -q and -v to a command."""
    for short, name, loudness, told in (
        ("-v", "--verbose", _VERBOSE, "Say what was found, and how long it took."),
        ("-q", "--quiet", _QUIET, "Say nothing, unless it fails."),
    ):

        def choose(context: click.Context, _parameter: Any, asked: bool, loudness: int = loudness) -> None:
            if asked:
                context.meta[_LOUDNESS] = loudness

        command = click.option(short, name, is_flag=True, expose_value=False, callback=choose, help=told)(
            command
        )
    return command


def _loudness() -> int:
    context = click.get_current_context(silent=True)
    return context.meta.get(_LOUDNESS, 0) if context else 0


def is_quiet() -> bool:
    """Whether nothing is to be said, not even a warning."""
    return _loudness() == _QUIET


def is_verbose() -> bool:
    """Whether everything is to be said."""
    return _loudness() == _VERBOSE


def is_watched() -> bool:
    """Whether somebody sees how work goes on: on a terminal."""
    return sys.stderr.isatty() and not is_quiet()


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
    if not is_watched():
        yield
        return
    from rich.console import Console

    with Console(stderr=True).status(f"{step} ..."):
        yield


@contextlib.contextmanager
def solving(step: str) -> Iterator[None]:
    """Show that a solver is running, and on its first use ever, why it takes longer."""
    watched = is_watched()

    def tell() -> None:
        if watched:
            click.echo("relit: compiling the solver, which takes some seconds on its first use", err=True)

    with progress(step), announcing(tell):
        yield


def report(as_json: bool, done: str = "", **facts: Any) -> None:
    """Print the facts as JSON; to who watches, or asks with -v, one line on what was `done` and where.

    Of the facts, ``output``, ``overlay``, ``sheet``, ``changed`` and ``stages`` are the files written, and
    ``seconds`` is how long the stages took.
    """
    if as_json:
        try:
            click.echo(json.dumps({name: fact for name, fact in facts.items() if fact not in (None, [])}))
            sys.stdout.flush()
        except BrokenPipeError:
            raise
        except OSError as error:
            raise OutputError(f"standard output: cannot be written ({error.strerror})") from error
    elif is_watched() or is_verbose():
        places = [facts.get(name) for name in ("output", "overlay", "sheet", "changed", "stages")]
        where = " and ".join(_named(place) for place in places if place)
        seconds = f" ({sum(facts['seconds'].values()):.1f} s)" if "seconds" in facts else ""
        click.echo(printable(f"wrote {where}: {done}{seconds}"), err=True)


def _named(place: str | list[str]) -> str:
    """Return the name of a file, or of several in a folder."""
    if isinstance(place, str):
        return "stdout" if place == "-" else place
    folder = Path(place[0]).parent
    names = [Path(path).name for path in place]
    return f"{' and '.join(names) if len(names) < 3 else f'{len(names)} files'} in {folder}"


def say(line: str) -> None:
    """Say a detail, to who asks with -v."""
    if is_verbose():
        click.echo(printable(line), err=True)


def say_face(facts: Mapping[str, Any]) -> None:
    """Say where a face is, and how surely, to who asks with -v."""
    found = "given" if facts["confidence"] is None else f"found (confidence {facts['confidence']:.2f})"
    eyes = facts["interocular_distance"]
    say(f"{facts['path']}: {facts['width']}x{facts['height']} px, face {found}, eyes {eyes:.0f} px apart")


def show_timings(seconds: Mapping[str, float]) -> None:
    """Print how long each stage took, and all of them."""
    rows = {**seconds, "in all": sum(seconds.values())}
    width = max(map(len, rows))
    for stage, taken in rows.items():
        click.echo(f"{stage:{width}} {taken:8.2f} s", err=True)


def warn_of_folds(folded: float) -> None:
    """Say so if the alignment cannot be trusted."""
    if folded > 0 and not is_quiet():
        click.echo(
            f"relit: warning: the alignment turns over on {folded:.1%} of the face or the frame; check the "
            "landmarks, or raise --smoothing",
            err=True,
        )


def warn_of_losses(output: str, lost: Sequence[str]) -> None:
    """Say what else of a photo its new file does not keep."""
    if lost and not is_quiet():
        click.echo(printable(f"relit: warning: {output}: does not keep {', '.join(lost)}"), err=True)


def warn_of_lossy_rows(count: int, table: str) -> None:
    """Say that files of a batch do not keep all that photos hold beside their pixels."""
    if count and not is_quiet():
        told = f"{count} {'file does' if count == 1 else 'files do'} not keep all of the metadata"
        click.echo(printable(f"relit: warning: {told}; {table} says what, in not_kept"), err=True)


def warn_of_confidence(confidence: float) -> None:
    """Say so if the reference hardly tells its light."""
    if confidence < _UNSURE and not is_quiet():
        click.echo(
            f"relit: warning: the light of the reference is a guess (confidence {confidence:.2f}): little of "
            "its face is seen, or lamps explain little of it; try a reference that looks as the target does",
            err=True,
        )
