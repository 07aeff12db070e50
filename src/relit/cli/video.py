"""The command ``relit video``: relight the face in a video."""

from __future__ import annotations

import sys
import time
from contextlib import contextmanager
from dataclasses import asdict, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from relit.cli.destinations import check_apart
from relit.cli.groups import GroupedCommand, Option
from relit.cli.kinds import FILE, Count, Moment
from relit.cli.options import (
    check_heeded,
    face_options,
    force_option,
    json_option,
    settings_of,
    transfer_options,
)
from relit.cli.sources import read_photo, sources_of
from relit.cli.telling import (
    is_quiet,
    loudness_options,
    report,
    say,
    warn_of_confidence,
    warn_of_losses,
)
from relit.photo.atomic_files import check_free
from relit.photo.writing import check_destination, write_image
from relit.settings.options import TransferOptions
from relit.settings_file import Settings
from relit.video.clip import is_video, need_av
from relit.video.encoding import CODECS

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from relit.video.film import Progress

_OF_PHOTOS = {"mask", "full_resolution"}  # options that make no sense of videos
_EVERY = 30.0  # s between lines, where nobody sees a bar


@click.command(
    cls=GroupedCommand,
    examples=(
        "relit video talk.mp4 film.jpg -o relit.mp4",
        "relit video talk.mov --light rembrandt --from 0:10 --to 0:25 -o try.mov --sheet try.jpg",
        "relit video talk.mp4 other.mp4 -o relit.mp4 --crf 14",
    ),
)
@click.argument("clip", metavar="VIDEO", type=FILE)
@click.argument("references", metavar="[REFERENCE]...", nargs=-1, type=FILE)
@click.option(
    "-o",
    "--output",
    required=True,
    type=FILE,
    metavar="FILE",
    help="Video to write: .mp4, .mov, .mkv or .webm.",
)
@transfer_options(*(one.name for one in fields(TransferOptions) if one.name not in _OF_PHOTOS))
@click.option(
    "--face",
    cls=Option,
    group="where",
    type=Count(0),
    default=0,
    metavar="N",
    help="Which face, where one is first seen in a shot: 0 is the largest. [default: 0]",
)
@face_options("reference", "reference_", several=True)
@click.option("--from", "first", type=Moment(), metavar="TIME", help="Where to begin: seconds, or 1:02.5.")
@click.option("--to", "last", type=Moment(), metavar="TIME", help="Where to end, the same.")
@click.option(
    "--reference-end",
    type=click.Choice(["hold", "loop"]),
    default="hold",
    show_default=True,
    help="What a video REFERENCE gives after its end: its last light, or it begins anew.",
)
@click.option(
    "--codec",
    type=click.Choice(CODECS),
    help="How FILE is encoded. By default as VIDEO is, if such a file can be, else h264 or vp9.",
)
@click.option(
    "--crf",
    type=Count(0),
    metavar="N",
    help="How much is lost by it: 0 nothing, more is a smaller file. [default: 17 of h264, 19 of h265, 22 of "
    "vp9]",
)
@click.option("--sheet", type=FILE, metavar="PICTURE", help="Also draw some frames, before and after.")
@force_option
@loudness_options
@json_option
def video(
    clip: str,
    references: tuple[str, ...],
    output: str,
    face: int,
    first: float | None,
    last: float | None,
    reference_end: str,
    codec: str | None,
    crf: int | None,
    sheet: str | None,
    force: bool,
    as_json: bool,
    **given: Any,
) -> None:
    """Relight the face in VIDEO with the light of the face in REFERENCE, or with --light.

    REFERENCE is a photo, or several of which the median counts; or a video, whose light at the same time
    counts. Sound, subtitles and time stamps stay as they are. What was interrupted goes on where it was when
    the same command is given again.
    """
    given |= {"target_landmarks": None, "target_face": None}
    _, *theirs = sources_of(given, clip, references, Settings(TransferOptions()), swap=False)
    settings = settings_of(given)
    if (settings.light is None) != bool(theirs):
        raise click.UsageError("Give a REFERENCE, or --light, and not both.")
    films = [source for source in theirs if is_video(source.path)]
    if films and len(theirs) > 1:
        raise click.UsageError("Give one video as REFERENCE, or photos.")
    if films and films[0].landmarks is not None:
        raise click.UsageError(
            "--reference-landmarks are those of a photo; leave it out of a video REFERENCE."
        )
    if reference_end == "loop" and not films:
        raise click.UsageError("--reference-end loop is for a video REFERENCE; leave it out.")
    if "-" in (clip, output, *references):
        raise click.UsageError("A video cannot come from stdin or go to stdout; give files.")
    check_heeded(settings)
    check_apart(output, {"--sheet": [sheet]}, (clip, *(file for source in theirs for file in source.files)))
    need_av()
    if sheet is not None:
        check_destination(sheet, overwrite=force)
    check_free(Path(output), overwrite=force)

    from relit.video.film import relight_video

    begun = time.monotonic()
    photos = [] if films else [(source, read_photo(source.path)) for source in theirs]
    faces = [source.face_in(photo) for source, photo in photos]
    with _told() as tell:
        film = relight_video(
            clip,
            output,
            settings,
            references=[photo for _, photo in photos],
            reference_landmarks=faces,
            reference_video=films[0].path if films else None,
            reference_face=(films[0].face or 0) if films else 0,
            loops=reference_end == "loop",
            part=(first, last),
            face=face,
            codec=codec,
            crf=crf,
            overwrite=force,
            tell=tell,
        )
    if sheet is not None:
        from relit.video.sheet import contact_sheet

        write_image(sheet, contact_sheet(clip, output, (first, last), film.frames), overwrite=force)
    if film.missing_seconds and not is_quiet():
        click.echo(
            f"relit: warning: {clip}: ends {film.missing_seconds:.1f} s sooner than it says; if the file is "
            "cut off, relight a whole one",
            err=True,
        )
    warn_of_confidence(film.confidence)
    warn_of_losses(output, film.not_kept)
    say(f"{film.frames} frames, {film.lit} of them relit, in {film.shots} shots")
    say(f"light: confidence {film.confidence:.2f}")
    light = settings.light or "of " + " and ".join(source.name for source in theirs)
    report(
        as_json,
        f"the face of {clip} under the light {light}",
        output=output,
        sheet=sheet,
        frames=film.frames,
        relit=film.lit,
        shots=film.shots,
        confidence=film.confidence,
        not_kept=film.not_kept,
        missing_seconds=film.missing_seconds,
        seconds={"all": time.monotonic() - begun},
        options=asdict(settings),
    )


