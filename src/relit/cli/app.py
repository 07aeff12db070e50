"""The command line: files in, files out, and nothing that the library cannot do.

Exit codes: 0 done, 1 failed, 2 wrong usage, 130 interrupted. Photos and JSON go to stdout, all else to
stderr; progress is shown on a terminal only. Heavy modules are imported by the commands that need them, so
that ``--help`` and refusals come at once.
"""

from __future__ import annotations

import shlex
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import click

from relit import __version__
from relit.cli.batch import batch
from relit.cli.destinations import check_apart
from relit.cli.evaluate import evaluate
from relit.cli.kinds import FILE, FOLDER, Count
from relit.cli.options import (
    ALIGNMENT,
    check_streams,
    face_options,
    force_option,
    json_option,
    output_option,
    settings_of,
    transfer_options,
)
from relit.cli.serve import serve
from relit.cli.sources import Source, about, read_photo
from relit.cli.split import decompose, normalize
from relit.cli.studio import studio
from relit.cli.telling import (
    loudness_options,
    progress,
    report,
    say_face,
    warn_of_folds,
)
from relit.cli.terminal import exit_code_of
from relit.cli.transfer import transfer
from relit.cli.video import video


def main(arguments: list[str] | None = None) -> None:
    """Run the command line and exit with its code."""
    sys.exit(exit_code_of(lambda: relit.main(arguments, prog_name="relit", standalone_mode=False)))


@click.group(context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 120})
@click.version_option(__version__, prog_name="relit")
def relit() -> None:
    """Carry the light of one face photo to another.

    The TARGET keeps the person, the REFERENCE gives the light. Faces are found automatically; landmarks
    placed by hand can be given instead. Photos are JPEG, PNG, TIFF, WebP, PPM/PGM or BMP; with
    extras also HEIC, camera raw and OpenEXR.

    \b
    Start here:
      relit samples photos
      relit transfer photos/target.png photos/reference.jpg -o relit.png
      relit transfer photos/target.png --light rembrandt -o lit.png
      relit studio
    """  # noqa: D301 (click reads the backspace as «do not wrap»)


@relit.command()
@click.argument("target", type=FILE)
@click.argument("reference", type=FILE)
@output_option
@face_options("target", "target_")
@face_options("reference", "reference_")
@transfer_options(*ALIGNMENT)
@force_option
@loudness_options
@json_option
def align(target: str, reference: str, output: str, force: bool, as_json: bool, **given: Any) -> None:
    """Warp REFERENCE so that its face lies on the face in TARGET."""
    ours, theirs = Source.of(given, "target", target), Source.of(given, "reference", reference)
    settings = settings_of(given)
    check_streams(output, as_json, target, reference)

    from relit.photo.writing import check_destination, write_image
    from relit.warp.alignment import align as run

    with progress("Reading the photos"):
        photo, other = read_photo(target), replace(read_photo(reference), alpha=None)
    check_destination(output, like=other, overwrite=force)
    with progress("Finding the faces"):
        here, there = ours.face_in(photo), theirs.face_in(other)
    with progress("Aligning"):
        alignment = run(
            other.pixels,
            there,
            here,
            photo.pixels.shape,
            kernel=settings.kernel,
            affine=settings.affine,
            smoothing=settings.smoothing,
        )
    warn_of_folds(alignment.folded)
    write_image(output, alignment.warped, like=other, overwrite=force)
    faces = {"target": about(target, photo, here), "reference": about(reference, other, there)}
    for facts in faces.values():
        say_face(facts)
    report(
        as_json,
        f"{theirs.name}, its face laid over that of {ours.name}",
        output=output,
        **faces,
        smoothing=alignment.smoothing,
        folded=alignment.folded,
    )


@relit.command()
@click.argument("image", type=FILE)
@click.option(
    "-o",
    "--output",
    type=FILE,
    metavar="FILE",
    help="File to write: .pts, .tem, .json, .ljson, .csv or .xml.",
)
@click.option(
    "--overlay", type=FILE, metavar="PICTURE", help="Also draw the landmarks into the photo, as this file."
)
@click.option("--face", type=Count(0), metavar="N", help="Which face: 0 is the largest. [default: 0]")
@force_option
@loudness_options
@json_option
def landmarks(
    image: str, output: str | None, overlay: str | None, face: int | None, force: bool, as_json: bool
) -> None:
    """Find the 478 landmarks of the face in IMAGE."""
    if not (output or overlay or as_json):
        raise click.UsageError("Nothing to do: give -o FILE, --overlay PICTURE or --json.")
    check_apart(output, {"--overlay": [overlay]}, [image])

    from relit.face.landmark_files import check_landmark_destination, write_landmarks
    from relit.figures import landmark_overlay
    from relit.photo.writing import check_destination, write_image

    if output:
        check_landmark_destination(output, overwrite=force)
    photo = read_photo(image)
    with progress("Finding the face"):
        source = Source("image", image, None, face)
        found = source.face_in(photo)
    picture = replace(photo, pixels=landmark_overlay(photo.pixels, found), alpha=None)
    if overlay:
        check_streams(overlay, as_json)
        check_destination(overlay, like=picture, overwrite=force)
    if output:
        write_landmarks(output, found, overwrite=force, image_name=Path(image).name)
    if overlay:
        write_image(overlay, picture, overwrite=force)
    facts = about(image, photo, found)
    say_face(facts)
    report(
        as_json,
        f"the {len(found)} landmarks of {source.name}",
        output=output,
        overlay=overlay,
        image=facts,
        points=found.points.round(3).tolist() if as_json and not output else None,
    )


@relit.command()
@click.argument("folder", metavar="DIR", type=FOLDER)
@force_option
@loudness_options
@json_option
def samples(folder: str, force: bool, as_json: bool) -> None:
    """Copy sample photos into the folder DIR, to try relit on."""
    from relit.photo.samples import copy_samples

    copies = copy_samples(Path(folder), overwrite=force)
    target, reference = (shlex.quote(str(copies[k])) for k in (0, 1))
    report(
        as_json,
        f"photos to try relit on; next: relit transfer {target} {reference} -o relit.png",
        output=[str(copy) for copy in copies],
    )


for _command in (transfer, video, batch, decompose, normalize, evaluate, studio, serve):
    relit.add_command(_command)
