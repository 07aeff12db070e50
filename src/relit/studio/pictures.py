"""What a session's photos become: previews at the size of a screen, and files at the photo's own."""

from __future__ import annotations

import copy
import io
import math
import zipfile
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from relit.errors import LandmarkError
from relit.face.landmark_files import landmarks_as_bytes
from relit.face.landmarks import Landmarks
from relit.face.regions import FaceRegions
from relit.figures import view_makers
from relit.photo.atomic_files import NamedBytes
from relit.photo.photo import Photo
from relit.photo.pixels import from_unit, to_unit
from relit.photo.resampling import reduced
from relit.relighting import transfer
from relit.result_files import check_results_destination, not_kept_of, write_results
from relit.results import TransferResult
from relit.runtime.memo import doing_once, remembered
from relit.settings.options import PARTS, TransferOptions
from relit.settings_file import Settings, as_json
from relit.studio import needs
from relit.studio.session import ROLES, Portrait, Session, StudioError

Seat = tuple[Photo, Landmarks]
Faces = dict[str, Seat]

#: Names of the views, in the order in which they are shown; a method has some of them.
VIEWS = (
    *("result", "warped", "target_light", "new_light", "person"),
    *("target_u", "target_v", "reference_u", "reference_v", "mask", "known", "difference"),
)

_ENDINGS = {".exr": ".layers.exr"}  # of exported files, where another than the format's
_SQUARES, _GREYS = 64, (0.75, 0.9)  # on a side, and their shades: the chequer behind what is transparent
_LOOKED_AT = 40.0  # px between the eyes at which a part of a face is told: its edges are soft
#: The longest side in px of a preview that is one of many.
THUMBNAIL = 256


class Asked(Protocol):
    """What a preview is asked to be: at most so many px long, a sketch, by which reference at hand."""

    side: int
    quick: bool
    reference: str | None


class Ordered(Protocol):
    """What an export is asked to be: in which format, of which target and by which reference at hand."""

    target: str | None
    reference: str | None

    @property
    def format(self) -> str: ...  # noqa: D102


def preview_of(portrait: Portrait, side: int) -> Photo:
    """Return the photo in sRGB, its longest side at most so many px and reduced by a whole factor."""
    if side not in portrait.previews:
        photo = portrait.photo
        factor = _factor(photo, side)
        alpha = None if photo.alpha is None else reduced(photo.alpha, factor)
        small = replace(photo, pixels=reduced(photo.pixels, factor), alpha=alpha).to_profile(None)
        if len(portrait.previews) > 2:
            portrait.previews.clear()
        portrait.previews[side] = replace(small, pixels=from_unit(to_unit(small.pixels), np.uint8))
    return portrait.previews[side]


def _factor(photo: Photo, side: int) -> int:
    longest: int = max(photo.pixels.shape[:2])
    return math.ceil(longest / side)


def rendered(
    session: Session, options: TransferOptions, asked: Asked, go_on: Callable[[], None]
) -> tuple[TransferResult, int, NDArray[Any] | None]:
    """Relight the session's target at the size of a preview; return by how much that was reduced, too.

    The last is the opacity at that size, if the photo has one.

    Before each step `go_on` is called: what it raises ends the work.
    """
    go_on()
    session = copy.copy(session)  # with what it has now: a photo may be exchanged meanwhile
    target = session.portrait("target", needed=True)
    with (session.small if asked.side <= THUMBNAIL else session.memo).open(go_on):
        faces = _faces(session, options, asked.side, asked.reference)
        result = _relit(faces, options, _detail(options, asked))
    return result, _factor(target.photo, asked.side), faces["target"][0].alpha


def _detail(options: TransferOptions, asked: Asked) -> float:
    return options.record.sketch_iod if asked.quick else options.record.preview_iod