@contextmanager
def _told() -> Iterator[Callable[[Progress], None]]:
    """Lend what shows how far a film is: on a terminal a bar, else a line every half minute, on stderr."""
    if is_quiet():
        yield lambda _progress: None
        return
    begun: dict[str, Any] = {"step": "", "at": 0.0, "first": 0.0, "told": time.monotonic()}

    def left(now: Progress) -> str:
        """Return how long the pass still takes at the speed it has."""
        if now.step != begun["step"]:
            begun.update(step=now.step, at=time.monotonic(), first=now.done)
        done, taken = now.done - begun["first"], time.monotonic() - begun["at"]
        if done <= 0 or now.total <= now.done:
            return ""
        rest = round(taken * (now.total - now.done) / done)
        return f"{rest // 3600}:{rest // 60 % 60:02}:{rest % 60:02} left"

    if not sys.stderr.isatty():

        def line(now: Progress) -> None:
            rest = left(now)
            if time.monotonic() - begun["told"] >= _EVERY:
                begun["told"] = time.monotonic()
                click.echo(
                    f"relit: {now.step.lower()}: {now.done:.0f} of {now.total:.0f}{rest and f', {rest}'}",
                    err=True,
                )

        yield line
        return
    from rich.console import Console
    from rich.progress import BarColumn, TextColumn
    from rich.progress import Progress as Bar

    columns = (TextColumn("{task.description}"), BarColumn(), TextColumn("{task.fields[rest]}"))
    with Bar(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("Tracking", rest="")
        yield lambda now: bar.update(
            task, description=now.step, completed=now.done, total=now.total or None, rest=left(now)
        )
