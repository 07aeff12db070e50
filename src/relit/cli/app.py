"""The command line: files in, files out, and nothing that the library cannot do.

Exit codes: 0 done, 1 failed, 2 wrong usage, 130 interrupted. Photos and JSON go to stdout, all else to
stderr; progress is shown on a terminal only. Heavy modules are imported by the commands that need them, so
that ``--help`` and refusals come at once.
"""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import click

from relit import __version__
from relit.cli.batch import batch
from relit.cli.evaluate import evaluate
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
from relit.cli.split import decompose, normalize
from relit.cli.studio import serve, studio
from relit.cli.terminal import (
    Source,
    about,
    exit_code_of,
    progress,
    read_photo,
    report,
    warn_of_folds,
)
from relit.cli.transfer import transfer


def main(arguments: list[str] | None = None) -> None:
    """Run the command line and exit with its code."""
    sys.exit(exit_code_of(lambda: relit.main(arguments, prog_name="relit", standalone_mode=False)))


@click.group(context_settings={"help_option_names": ["-h", "--help"]})
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
    """  # noqa: D301 (click reads the backspace as «do not wrap»)


@relit.command()
@click.argument("target")
@click.argument("reference")
@output_option
@face_options("target", "target_")
@face_options("reference", "reference_")
@transfer_options(*ALIGNMENT)
@force_option
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
    report(
        as_json,
        output=output,
        target=about(target, photo, here),
        reference=about(reference, other, there),
        smoothing=alignment.smoothing,
        folded=alignment.folded,
    )


@relit.command()
@click.argument("image")
@click.option(
    "-o", "--output", metavar="FILE", help="File to write: .pts, .tem, .json, .ljson, .csv or .xml."
)
@click.option("--overlay", metavar="PICTURE", help="Also draw the landmarks into the photo, as this file.")
@click.option(
    "--face", type=click.IntRange(min=0), metavar="N", help="Which face: 0 is the largest. [default: 0]"
)
@force_option
@json_option
def landmarks(
    image: str, output: str | None, overlay: str | None, face: int | None, force: bool, as_json: bool
) -> None:
    """Find the 478 landmarks of the face in IMAGE."""
    if not (output or overlay or as_json):
        raise click.UsageError("Nothing to do: give -o FILE, --overlay PICTURE or --json.")

    from relit.face.landmark_files import check_landmark_destination, write_landmarks
    from relit.figures import landmark_overlay
    from relit.photo.writing import check_destination, write_image

    if output:
        check_landmark_destination(output, overwrite=force)
    photo = read_photo(image)
    with progress("Finding the face"):
        found = Source("image", image, None, face).face_in(photo)
    picture = replace(photo, pixels=landmark_overlay(photo.pixels, found), alpha=None)
    if overlay:
        check_streams(overlay, as_json)
        check_destination(overlay, like=picture, overwrite=force)
    if output:
        write_landmarks(output, found, overwrite=force, image_name=Path(image).name)
    if overlay:
        write_image(overlay, picture, overwrite=force)
    report(
        as_json,
        output=output,
        overlay=overlay,
        image=about(image, photo, found),
        points=found.points.round(3).tolist() if as_json and not output else None,
    )


@relit.command()
@click.argument("folder", metavar="DIR")
@force_option
@json_option
def samples(folder: str, force: bool, as_json: bool) -> None:
    """Copy sample photos into the folder DIR, to try relit on."""
    from relit.photo.samples import copy_samples

    report(as_json, output=[str(path) for path in copy_samples(Path(folder), overwrite=force)])


for _command in (transfer, batch, decompose, normalize, evaluate, studio, serve):
    relit.add_command(_command)
