"""The command ``relit transfer``: relight a face."""

from __future__ import annotations

import threading
from dataclasses import asdict, replace
from importlib import import_module
from itertools import zip_longest
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
    warn_of_confidence,
    warn_of_folds,
)
from relit.errors import ImageError
from relit.photo.reading import read_image
from relit.photo.writing import check_destination, write_image
from relit.result_files import check_results_destination, write_results
from relit.runtime.allocator import keep_freed_memory
from relit.runtime.timing import Stopwatch
from relit.settings.options import TransferOptions
from relit.settings_file import Settings, read_settings

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
    help="Settings that the studio saved: options and landmarks. Options given here take precedence.",
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
    help="Also draw target, reference and result side by side, half before and half after, and their light.",
)
@click.option("--timings", is_flag=True, help="Show on stderr how long each stage took.")
@force_option
@json_option
def transfer(
    target: str,
    references: tuple[str, ...],
    output: str,
    all_faces: bool,
    swap: bool,
    second_reference: str | None,
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

    TARGET and REFERENCE are photos; one of them may be - for stdin. Of several REFERENCEs, the median of the
    changes of light counts. With --light there is none.
    """
    check_streams(output, as_json, target, *references, second_reference or "")
    saved = read_settings(config) if config else Settings(TransferOptions())
    ours, *theirs = _sources(given, target, references, saved, swap=swap)
    second = Source.of(given, "second", second_reference or "")
    settings = settings_of(given, saved.options)
    if (settings.light is None) == (not theirs):
        raise click.UsageError("Give a REFERENCE, or --light, and not both.")
    if second.face_is_given and not second.path:
        raise click.UsageError("--second-landmarks and --second-face belong to a --second-reference.")
    if all_faces and (ours.face_is_given or stages or sheet):
        raise click.UsageError("--all-faces goes with no --face, --target-landmarks, --stages or --sheet.")

    folder = None
    if stages is not None:
        from relit.figures import STAGES

        folder = PictureFolder(stages, [f"{name}.png" for name in (*STAGES, "sheet")], force, output)
    if sheet is not None:
        check_streams(sheet, as_json)
        check_destination(sheet, overwrite=force)
    watch = Stopwatch()
    keep_freed_memory()
    _load()
    with progress("Reading the photos"), watch("read"):
        # One by one: a file that never ends can be interrupted here, but not in a thread.
        photo, *others = [read_photo(source.path) for source in (ours, *theirs)]
        beside = read_photo(second.path) if second.path else None
        area = _read_mask(region_mask) if region_mask else None
    check_results_destination(output, like=photo, overwrite=force)
    with progress("Finding the faces"), watch("find the faces"):
        faces, there = _find_faces([(ours, photo), *zip(theirs, others, strict=True)], all_faces=all_faces)
        marks = second.face_in(beside) if beside else None
    results = _relight_each(
        photo,
        faces,
        watch,
        reference=others,
        reference_landmarks=there,
        second_reference=beside,
        second_landmarks=marks,
        region_mask=area,
        options=settings,
    )
    result = results[-1]
    folded = max((one.alignment.folded for one in result.lightings if one.alignment), default=0.0)
    warn_of_folds(folded)
    warn_of_confidence(result.confidence)
    with progress("Writing"), watch("write"):
        pictures = _stage_files(result) if folder else {}
        write_results(output, results, like=photo, overwrite=force)
        if sheet is not None:
            from relit.figures import comparison_sheet

            write_image(sheet, comparison_sheet(result), overwrite=force)
        written = folder.save(pictures) if folder else []
    if timings:
        show_timings(watch.seconds)
    triples = zip(theirs, others, there, strict=True)
    described = [about(source.path, other, face) for source, other, face in triples]
    report(
        as_json,
        output=output,
        sheet=sheet,
        stages=written,
        target=_alone([about(ours.path, photo, face) for face in faces]),
        reference=_alone(described),
        lambda_px=result.lam,
        factor=result.view.factor,
        folded=folded,
        confidence=result.confidence,
        smoothing=result.first.alignment.smoothing if result.first.alignment else None,
        seconds=watch.seconds,
        options=asdict(settings),
    )


def _load() -> None:
    """Import what relights in a thread, while photos are decoded, which leaves Python's lock to others."""
    import relit.face.detect  # noqa: F401 (what this thread needs meanwhile, so that neither waits in a circle)

    threading.Thread(target=import_module, args=("relit.relighting",)).start()


def _sources(
    given: dict[str, Any], target: str, references: tuple[str, ...], saved: Settings, *, swap: bool
) -> list[Source]:
    """Return the target, then the references, each with the options that say where its face is."""
    landmarks, faces = given.pop("reference_landmarks"), given.pop("reference_face")
    for flag, values in (("landmarks", landmarks), ("face", faces)):
        if len(values) not in (0, len(references)):
            raise click.UsageError(
                f"--reference-{flag} was given {len(values)} times for {len(references)} photos; give it "
                "once for each, in their order, or not at all."
            )
    each = zip_longest(references, landmarks, faces)
    sources = [Source.of(given, "target", target), *(Source("reference", *one) for one in each)]
    sources[:2] = [source.knowing(getattr(saved, source.argument)) for source in sources[:2]]
    if swap and len(references) != 1:
        raise click.UsageError("--swap takes one REFERENCE.")
    return sources[::-1] if swap else sources


def _read_mask(path: str) -> NDArray[Any]:
    """Return the lightness of a mask, which may have been saved with colours."""
    pixels = read_image(path).pixels
    if pixels.ndim == 2:
        return pixels
    if (pixels != pixels[..., :1]).any():
        raise ImageError(f"{path}: expected a grey picture as --region-mask, found colours; save it in grey")
    return pixels[..., 0].copy()


def _find_faces(
    photos: list[tuple[Source, Photo]], *, all_faces: bool
) -> tuple[list[Landmarks], list[Landmarks]]:
    """Return the faces to relight in the target, which comes first, and the one in each reference."""
    from relit.face.detect import detect_faces
    from relit.runtime.threads import pool

    (_, target), *references = photos
    faces = detect_faces(target.pixels, name="target") if all_faces else []
    with pool(2) as at_once:  # looks at the target again where it has none, to say what to do then
        found = at_once(lambda pair: pair[0].face_in(pair[1]), references if faces else photos)
    return (faces, found) if faces else (found[:1], found[1:])


def _relight_each(
    photo: Photo, faces: list[Landmarks], watch: Stopwatch, **given: Any
) -> list[TransferResult]:
    """Relight one face after the other, each in what came of those before."""
    from relit.relighting import transfer as relight

    results: list[TransferResult] = []
    for face in faces:
        with solving("Relighting"):
            results.append(relight(photo, target_landmarks=face, **given))
        photo = replace(photo, pixels=results[-1].image)
        for stage, seconds in results[-1].seconds.items():
            watch.add(stage, seconds)
    return results


def _stage_files(result: TransferResult) -> dict[str, NDArray[Any]]:
    """Return the pictures of all stages by the names of their files."""
    from relit.figures import contact_sheet, stage_pictures

    pictures = stage_pictures(result)
    sheet = contact_sheet(result, pictures)
    return {f"{name}.png": picture for name, picture in (pictures | {"sheet": sheet}).items()}


def _alone(values: list[Any]) -> Any:
    """Return the one value itself, of several a list."""
    return values[0] if len(values) == 1 else values
