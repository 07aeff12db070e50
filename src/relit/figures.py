"""Pictures of the stages of a transfer, one by one and on a contact sheet like the paper's Fig. 1."""

from __future__ import annotations

from functools import partial
from itertools import cycle
from typing import TYPE_CHECKING, Any

import numpy as np
from PIL import Image, ImageDraw, ImageFont, ImageOps

from relit.face.landmarks import Landmarks
from relit.face.views import window_round
from relit.photo.pixels import from_unit, to_unit
from relit.photo.profile import encode_srgb

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray

    from relit.ltv.decomposition import Decomposition
    from relit.results import TransferResult

#: Names of the stages, in the order in which they arise, and their captions.
STAGES = {
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
    "light": "as lamps round the head",
    "result": "result",
}
_ROWS = (
    ("target", "reference", "warped_reference", "warped_second_reference"),
    ("target_u", "target_v", "reference_u", "reference_v"),
    ("target_light", "target_is_lit", "person", "new_light"),
    ("light", "known", "mask"),
    ("before", "after"),
    ("result",),
)
#: What of a transfer is light, and what person, to the eye.
_DETAILS = ("target_u", "reference_u", "target_v", "target_light", "new_light", "person", "known", "mask")

PAPER, INK = (255, 255, 255), (40, 40, 40)
_COLORS = ("#e6194b", "#3cb44b", "#4363d8", "#f58231", "#911eb4", "#42d4f4", "#f032e6", "#bfef45", "#ffe119")


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
        ``target`` and ``reference`` with their landmarks, what `view_pictures` returns, ``light`` in latitude
        and longitude if the method knows it, and ``result`` in the target's dtype. Of several references, the
        first is shown.
    """
    pictures = {"target": landmark_overlay(result.target, result.target_landmarks)}
    if result.reference is not None and result.reference_landmarks is not None:
        pictures["reference"] = landmark_overlay(result.reference, result.reference_landmarks)
    light = {} if result.light is None else {"light": from_unit(encode_srgb(result.light), np.uint8)}
    return pictures | view_pictures(result) | light | {"result": result.image}


def view_pictures(result: TransferResult) -> dict[str, NDArray[Any]]:
    """Return the stages between reference and result, which cover `result.view`.

    As of `view_makers`, all made.
    """
    return {name: make() for name, make in view_makers(result).items()}


def view_makers(result: TransferResult) -> dict[str, Callable[[], NDArray[Any]]]:
    """Return what makes the stages between reference and result, each on its own, by their names.

    ``warped_reference``, ``warped_second_reference`` if there is one, u and v of both if the method splits,
    its layers if it has any, ``known`` and ``mask`` if there are any. u, v and layers show the channels that
    were relit, as planes of grey or RGB.
    """
    first = result.first
    makers: dict[str, Callable[[], NDArray[Any]]] = {"warped_reference": lambda: first.warped}
    if second := first.second_alignment:
        makers["warped_second_reference"] = lambda: second.warped
    for role, split in (("target", first.target_split), ("reference", first.reference_split)):
        if split is not None:
            makers[f"{role}_u"] = partial(_u_or_v, split, 0)
            makers[f"{role}_v"] = partial(_u_or_v, split, 1)
    for name in first.layers:
        makers[name] = partial(lambda name: from_unit(first.layers[name], np.uint8), name)
    for name, layer in (("known", first.known), ("mask", result.mask)):
        if layer is not None:
            makers[name] = partial(from_unit, layer, np.uint8)
    return makers


def _u_or_v(split: Decomposition, which: int) -> NDArray[np.uint8]:
    return split_pictures(split)[which]


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
    groups = zip(landmarks.groups.values(), cycle(_COLORS), strict=False)
    named = {row: color for rows, color in groups for row in rows}
    for row, (x, y) in enumerate(landmarks.xy.tolist()):
        draw.circle((x, y), radius, fill=named.get(row, "#a9a9a9"))
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
    face = {"before": result.target[result.window], "after": result.image[result.window]}
    panels = (pictures or stage_pictures(result)) | face
    captions = STAGES | {"before": "the face, before", "after": "and after"}
    rows = [[(captions[name], panels[name]) for name in row if name in panels] for row in _ROWS]
    return page([strip(row, height) for row in rows if row])


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
    window = result.window
    before, after = (np.asarray(_as_rgb(image[window])) for image in (result.target, result.image))
    middle = round(float(result.target_landmarks.xy[:, 0].mean())) - window[1].start
    halves = np.concatenate([before[:, :middle], after[:, middle:]], axis=1)
    line = max(before.shape[1] // 400, 1)
    halves[:, max(middle - line, 0) : middle + line] = PAPER
    caption, shown = f"light: {result.options.light}", result.first.warped
    if result.reference is not None and result.reference_landmarks is not None:
        face = result.reference_landmarks
        around = window_round(face.xy, 0.9 * face.interocular_distance, result.reference.shape)
        caption, shown = "reference", result.reference[around]
    panels = [("target", before), (caption, shown), ("result", after), ("before | after", halves)]
    pictures = view_pictures(result)
    details = [(STAGES[name], pictures[name]) for name in _DETAILS if name in pictures]
    return page([strip(panels, height), strip(details, height)])


def page(strips: Sequence[Image.Image]) -> NDArray[np.uint8]:
    """Return strips one below the other."""
    width = max(one.width for one in strips)
    wide = [ImageOps.expand(one, (0, 0, width - one.width, 0), PAPER) for one in strips]
    return np.concatenate([np.asarray(one) for one in wide])


def strip(panels: Sequence[tuple[str, NDArray[Any]]], height: int) -> Image.Image:
    """Return pictures side by side, all of one height, with their captions below."""
    gap, text = height // 24, height // 20
    font = ImageFont.load_default(text)
    shown = [_as_rgb(pixels) for _, pixels in panels]
    widths = [max(round(picture.width * height / picture.height), 1) for picture in shown]
    sheet = Image.new("RGB", (gap + sum(widths) + gap * len(widths), height + 2 * gap + 2 * text), PAPER)
    draw = ImageDraw.Draw(sheet)
    left = gap
    for (caption, _), picture, width in zip(panels, shown, widths, strict=True):
        sheet.paste(picture.resize((width, height), Image.Resampling.LANCZOS), (left, gap))
        draw.text((left, height + gap + text // 3), caption, fill=INK, font=font)
        left += width + gap
    return sheet


def _as_rgb(image: NDArray[Any]) -> Image.Image:
    return Image.fromarray(from_unit(to_unit(image), np.uint8)).convert("RGB")
