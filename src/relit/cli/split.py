"""The commands on one photo: ``relit decompose`` and ``relit normalize``."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from relit.cli.destinations import PictureFolder, check_apart
from relit.cli.kinds import FILE, FOLDER, Number
from relit.cli.options import (
    SPLIT,
    Command,
    face_options,
    force_option,
    json_option,
    output_option,
    settings_of,
    transfer_options,
)
from relit.cli.sources import Source, read_photo
from relit.cli.telling import loudness_options, progress, report, solving

if TYPE_CHECKING:
    from relit.photo.photo import Photo
    from relit.settings.options import TransferOptions
    from relit.splitting import Splitting


def _split_options(command: Command) -> Command:
    """Add what says where the face is and how to split it."""
    eye_distance = click.option(
        "--eye-distance",
        type=Number(),
        metavar="PX",
        help="Distance of the eyes in px, which sets the scale of lambda, instead of finding the face; at "
        "100, lambda is in 1/px.",
    )
    for decorate in (
        json_option,
        loudness_options,
        force_option,
        transfer_options(*SPLIT),
        eye_distance,
        face_options("photo"),
    ):
        command = decorate(command)
    return command


def _splitting(
    photo: Photo, source: Source, eye_distance: float | None, settings: TransferOptions
) -> Splitting:
    """Return how the photo is split: by its face, or by the distance of the eyes alone."""
    from relit.splitting import Splitting

    if eye_distance is not None:
        return Splitting(eye_distance, float(settings.lam), settings.neighborhood)
    with progress("Finding the face"):
        return Splitting.of(source.face_in(photo), settings)


def _check(eye_distance: float | None, source: Source, settings: TransferOptions) -> None:
    if eye_distance is None:
        return
    if source.landmarks or source.face is not None:
        raise click.UsageError("--eye-distance stands in for the face; give it, or --landmarks and --face.")
    if settings.lam == "auto":
        raise click.UsageError("--lambda auto needs the face; give --landmarks instead of --eye-distance.")


@click.command()
@click.argument("image", type=FILE)
@click.option("-o", "--output", required=True, type=FOLDER, metavar="DIR", help="Folder for u.png and v.png.")
@_split_options
def decompose(
    image: str,
    output: str,
    landmarks: str | None,
    face: int | None,
    eye_distance: float | None,
    force: bool,
    as_json: bool,
    **given: Any,
) -> None:
    """Split IMAGE into light (u) and person (v): I = u * v.

    In the picture of v, 1 is mid grey, and 2 and above is white.
    """
    settings, source = settings_of(given), Source("image", image, landmarks, face)
    _check(eye_distance, source, settings)

    folder = PictureFolder(output, ("u.png", "v.png"), force)
    check_apart(None, {"-o": folder.files}, (image, landmarks))
    photo = read_photo(image)
    splitting = _splitting(photo, source, eye_distance, settings)
    with solving("Splitting"):
        u, v = splitting.decomposed(photo)
    saved = folder.save({"u.png": u, "v.png": v})
    report(
        as_json,
        f"the light (u) and the person (v) of {source.name}",
        output=saved,
        lambda_px=splitting.lam_px,
        eye_distance=splitting.interocular_distance,
    )


@click.command()
@click.argument("image", type=FILE)
@output_option
@_split_options
def normalize(
    image: str,
    output: str,
    landmarks: str | None,
    face: int | None,
    eye_distance: float | None,
    force: bool,
    as_json: bool,
    **given: Any,
) -> None:
    """Take the light out of IMAGE, for face recognition: v of its lightness, in grey.

    Mid grey is as bright as the surroundings of a pixel.
    """
    settings, source = settings_of(given), Source("image", image, landmarks, face)
    _check(eye_distance, source, settings)
    if output == "-" and as_json:
        raise click.UsageError("stdout cannot take both the photo and --json; write the photo to a file.")

    from relit.photo.writing import check_destination, write_image
    from relit.splitting import grey_like

    photo = read_photo(image)
    check_destination(output, like=grey_like(photo), overwrite=force)
    splitting = _splitting(photo, source, eye_distance, settings)
    with solving("Normalizing"):
        picture = splitting.normalized(photo)
    write_image(output, picture, overwrite=force)
    report(
        as_json,
        f"{source.name} without its light",
        output=output,
        lambda_px=splitting.lam_px,
        eye_distance=splitting.interocular_distance,
    )
