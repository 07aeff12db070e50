"""Pictures of the stages of a transfer, one by one and on a contact sheet like the paper's Fig. 1."""

from __future__ import annotations

from itertools import cycle
from typing import TYPE_CHECKING, Any

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from relit.face.landmarks import Landmarks
from relit.face.views import window_round
from relit.photo.pixels import from_unit, to_unit

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from relit.ltv.decomposition import Decomposition
    from relit.results import TransferResult

#: Names of the stages, in the order in which they arise.
STAGES = (
    "target",
    "reference",
    "warped_reference",
    "warped_second_reference",
    "target_u",
    "target_v",
    "reference_u",
    "reference_v",
    "target_light",
    "target_is_lit",
    "person",
    "new_light",
    "known",
    "mask",
    "result",
)

_CAPTIONS = {
    "target": "target",
    "reference": "reference",
    "warped_reference": "reference, warped",
    "warped_second_reference": "second reference, warped",
    "target_u": "u of the target",
    "target_v": "v of the target: the person",
    "reference_u": "u of the reference: the light",
    "reference_v": "v of the reference",
    "target_light": "light of the target",
    "target_is_lit": "where it reaches",
    "person": "the person",
    "new_light": "the new light",
    "known": "where it is known",
    "mask": "where it goes",
    "before": "the face, before",
    "after": "and after",
    "result": "result",
}
#: What of a transfer is light, and what person, to the eye.
_DETAILS = ("target_u", "reference_u", "target_v", "target_light", "new_light", "person", "known", "mask")

PAPER, INK = (255, 255, 255), (40, 40, 40)
_GROUP_COLORS = (
    "#e6194b",
    "#3cb44b",
    "#4363d8",
    "#f58231",
    "#911eb4",
    "#42d4f4",
    "#f032e6",
    "#bfef45",
    "#ffe119",
)


def split_pictures(split: Decomposition) -> tuple[NDArray[np.uint8], NDArray[np.uint8]]:
    """Return u and v as 8-bit pictures; v = 1 is mid grey, and v of 2 and above is white."""
    return from_unit(split.u, np.uint8), from_unit(split.v / 2, np.uint8)


def stage_pictures(result: TransferResult) -> dict[str, NDArray[Any]]:
    """Return the stages of a transfer as pictures, in the order in which they arise.

    Parameters
    ----------
    result : TransferResult

    Returns
    -------
    dict
        ``target`` and ``reference`` with their landmarks, ``warped_reference``, ``warped_second_reference``
        if there is one, u and v of both if the method splits, the layers of the method if it has any,
        ``known`` and ``mask`` if there are any, and ``result`` in the target's dtype. u, v and layers show
        the channels that were relit, as planes of grey or RGB, and from ``warped_reference`` to ``mask`` all
        cover `result.view`. Of several references, the first is shown.
    """
    pictures = {"target": landmark_overlay(result.target, result.target_landmarks)}
    if result.reference is not None and result.reference_landmarks is not None:
        pictures["reference"] = landmark_overlay(result.reference, result.reference_landmarks)
    return pictures | view_pictures(result) | {"result": result.image}


def view_pictures(result: TransferResult) -> dict[str, NDArray[Any]]:
    """Return those of `stage_pictures` that cover `result.view`."""
    first = result.first
    pictures: dict[str, NDArray[Any]] = {"warped_reference": first.warped}
    if first.second_alignment:
        pictures["warped_second_reference"] = first.second_alignment.warped
    for role, split in (("target", first.target_split), ("reference", first.reference_split)):
        if split is not None:
            pictures[f"{role}_u"], pictures[f"{role}_v"] = split_pictures(split)
    pictures |= {name: from_unit(layer, np.uint8) for name, layer in first.layers.items()}
    if first.known is not None:
        pictures["known"] = from_unit(first.known, np.uint8)
    if result.mask is not None:
        pictures["mask"] = from_unit(result.mask, np.uint8)
    return pictures


