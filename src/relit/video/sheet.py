"""A contact sheet: frames of a video, and under each the same one relit."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import cv2
import numpy as np

from relit.video.clip import Cursor, look_at
from relit.video.pixels import to_rgb

if TYPE_CHECKING:
    from numpy.typing import NDArray

_COUNT = 6  # frames
_WIDTH = 320  # px of each at most


def contact_sheet(
    before: str, after: str, part: tuple[float | None, float | None], frames: int
) -> NDArray[np.uint8]:
    """Return the first frame, the last and some between, before and after, as one picture.

    Parameters
    ----------
    before, after : str
        Two videos.
    part : (float or None, float or None)
        Of the first, that is shown in the second.
    frames : int
        That the second has.
    """
    cursors = Cursor(look_at(before), *part), Cursor(look_at(after), None, None)
    numbers = np.unique(np.linspace(0, frames - 1, min(_COUNT, frames)).round().astype(int)).tolist()
    columns = [np.vstack([_small(to_rgb(one(number), small=True)) for one in cursors]) for number in numbers]
    return np.hstack(columns)


def _small(pixels: NDArray[Any]) -> NDArray[np.uint8]:
    height, width = pixels.shape[:2]
    factor = min(_WIDTH / width, 1.0)
    size = max(round(width * factor), 1), max(round(height * factor), 1)
    return np.asarray(cv2.resize(pixels, size, interpolation=cv2.INTER_AREA), np.uint8)
