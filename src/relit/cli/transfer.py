"""The command ``relit transfer``: relight a face."""

from __future__ import annotations

import threading
from dataclasses import asdict, replace
from importlib import import_module
from typing import TYPE_CHECKING, Any

import click
import numpy as np

from relit.cli.destinations import PictureFolder, check_apart
from relit.cli.groups import GroupedCommand, Option
from relit.cli.kinds import FILE, FOLDER
from relit.cli.many import batch_command
from relit.cli.options import (
    check_heeded,
    check_streams,
    face_options,
    force_option,
    json_option,
    settings_of,
    transfer_options,
)
from relit.cli.sources import Source, about, find_faces, read_mask, read_photo, sources_of
from relit.cli.telling import (
    is_verbose,
    loudness_options,
    progress,
    report,
    say,
    say_face,
    show_timings,
    solving,
    warn_of_confidence,
    warn_of_folds,
    warn_of_losses,
)
from relit.errors import OptionError
from relit.photo.writing import check_destination, write_image
from relit.result_files import check_results_destination, not_kept_of, write_results
from relit.runtime.allocator import keep_freed_memory
from relit.runtime.timing import Stopwatch
from relit.settings.options import TransferOptions
from relit.settings_file import Settings, read_settings

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from relit.face.landmarks import Landmarks
    from relit.photo.photo import Photo
    from relit.results import TransferResult