def landmark_overlay(image: NDArray[Any], landmarks: Landmarks) -> NDArray[np.uint8]:
    """Return the photo as 8-bit RGB with its landmarks drawn in, a colour for each facial feature.

    Examples
    --------
    >>> import numpy as np
    >>> picture = landmark_overlay(np.zeros((50, 60), np.uint8), Landmarks([[10, 10], [40, 10], [25, 40]]))
    >>> picture.shape, bool(picture[10, 40].any()), bool(picture[25, 5].any())
    ((50, 60, 3), True, False)
    """
    picture = _as_rgb(image)
    draw = ImageDraw.Draw(picture)
    radius = max(landmarks.interocular_distance / 60, 1.0)
    named = {
        row: color
        for rows, color in zip(landmarks.groups.values(), cycle(_GROUP_COLORS), strict=False)
        for row in rows
    }
    for row, (x, y) in enumerate(landmarks.xy.tolist()):
        draw.ellipse((x - radius, y - radius, x + radius, y + radius), fill=named.get(row, "#a9a9a9"))
    return np.asarray(picture)


def contact_sheet(
    result: TransferResult, pictures: dict[str, NDArray[Any]] | None = None, *, height: int = 360
) -> NDArray[np.uint8]:
    """Draw the stages of a transfer on one page, as in Fig. 1 of the paper.

    Parameters
    ----------
    result : TransferResult
    pictures : dict, optional
        What `stage_pictures` gave, if it is at hand.
    height : int
        Of each picture, in px.

    Returns
    -------
    (H, W, 3) uint8 array
    """
    face = result.window
    panels = (pictures or stage_pictures(result)) | {
        "before": result.target[face],
        "after": result.image[face],
    }
    rows = (
        ("target", "reference", "warped_reference", "warped_second_reference"),
        ("target_u", "target_v", "reference_u", "reference_v"),
        ("target_light", "target_is_lit", "person", "new_light"),
        ("known", "mask", "before", "after"),
        ("result",),
    )
    strips = [
        strip([(_CAPTIONS[name], panels[name]) for name in row if name in panels], height)
        for row in rows
        if any(name in panels for name in row)
    ]
    return page(strips)


def comparison_sheet(result: TransferResult, *, height: int = 640) -> NDArray[np.uint8]:
    """Draw what the eye compares: target, reference and result; before and after in halves; light and person.

    Parameters
    ----------
    result : TransferResult
    height : int
        Of each picture, in px.

    Returns
    -------
    (H, W, 3) uint8 array
    """
    window, first = result.window, result.first
    before, after = (np.asarray(_as_rgb(image[window])) for image in (result.target, result.image))
    middle = round(float(result.target_landmarks.xy[:, 0].mean())) - window[1].start
    halves = np.concatenate([before[:, :middle], after[:, middle:]], axis=1)
    line = max(before.shape[1] // 400, 1)
    halves[:, max(middle - line, 0) : middle + line] = PAPER
    panels: list[tuple[str, NDArray[Any]]] = [("target", before)]
    if result.reference is not None and result.reference_landmarks is not None:
        marks = result.reference_landmarks
        around = window_round(marks.xy, 0.9 * marks.interocular_distance, result.reference.shape)
        panels.append(("reference", result.reference[around]))
    else:
        panels.append((f"light: {result.options.light}", first.warped))
    panels += [("result", after), ("before | after", halves)]
    pictures = stage_pictures(result)
    details = [(_CAPTIONS[name], pictures[name]) for name in _DETAILS if name in pictures]
    return page([strip(panels, height), strip(details, height)])


def page(strips: Sequence[Image.Image]) -> NDArray[np.uint8]:
    """Return strips one below the other."""
    sheet = Image.new("RGB", (max(one.width for one in strips), sum(one.height for one in strips)), PAPER)
    top = 0
    for one in strips:
        sheet.paste(one, (0, top))
        top += one.height
    return np.asarray(sheet)


def strip(panels: Sequence[tuple[str, NDArray[Any]]], height: int) -> Image.Image:
    """Return pictures side by side, all of one height, with their captions below."""
    gap, text = height // 24, height // 20
    font = ImageFont.load_default(text)
    pictures = []
    for _, pixels in panels:
        picture = _as_rgb(pixels)
        width = max(round(picture.width * height / picture.height), 1)
        pictures.append(picture.resize((width, height), Image.Resampling.LANCZOS))
    total = gap + sum(picture.width + gap for picture in pictures)
    strip = Image.new("RGB", (total, height + 2 * gap + 2 * text), PAPER)
    draw = ImageDraw.Draw(strip)
    left = gap
    for (caption, _), picture in zip(panels, pictures, strict=True):
        strip.paste(picture, (left, gap))
        draw.text((left, height + gap + text // 3), caption, fill=INK, font=font)
        left += picture.width + gap
    return strip


def _as_rgb(image: NDArray[Any]) -> Image.Image:
    return Image.fromarray(from_unit(to_unit(image), np.uint8)).convert("RGB")
