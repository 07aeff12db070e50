"""The command line: files in, files out, and nothing that the library cannot do.

Exit codes: 0 done, 1 failed, 2 wrong usage, 130 interrupted. Photos and JSON go to stdout, all else to
stderr; progress is shown on a terminal only.
"""

from __future__ import annotations

import contextlib
import json
import sys
from dataclasses import asdict, fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from relit import __version__
from relit.errors import OptionError, OutputError, RelitError
from relit.options import TransferOptions

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from numpy.typing import NDArray

    from relit.image import Photo
    from relit.landmarks import Landmarks

_ALIGNMENT = ("kernel", "affine", "smoothing")
_SPLIT = ("lam", "neighborhood")


def main(arguments: list[str] | None = None) -> None:
    """Run the command line and exit with its code."""
    try:
        code = relit.main(arguments, prog_name="relit", standalone_mode=False)
    except click.ClickException as error:
        error.show()
        code = error.exit_code
    except RelitError as error:
        click.echo(f"relit: error: {error}", err=True)
        code = 2 if isinstance(error, OptionError) else 1
    except (KeyboardInterrupt, click.Abort):
        click.echo("relit: interrupted", err=True)
        code = 130
    except MemoryError:
        click.echo("relit: error: not enough memory for photos of this size; try smaller ones", err=True)
        code = 1
    sys.exit(code or 0)