def memory_of_preview(session: Session, options: TransferOptions, asked: Asked) -> int:
    """Return the bytes that `rendered` takes; raise a `StudioError` if a photo or its face is missing."""
    ready = [session.ready(role, asked.reference) for role in _roles(options)]
    photos = [(portrait.photo, marks) for portrait, marks in ready]
    first, *_, last = [_factor(photo, asked.side) for photo, _ in photos] * 2
    return needs.of_transfer(*_pair(photos), options, smaller=(first, last), detail=_detail(options, asked))


def memory_of_export(session: Session, options: TransferOptions, ordered: Ordered) -> int:
    """Return the bytes that `exported` takes, or with a target `exported_at_hand`; raise as they do."""
    faces = _ordered(session, options, ordered)
    return needs.of_transfer(*_pair(list(faces.values())), options, suffix=ordered.format)


def exported(
    session: Session, options: TransferOptions, ordered: Ordered, go_on: Callable[[], None] = lambda: None
) -> bytes:
    """Return what ``relit transfer --config settings.json`` makes of the same photos, and what it takes.

    Before each step `go_on` is called: what it raises ends the work.
    """
    faces = _ordered(session, options, ordered)
    image = _file_of(faces, options, ordered.format, go_on)
    landmarks = {role: marks for role, (_, marks) in faces.items()}
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w") as archive:
        archive.writestr(image.name, image.getvalue())
        for role, marks in landmarks.items():
            archive.writestr(f"{role}.json", landmarks_as_bytes(f"{role}.json", marks))
        archive.writestr("settings.json", as_json(Settings(options, **landmarks)))
    return packed.getvalue()


def exported_at_hand(
    session: Session, options: TransferOptions, ordered: Ordered, go_on: Callable[[], None]
) -> bytes:
    """Return the file of another photo, one at hand, in the same light; as `exported` does."""
    return _file_of(_ordered(session, options, ordered), options, ordered.format, go_on).getvalue()


def _ordered(session: Session, options: TransferOptions, ordered: Ordered) -> Faces:
    if ordered.target is None:
        return _faces(session, options, reference=ordered.reference)
    ready = {role: session.ready(role, ordered.reference) for role in _roles(options)[1:]}
    portrait = session.in_gallery(ordered.target, needed=True)
    ready = {"target": (portrait, portrait.face("target"))} | ready
    return {role: (one.photo, marks) for role, (one, marks) in ready.items()}


def lost_in_export(session: Session, suffix: str, target: str | None) -> tuple[str, ...]:
    """Return, in words, what the target holds that a file of an export cannot."""
    portrait = session.portrait("target", needed=True) if target is None else session.in_gallery(target)
    lost = not_kept_of(NamedBytes(_name_of(suffix)), portrait.photo)
    return lost if _exportable(portrait.photo, suffix) is portrait.photo else ("transparency", *lost)


def _exportable(target: Photo, suffix: str) -> Photo:
    """Return a target as an export can hold it: who chose JPEG on a page is told, and not refused."""
    return replace(target, alpha=None) if suffix == ".jpg" and target.alpha is not None else target


def _name_of(suffix: str) -> str:
    return f"relit{_ENDINGS.get(suffix, suffix)}"


def _file_of(faces: Faces, options: TransferOptions, suffix: str, go_on: Callable[[], None]) -> NamedBytes:
    """Return the relit photo at its full size as a file."""
    like, image = _exportable(faces["target"][0], suffix), NamedBytes(_name_of(suffix))
    check_results_destination(image, like=like)
    with doing_once(go_on):
        result = _relit(faces, options)
    go_on()
    write_results(image, [result], like=like)
    go_on()
    return image


def _faces(
    session: Session, options: TransferOptions, side: int | None = None, reference: str | None = None
) -> Faces:
    """Return the photos of a transfer and their landmarks by role, at the size of a preview if it is one."""
    ready = {role: session.ready(role, reference) for role in _roles(options)}
    if side is None:
        return {role: (portrait.photo, marks) for role, (portrait, marks) in ready.items()}
    return {
        role: (preview_of(portrait, side), marks.reduced(_factor(portrait.photo, side)))
        for role, (portrait, marks) in ready.items()
    }


