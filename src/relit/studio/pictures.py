"""What the page shows: photos at the size of a screen, and the views of a transfer."""

from __future__ import annotations

import io
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from PIL import Image

from relit.figures import view_pictures
from relit.photo.pixels import from_unit, to_unit
from relit.photo.resampling import reduced
from relit.relighting import transfer
from relit.runtime.memo import remembered
from relit.studio.sessions import Session, Sitter

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from relit.face.landmarks import Landmarks
    from relit.photo.photo import Photo
    from relit.results import TransferResult
    from relit.settings.options import TransferOptions

#: Names of the views, in the order in which they are shown; a method has some of them.
VIEWS = {
    "result": "result",
    "warped": "warped_reference",
    "target_light": "target_light",
    "new_light": "new_light",
    "person": "person",
    "target_u": "target_u",
    "target_v": "target_v",
    "reference_u": "reference_u",
    "reference_v": "reference_v",
    "mask": "mask",
    "known": "known",
    "difference": "difference",
}

_QUALITY = 90


def preview_of(sitter: Sitter, side: int) -> Photo:
    """Return the photo in sRGB, its longest side at most so many px and reduced by a whole factor."""
    if side not in sitter.previews:
        photo = replace(sitter.photo, alpha=None)
        factor = max(1, -(-max(photo.pixels.shape[:2]) // side))
        small = replace(photo, pixels=reduced(photo.pixels, factor)).to_profile(None)
        if len(sitter.previews) > 2:
            sitter.previews.clear()
        sitter.previews[side] = replace(small, pixels=from_unit(to_unit(small.pixels), np.uint8))
    return sitter.previews[side]


def rendered(
    session: Session, options: TransferOptions, side: int, *, quick: bool
) -> tuple[TransferResult, int]:
    """Relight the session's target at the size of a preview; return by how much that was reduced, too."""
    target, here, factor = _at_size(session, "target", side)
    lights = [] if options.light is not None else [_at_size(session, "reference", side)]
    detail = options.record.sketch_iod if quick else options.record.preview_iod
    return _relit(target, here, lights, options, detail), factor


@remembered
def _relit(
    target: Photo,
    landmarks: Landmarks,
    lights: list[tuple[Photo, Landmarks, int]],
    options: TransferOptions,
    detail: float,
) -> TransferResult:
    return transfer(
        target,
        [light for light, _, _ in lights] or None,
        target_landmarks=landmarks,
        reference_landmarks=[marks for _, marks, _ in lights] or None,
        options=options,
        detail=detail,
    )


def _at_size(session: Session, role: str, side: int) -> tuple[Photo, Landmarks, int]:
    sitter, landmarks = session.ready(role)
    photo = preview_of(sitter, side)
    factor = max(1, -(-max(sitter.photo.pixels.shape[:2]) // side))
    return photo, landmarks.reduced(factor), factor


def views_of(result: TransferResult) -> dict[str, NDArray[Any]]:
    """Return the pictures of a transfer by the names of their views."""
    stages = view_pictures(result) | {"result": result.image}
    before = to_unit(result.target)
    if before.ndim < result.image.ndim:
        before = np.repeat(before[..., None], 3, axis=2)
    stages["difference"] = from_unit((to_unit(result.image) - before) / 2 + 0.5, np.uint8)
    return {view: stages[stage] for view, stage in VIEWS.items() if stage in stages}


def jpeg(pixels: NDArray[Any]) -> bytes:
    """Return pixels as a JPEG."""
    buffer = io.BytesIO()
    Image.fromarray(from_unit(to_unit(pixels), np.uint8)).save(buffer, "JPEG", quality=_QUALITY)
    return buffer.getvalue()