@click.command(
    cls=GroupedCommand,
    examples=(
        "relit transfer me.jpg film.jpg -o relit.jpg",
        "relit transfer me.jpg --light rembrandt --softness 50% -o relit.jpg",
        "relit transfer me.jpg film.jpg --strength 80% --tint keep -o relit.jpg",
        "relit transfer friends.jpg --light loop --all-faces -o relit.jpg",
    ),
)
@click.argument("target", type=FILE)
@click.argument("references", metavar="[REFERENCE]...", nargs=-1, type=FILE)
@click.option("-o", "--output", type=FILE, metavar="FILE", help="Photo to write; - is stdout.  [required]")
@transfer_options()
@click.option(
    "--region-mask",
    cls=Option,
    group="where",
    type=FILE,
    metavar="FILE",
    help="A picture of TARGET's size, white where it is to be relit and black where not.",
)
@click.option(
    "--all-faces",
    cls=Option,
    group="where",
    is_flag=True,
    help="Relight every face of TARGET, the largest first.",
)
@face_options("target", "target_")
@face_options("reference", "reference_", several=True)
@click.option("--swap", is_flag=True, help="Swap the roles: relight REFERENCE with the light of TARGET.")
@click.option(
    "--second-reference",
    cls=Option,
    group="expert",
    title="Second reference, for methods that take one",
    type=FILE,
    metavar="FILE",
    help="For methods that take one: REFERENCE's face in TARGET's light.",
)
@face_options("second reference", "second_", group="expert")
@click.option(
    "--config",
    type=FILE,
    metavar="FILE",
    help="Settings that the studio saved. Options given here take precedence.",
)
@click.option(
    "--sheet",
    type=FILE,
    metavar="PICTURE",
    help="Also draw target, reference and result side by side, and their light.",
)
@click.option(
    "--changed",
    type=FILE,
    metavar="PICTURE",
    help="Also save a mask for layers: white where TARGET was changed, black elsewhere.",
)
@click.option(
    "--stages",
    type=FOLDER,
    metavar="DIR",
    help="Also save every stage, and a sheet of all, here.",
)
@force_option
@loudness_options
@click.option("--timings", is_flag=True, help="Show on stderr how long each stage took.")
@json_option
def transfer(
    target: str,
    references: tuple[str, ...],
    output: str | None,
    all_faces: bool,
    swap: bool,
    second_reference: str | None,
    config: str | None,
    region_mask: str | None,
    stages: str | None,
    sheet: str | None,
    changed: str | None,
    timings: bool,
    force: bool,
    as_json: bool,
    **given: Any,
) -> None:
    """Relight the face in TARGET with the light of the face in REFERENCE, or with --light.

    Both are photos; one may be - for stdin. Of several REFERENCEs, the median of the changes of light counts.
    For many TARGETs there is relit batch.
    """
    saved = read_settings(config) if config else Settings(TransferOptions())
    ours, *theirs = sources_of(given, target, references, saved, swap=swap)
    second = Source.of(given, "second", second_reference or "")
    settings = settings_of(given, saved.options)
    if settings.light is not None and theirs:
        told = batch_command((target, *references), output, settings)
        raise OptionError(f"Give a REFERENCE, or --light, and not both. To relight all of them: {told}")
    if output is None:
        raise click.UsageError("Missing option '-o' / '--output'.")
    check_heeded(settings)
    check_streams(output, as_json, target, *references, second_reference or "")
    if settings.light is None and not theirs:
        raise click.UsageError("Give a REFERENCE, or --light, and not both.")
    if second.face_is_given and not second.path:
        raise click.UsageError("--second-landmarks and --second-face belong to a --second-reference.")
    if all_faces and (ours.face_is_given or stages or sheet):
        raise click.UsageError("--all-faces goes with no --face, --target-landmarks, --stages or --sheet.")

    folder = None
    if stages is not None:
        from relit.figures import STAGES

        folder = PictureFolder(stages, [f"{name}.png" for name in (*STAGES, "sheet")], force)
    check_apart(
        output,
        {"--sheet": [sheet], "--changed": [changed], "--stages": folder.files if folder else ()},
        (region_mask, config, *(file for one in (ours, *theirs, second) for file in one.files)),
    )
    if sheet is not None:
        check_streams(sheet, as_json)
        check_destination(sheet, overwrite=force)
    if changed is not None:
        check_streams(changed, as_json)
        check_destination(changed, overwrite=force)
    watch = Stopwatch()
    keep_freed_memory()
    _load()
    with progress("Reading the photos"), watch("read"):
        # One by one: a file that never ends can be interrupted here, but not in a thread.
        photo, *others = [read_photo(source.path) for source in (ours, *theirs)]
        beside = read_photo(second.path) if second.path else None
        area = read_mask(region_mask) if region_mask else None
    check_results_destination(output, like=photo, overwrite=force)
    with progress("Finding the faces"), watch("find the faces"):
        faces, there = find_faces([(ours, photo), *zip(theirs, others, strict=True)], all_faces=all_faces)
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
        if changed is not None:
            from relit.layering import before_and_after, changed_area

            where = changed_area(*before_and_after(results, photo))
            write_image(changed, where * np.uint8(255), overwrite=force)
        written = folder.save(pictures) if folder else []
    lost = not_kept_of(output, photo)
    warn_of_losses(output, lost)
    triples = zip(theirs, others, there, strict=True)
    described = [about(source.path, other, face) for source, other, face in triples]
    of_target = [about(ours.path, photo, face) for face in faces]
    for facts in (*of_target, *described):
        say_face(facts)
    say(f"light: confidence {result.confidence:.2f}, 1/λ {1 / result.lam:.1f} px")
    if timings or is_verbose():
        show_timings(watch.seconds)
    light = settings.light or "of " + " and ".join(source.name for source in theirs)
    report(
        as_json,
        f"{'all faces' if all_faces else 'the face'} of {ours.name} under the light {light}",
        output=output,
        sheet=sheet,
        changed=changed,
        stages=written,
        target=_alone(of_target),
        reference=_alone(described),
        lambda_px=result.lam,
        factor=result.view.factor,
        folded=folded,
        confidence=result.confidence,
        not_kept=[*lost],
        smoothing=result.first.alignment.smoothing if result.first.alignment else None,
        seconds=watch.seconds,
        options=asdict(settings),
    )


def _load() -> None:
    """Import what relights in a thread, while photos are decoded, which leaves Python's lock to others."""
    import relit.face.detect  # noqa: F401 (what this thread needs meanwhile, so that neither waits in a circle)

    threading.Thread(target=import_module, args=("relit.relighting",)).start()


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