def _roles(options: TransferOptions) -> tuple[str, ...]:
    return ROLES if options.light is None else ROLES[:1]


def _pair(photos: list[Seat]) -> tuple[Seat, Seat | None]:
    return photos[0], photos[1] if len(photos) > 1 else None


@remembered
def _relit(faces: Faces, options: TransferOptions, detail: float | None = None) -> TransferResult:
    (target, landmarks), *references = faces.values()
    return transfer(
        target,
        [photo for photo, _ in references] or None,
        target_landmarks=landmarks,
        reference_landmarks=[marks for _, marks in references] or None,
        options=options,
        detail=detail,
    )


def part_at(portrait: Portrait, x: float, y: float) -> str | None:
    """Return the part of the face that a place of a photo, in px, is in; None off the face."""
    face = portrait.face("target")
    factor = _part_factor(face)
    height, width = portrait.photo.pixels.shape[:2]
    regions = FaceRegions(face.reduced(factor), (height // factor + 1, width // factor + 1))
    row, column = (min(int(at / factor), end - 1) for at, end in zip((y, x), regions.shape, strict=True))
    try:
        shares = {
            part: float(regions.parts(part)[row, column]) for part in PARTS if part not in ("left", "right")
        }
    except LandmarkError as error:  # of points by hand
        raise StudioError(409, "no_face", str(error).removeprefix("region: ")) from None
    part = max(shares, key=shares.__getitem__)
    return part if shares[part] > 0 else None


def memory_of_part(portrait: Portrait) -> int:
    """Return the bytes that `part_at` takes; raise a `StudioError` if there are no landmarks."""
    factor = _part_factor(portrait.face("target"))
    height, width = portrait.photo.pixels.shape[:2]
    return needs.of_showing(width // factor, height // factor)


def _part_factor(face: Landmarks) -> int:
    return max(int(face.interocular_distance / _LOOKED_AT), 1)


def views_of(result: TransferResult) -> dict[str, Callable[[], NDArray[Any]]]:
    """Return what makes the pictures of a transfer, by the names of their views."""
    makers = view_makers(result)
    makers |= {
        "result": lambda: result.image,
        "warped": makers["warped_reference"],
        "difference": partial(_difference, result),
    }
    return {view: makers[view] for view in VIEWS if view in makers}


def _difference(result: TransferResult) -> NDArray[np.uint8]:
    before, after = to_unit(result.target), to_unit(result.image)
    if before.ndim < after.ndim:
        before = before[..., None]
    return from_unit((after - before) / 2 + 0.5, np.uint8)


def window_of(result: TransferResult, view: str) -> tuple[float, float, float, float]:
    """Return left, top, width and height of what a view shows, as shares of the target's."""
    if view in ("result", "difference"):
        return 0, 0, 1, 1
    height, width = result.target.shape[:2]
    (top, bottom), (left, right) = ((part.start, part.stop) for part in result.window)
    return left / width, top / height, (right - left) / width, (bottom - top) / height


def jpeg(pixels: NDArray[Any], alpha: NDArray[Any] | None = None) -> bytes:
    """Return pixels as a JPEG; where they are transparent, a chequer is seen through them."""
    seen = to_unit(pixels)
    if alpha is not None:
        row, column = np.ogrid[: alpha.shape[0], : alpha.shape[1]]
        size = max(max(alpha.shape) // _SQUARES, 1)  # alike at every size of a photo
        squares = np.where((row // size + column // size) % 2, *_GREYS).astype(np.float32)
        share = to_unit(alpha)
        if seen.ndim == 3:
            squares, share = squares[..., None], share[..., None]
        seen = squares + share * (seen - squares)
    buffer = io.BytesIO()
    Image.fromarray(from_unit(seen, np.uint8)).save(buffer, "JPEG", quality=90)
    return buffer.getvalue()
