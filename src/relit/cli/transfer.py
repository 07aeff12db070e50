"""The command ``relit transfer``: relight a face."""

from __future__ import annotations

from dataclasses import asdict, replace
from typing import TYPE_CHECKING, Any

import click

from relit.cli.options import (
    check_streams,
    face_options,
    force_option,
    json_option,
    output_option,
    settings_of,
    transfer_options,
)
from relit.cli.terminal import (
    PictureFolder,
    Source,
    about,
    progress,
    read_photo,
    report,
    show_timings,
    solving,
    warn_of_folds,
)
from relit.errors import ImageError
from relit.runtime.timing import Stopwatch
from relit.settings_file import read_settings

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from relit.face.landmarks import Landmarks
    from relit.photo.photo import Photo
    from relit.results import TransferResult


@click.command()
@click.argument("target")
@click.argument("references", metavar="[REFERENCE]...", nargs=-1)
@output_option
@face_options("target", "target_")
@click.option("--all-faces", is_flag=True, help="Relight every face of TARGET, the largest first.")
@face_options("reference", "reference_", several=True)
@click.option("--swap", is_flag=True, help="Swap the roles: relight REFERENCE with the light of TARGET.")
@click.option(
    "--second-reference",
    metavar="FILE",
    help="For methods that take one: REFERENCE's face in TARGET's light.",
)
@face_options("second reference", "second_")
@transfer_options()
@click.option(
    "--config",
    metavar="FILE",
    help="Settings that the studio saved: options and landmarks. What is given besides counts more.",
)
@click.option(
    "--region-mask",
    metavar="FILE",
    help="A picture of TARGET's size: white where it is to be relit, black where not, grey in between.",
)
@click.option("--stages", metavar="DIR", help="Save every stage, and a contact sheet of all, in this folder.")
@click.option(
    "--sheet",
    metavar="PICTURE",
    help="Also draw target, reference and result side by side, halves before and after, and their light.",
)
@click.option("--timings", is_flag=True, help="Show on stderr how long each stage took.")
@force_option
@json_option
def transfer(
    target: str,
    references: tuple[str, ...],
    output: str,
    target_landmarks: str | None,
    target_face: int | None,
    all_faces: bool,
    reference_landmarks: tuple[str, ...],
    reference_face: tuple[int, ...],
    swap: bool,
    second_reference: str | None,
    second_landmarks: str | None,
    second_face: int | None,
    config: str | None,
    region_mask: str | None,
    stages: str | None,
    sheet: str | None,
    timings: bool,
    force: bool,
    as_json: bool,
    **given: Any,
) -> None:
    """Relight the face in TARGET with the light of the face in REFERENCE.

    TARGET and REFERENCE are photos; one of them may be - for stdin. Of several REFERENCEs, what most of them
    do counts. With --light there is none.
    """
    saved_settings = read_settings(config) if config else None
    settings = settings_of(given, saved_settings.options if saved_settings else None)
    check_streams(output, as_json, target, *references, second_reference or "")
    sources = _sources("reference", references, reference_landmarks, reference_face)
    source = Source("target", target, target_landmarks, target_face)
    if saved_settings:
        source = source.knowing(saved_settings.target)
        sources = [one.knowing(saved_settings.reference) for one in sources[:1]] + sources[1:]
    if swap:
        if len(sources) != 1:
            raise click.UsageError("--swap takes one REFERENCE.")
        source, sources = sources[0], [source]
    if (settings.light is None) == (not sources):
        raise click.UsageError("Give a REFERENCE, or --light, and not both.")
    if second_reference is None and (second_landmarks is not None or second_face is not None):
        raise click.UsageError("--second-landmarks and --second-face belong to a --second-reference.")
    if all_faces and (target_face is not None or target_landmarks is not None or stages or sheet):
        raise click.UsageError("--all-faces goes with no --face, --target-landmarks, --stages or --sheet.")

    from relit.face.detect import detect_faces
    from relit.figures import STAGES, comparison_sheet, contact_sheet, stage_pictures
    from relit.photo.reading import read_image
    from relit.photo.writing import check_destination, write_image
    from relit.relighting import transfer as run
    from relit.runtime.threads import pool

    folder = None
    if stages is not None:
        folder = PictureFolder(stages, [f"{name}.png" for name in (*STAGES, "sheet")], force)
        folder.check_apart(output)
    if sheet is not None:
        check_streams(sheet, as_json)
        check_destination(sheet, overwrite=force)
    watch = Stopwatch()
    with progress("Reading the photos"), watch("read"):
        # One by one: a file that never ends can be interrupted here, but not in a thread.
        photo, *lights = [read_photo(one.path) for one in (source, *sources)]
        second = read_photo(second_reference) if second_reference else None
        area = _lightness(read_image(region_mask), region_mask) if region_mask else None
    check_destination(output, like=photo, overwrite=force)
    with progress("Finding the faces"), watch("find the faces"):
        faces = detect_faces(photo.pixels, name="target") if all_faces else []
        with pool(2) as at_once:
            sitters = [*([] if faces else [(source, photo)]), *zip(sources, lights, strict=True)]
            there = at_once(lambda sitter: sitter[0].face_in(sitter[1]), sitters)
        faces = faces or [there.pop(0)]
        beside = None
        if second:
            beside = Source("second", second_reference or "", second_landmarks, second_face).face_in(second)
    results: list[TransferResult] = []
    for here in faces:
        with solving("Relighting"):
            results.append(
                run(
                    replace(photo, pixels=results[-1].image) if results else photo,
                    lights,
                    target_landmarks=here,
                    reference_landmarks=there,
                    second_reference=second,
                    second_landmarks=beside,
                    region_mask=area,
                    options=settings,
                )
            )
        for stage, seconds in results[-1].seconds.items():
            watch.add(stage, seconds)
    result = results[-1]
    folded = max((one.alignment.folded for one in result.lightings if one.alignment), default=0.0)
    warn_of_folds(folded)
    with progress("Writing"), watch("write"):
        pictures: dict[str, NDArray[Any]] = stage_pictures(result) if folder else {}
        if folder:
            pictures["sheet"] = contact_sheet(result, pictures)
        write_image(output, result.image, like=photo, overwrite=force)
        if sheet is not None:
            write_image(sheet, comparison_sheet(result), overwrite=force)
        saved = folder.save({f"{name}.png": picture for name, picture in pictures.items()}) if folder else []
    if timings:
        show_timings(watch.seconds)
    facts = _facts(source, photo, faces, sources, lights, there)
    report(
        as_json,
        output=output,
        sheet=sheet,
        stages=saved,
        **facts,
        lambda_px=result.lam,
        factor=result.view.factor,
        folded=folded,
        smoothing=result.first.alignment.smoothing if result.first.alignment else None,
        seconds=watch.seconds,
        options=asdict(settings),
    )