@click.group(context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(__version__, prog_name="relit")
def relit() -> None:
    """Carry the light of one face photo to another.

    The TARGET keeps the person, the REFERENCE gives the light. Faces are found automatically; landmarks
    placed by hand can be given instead. Photos are JPEG, PNG, TIFF, WebP, PPM/PGM or BMP.

    \b
    Start here:
      relit samples photos
      relit transfer photos/target.png photos/reference.jpg -o relit.png
    """  # noqa: D301 (click reads the backspace as «do not wrap»)


def _options(*names: str) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """Add the named transfer options, or all, to a command; the command gets them by field name."""

    def decorate(command: Callable[..., None]) -> Callable[..., None]:
        for option in reversed(fields(TransferOptions)):
            if names and option.name not in names:
                continue
            flag, choices = option.metadata["flag"], option.metadata["choices"]
            kind: click.ParamType[Any] | None
            if isinstance(option.default, bool):
                flag, kind = f"{flag}/{flag.replace('--', '--no-')}", None
            elif choices:
                kind = click.Choice([str(choice) for choice in choices])
            else:
                kind = click.STRING if isinstance(option.default, str) else click.FLOAT
            default = str(option.default) if choices else option.default
            command = click.option(
                flag, option.name, type=kind, default=default, show_default=True, help=option.metadata["help"]
            )(command)
        return command

    return decorate


def _settings(given: dict[str, Any]) -> TransferOptions:
    """Return options from what the command line gave; choices come back as the values they stand for."""
    known = {option.name: option for option in fields(TransferOptions)}
    values = {}
    for name, value in given.items():
        meant = [choice for choice in known[name].metadata["choices"] if str(choice) == value]
        values[name] = meant[0] if meant else value
    return TransferOptions(**values)


_output = click.option("-o", "--output", required=True, metavar="FILE", help="Photo to write; - is stdout.")
_force = click.option("--force", is_flag=True, help="Replace files that exist.")
_json = click.option("--json", "as_json", is_flag=True, help="Print what was done, as JSON, on stdout.")


def _face(role: str, prefix: str) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """Add the options that say where the face of one photo is."""

    def decorate(command: Callable[..., None]) -> Callable[..., None]:
        flag = prefix.replace("_", "-")
        short = ["--face"] if role == "target" else []
        command = click.option(
            *short,
            f"--{flag}face",
            f"{prefix}face",
            type=click.IntRange(min=0),
            metavar="N",
            help=f"Which face of the {role}: 0 is the largest, 1 the next. [default: 0]",
        )(command)
        return click.option(
            f"--{flag}landmarks",
            f"{prefix}landmarks",
            type=click.Path(),
            metavar="FILE",
            help=f"Landmarks of the {role}, instead of detected ones: .pts, .tem, .json, .csv or .xml.",
        )(command)

    return decorate


@relit.command()
@click.argument("target")
@click.argument("reference")
@_output
@_face("target", "target_")
@_face("reference", "reference_")
@click.option("--swap", is_flag=True, help="Swap the roles: relight REFERENCE with the light of TARGET.")
@_options()
@click.option("--stages", metavar="DIR", help="Save every stage, and a contact sheet of all, in this folder.")
@_force
@_json
def transfer(
    target: str,
    reference: str,
    output: str,
    target_landmarks: str | None,
    target_face: int | None,
    reference_landmarks: str | None,
    reference_face: int | None,
    swap: bool,
    stages: str | None,
    force: bool,
    as_json: bool,
    **given: Any,
) -> None:
    """Relight the face in TARGET with the light of the face in REFERENCE.

    TARGET and REFERENCE are photos; one of them may be - for stdin.
    """
    from relit.figures import STAGES, contact_sheet, stage_pictures
    from relit.image import check_destination, write_image
    from relit.relighting import transfer as run

    settings = _settings(given)
    _check_streams(output, as_json, target, reference)
    of_target = (target, target_landmarks, target_face)
    of_reference = (reference, reference_landmarks, reference_face)
    if swap:
        of_target, of_reference = of_reference, of_target
    folder = _Folder(stages, [f"{name}.png" for name in (*STAGES, "sheet")], force) if stages else None
    with _progress("Reading the photos"):
        photo, light = _read(of_target[0]), _read(of_reference[0])
    check_destination(output, like=photo, overwrite=force)
    with _progress("Finding the faces"):
        here = _landmarks(photo, *of_target[1:], "target")
        there = _landmarks(light, *of_reference[1:], "reference")
    with _progress("Relighting"):
        result = run(photo, light, target_landmarks=here, reference_landmarks=there, options=settings)
    _warn_of_folds(result.alignment.folded)
    with _progress("Writing"):
        pictures = stage_pictures(result) | {"sheet": contact_sheet(result)} if folder else {}
        saved = folder.save({f"{name}.png": picture for name, picture in pictures.items()}) if folder else []
        write_image(output, result.image, like=photo, overwrite=force)
    _report(
        as_json,
        output=output,
        stages=saved,
        target=_about(of_target[0], photo, here),
        reference=_about(of_reference[0], light, there),
        lambda_px=result.target_split.lam,
        smoothing=result.alignment.smoothing,
        folded=result.alignment.folded,
        options=asdict(settings),
    )


@relit.command()
@click.argument("target")
@click.argument("reference")
@_output
@_face("target", "target_")
@_face("reference", "reference_")
@_options(*_ALIGNMENT)
@_force
@_json
def align(
    target: str,
    reference: str,
    output: str,
    target_landmarks: str | None,
    target_face: int | None,
    reference_landmarks: str | None,
    reference_face: int | None,
    force: bool,
    as_json: bool,
    **given: Any,
) -> None:
    """Warp REFERENCE so that its face lies on the face in TARGET."""
    from relit.alignment import align as run
    from relit.image import check_destination, write_image

    settings = _settings(given)
    _check_streams(output, as_json, target, reference)
    with _progress("Reading the photos"):
        photo, light = _read(target), _read(reference)
    check_destination(output, like=_without_alpha(light), overwrite=force)
    with _progress("Finding the faces"):
        here = _landmarks(photo, target_landmarks, target_face, "target")
        there = _landmarks(light, reference_landmarks, reference_face, "reference")
    with _progress("Aligning"):
        alignment = run(
            light.pixels,
            there,
            here,
            photo.pixels.shape,
            kernel=settings.kernel,  # type: ignore[arg-type]
            affine=settings.affine,
            smoothing=settings.smoothing,
        )
    _warn_of_folds(alignment.folded)
    write_image(output, alignment.warped, like=_without_alpha(light), overwrite=force)
    _report(
        as_json,
        output=output,
        target=_about(target, photo, here),
        reference=_about(reference, light, there),
        smoothing=alignment.smoothing,
        folded=alignment.folded,
    )


@relit.command()
@click.argument("image")
@click.option("-o", "--output", required=True, metavar="DIR", help="Folder for u.png and v.png.")
@_face("photo", "")
@click.option(
    "--eye-distance",
    type=click.FLOAT,
    metavar="PX",
    help="Distance of the eyes in px, which sets the scale of lambda, instead of finding the face; at 100, "
    "lambda is in 1/px.",
)
@_options(*_SPLIT)
@_force
@_json
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
    from relit.figures import split_pictures
    from relit.ltv import decompose as run

    settings = _settings(given)
    if eye_distance is not None and (landmarks or face is not None):
        raise click.UsageError("--eye-distance stands in for the face; give it, or --landmarks and --face.")
    folder = _Folder(output, ("u.png", "v.png"), force)
    photo = _read(image)
    if eye_distance is None:
        with _progress("Finding the face"):
            eye_distance = _landmarks(photo, landmarks, face, "image").interocular_distance
    with _progress("Splitting"):
        split = run(
            photo.pixels, settings.lam, neighborhood=settings.neighborhood, interocular_distance=eye_distance
        )
    u, v = split_pictures(split)
    saved = folder.save({"u.png": u, "v.png": v})
    _report(as_json, output=saved, lambda_px=split.lam, eye_distance=eye_distance)


@relit.command()
@click.argument("image")
@click.option(
    "-o", "--output", metavar="FILE", help="File to write: .pts, .tem, .json, .ljson, .csv or .xml."
)
@click.option("--overlay", metavar="PICTURE", help="Also draw the landmarks into the photo, as this file.")
@click.option(
    "--face", type=click.IntRange(min=0), metavar="N", help="Which face: 0 is the largest. [default: 0]"
)
@_force
@_json
def landmarks(
    image: str, output: str | None, overlay: str | None, face: int | None, force: bool, as_json: bool
) -> None:
    """Find the 478 landmarks of the face in IMAGE."""
    from relit.figures import landmark_overlay
    from relit.files import check_free
    from relit.image import check_destination, write_image
    from relit.landmark_files import write_landmarks

    if not (output or overlay or as_json):
        raise click.UsageError("Nothing to do: give -o FILE, --overlay PICTURE or --json.")
    if overlay:
        _check_streams(overlay, as_json)
        check_destination(overlay, overwrite=force)
    if output:
        check_free(Path(output), overwrite=force)
    photo = _read(image)
    with _progress("Finding the face"):
        found = _landmarks(photo, None, face, "image")
    if output:
        write_landmarks(output, found, overwrite=force, image_name=Path(image).name)
    if overlay:
        picture = landmark_overlay(photo.pixels, found)
        write_image(overlay, picture, like=_without_alpha(photo), overwrite=force)
    _report(
        as_json,
        output=output,
        overlay=overlay,
        image=_about(image, photo, found),
        points=found.points.round(3).tolist() if as_json and not output else None,
    )


@relit.command()
@click.argument("folder", metavar="DIR")
@_force
@_json
def samples(folder: str, force: bool, as_json: bool) -> None:
    """Copy sample photos into the folder DIR, to try relit on."""
    from relit.samples import copy_samples

    _report(as_json, output=[str(path) for path in copy_samples(Path(folder), overwrite=force)])


class _Folder:
    """A folder for several pictures; refused before any work goes into them."""

    def __init__(self, path: str, names: Sequence[str], force: bool) -> None:
        from relit.files import check_free

        self.path, self.force = Path(path), force
        if self.path.is_dir():
            for name in names:
                check_free(self.path / name, overwrite=force)
        elif self.path.exists():
            raise OutputError(f"{path}: is not a folder; choose another name")
        elif not self.path.parent.is_dir():
            raise OutputError(
                f"{path}: there is no folder {self.path.parent}; create it, or choose another name"
            )

    def save(self, pictures: dict[str, NDArray[Any]]) -> list[str]:
        """Write the pictures and return their paths."""
        from relit.image import write_image

        self.path.mkdir(exist_ok=True)
        for name, picture in pictures.items():
            write_image(self.path / name, picture, overwrite=self.force)
        return [str(self.path / name) for name in pictures]


def _read(path: str) -> Photo:
    from relit.image import read_image
    from relit.pixels import check_pixels

    photo = read_image(path)
    check_pixels(photo.pixels, path)
    return photo


def _without_alpha(photo: Photo) -> Photo:
    return replace(photo, alpha=None)


def _landmarks(photo: Photo, path: str | None, face: int | None, role: str) -> Landmarks:
    from relit.detect import detect_landmarks
    from relit.landmark_files import read_landmarks

    if path is not None:
        return read_landmarks(path, face=face)
    return detect_landmarks(photo.pixels, face=face or 0, name=role)


def _check_streams(output: str, as_json: bool, *inputs: str) -> None:
    if output == "-" and as_json:
        raise click.UsageError("stdout cannot take both the photo and --json; write the photo to a file.")
    if inputs.count("-") > 1:
        raise click.UsageError("stdin holds one photo; give the other as a file.")


def _warn_of_folds(folded: float) -> None:
    if folded > 0:
        click.echo(
            f"relit: warning: the alignment turns over on {folded:.1%} of the frame; check the landmarks, or "
            "raise --smoothing",
            err=True,
        )


def _about(path: str, photo: Photo, found: Landmarks) -> dict[str, Any]:
    height, width = photo.pixels.shape[:2]
    return {
        "path": path,
        "width": width,
        "height": height,
        "scheme": found.scheme,
        "confidence": found.confidence,
        "interocular_distance": found.interocular_distance,
    }


@contextlib.contextmanager
def _progress(step: str) -> Iterator[None]:
    """Show what is going on, on a terminal only."""
    if not sys.stderr.isatty():
        yield
        return
    from rich.console import Console

    with Console(stderr=True).status(f"{step} ..."):
        yield


def _report(as_json: bool, **facts: Any) -> None:
    """Print the facts as JSON, or on a terminal the names of the files."""
    if as_json:
        click.echo(json.dumps({name: fact for name, fact in facts.items() if fact not in (None, [])}))
    elif sys.stderr.isatty():
        for place in (facts.get("output"), facts.get("overlay"), facts.get("stages")):
            for path in [place] if isinstance(place, str) else place or []:
                click.echo(f"wrote {path}", err=True)