def _sources(
    role: str, paths: tuple[str, ...], landmarks: tuple[str, ...], faces: tuple[int, ...]
) -> list[Source]:
    """Pair photos with what says where their faces are, in the order given."""
    for flag, values in (("landmarks", landmarks), ("face", faces)):
        if len(values) not in (0, len(paths)):
            raise click.UsageError(
                f"--{role}-{flag} was given {len(values)} times for {len(paths)} photos; give it once for "
                "each, in their order, or not at all."
            )
    return [
        Source(role, path, landmarks[k] if landmarks else None, faces[k] if faces else None)
        for k, path in enumerate(paths)
    ]


def _lightness(mask: Photo, path: str) -> NDArray[Any]:
    """Return a mask that was read, which may have been saved with colours."""
    if mask.pixels.ndim == 3 and (mask.pixels != mask.pixels[..., :1]).any():
        raise ImageError(f"{path}: expected a grey picture as --region-mask, found colours; save it in grey")
    return mask.pixels if mask.pixels.ndim == 2 else mask.pixels[..., 0].copy()


def _facts(
    source: Source,
    photo: Photo,
    faces: list[Landmarks],
    sources: list[Source],
    lights: list[Photo],
    there: list[Landmarks],
) -> dict[str, Any]:
    """Return what a report says of the photos: of one reference itself, of several a list."""
    references = [
        about(one.path, light, marks) for one, light, marks in zip(sources, lights, there, strict=True)
    ]
    targets = [about(source.path, photo, face) for face in faces]
    return {
        "target": targets[0] if len(targets) == 1 else targets,
        "reference": references[0] if len(references) == 1 else references,
    }
