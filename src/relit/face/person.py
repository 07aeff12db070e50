"""Who is in a photo: the person whose face it is, with hair, neck and clothes, told from what is behind.

A network, MediaPipe's selfie segmentation, looks at a square round the head, and at a wider one for shoulders
and chest. It sees persons, not which.
"""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING

import cv2
import numpy as np
from PIL import Image

from relit.face.face_models import PERSON_SIDE, Square, see_person
from relit.photo.pixels import from_unit, to_unit
from relit.runtime.memo import remembered

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from relit.face.views import View

# Side of a square, and how far below the eyes its middle is, in interocular distances. On twelve rendered
# heads, sides of 5 to 6 and 0 to 0.3 have a mean IoU of .991; a side of 4 at most .97, one of 7 .989. The
# wide one was chosen by eye: it holds the shoulders of portraits.
_NEAR, _WIDE = (5.5, 0.3), (9.0, 1.5)
_RIM = 0.1  # of a square, over which the near one goes over into the wide one
_PAD = PERSON_SIDE // 4  # px of what was seen, since a view may reach beyond the square


@remembered
def person(view: View) -> NDArray[np.float32]:
    """Return how likely each pixel of a view is of a person, (h, w) in [0, 1].

    Examples
    --------
    >>> from relit import detect_landmarks, read_image, sample
    >>> from relit.face.views import whole
    >>> photo = read_image(sample("target")).pixels
    >>> likely = person(whole(photo, detect_landmarks(photo)))
    >>> likely.shape, bool(likely[100, 230] > 0.9), bool(likely[20, 20] < 0.1)
    ((512, 512), True, True)
    """
    pixels = view.pixels
    photo = Image.fromarray(pixels if pixels.dtype == np.uint8 else from_unit(to_unit(pixels), np.uint8))
    photo = photo.convert("RGB")
    near, wide = (_square_round(view, *where) for where in (_NEAR, _WIDE))
    likely = [
        _laid_back(np.pad(see_person(photo, square), _PAD, mode="edge"), square, photo.size)
        for square in (near, wide)
    ]
    trust = _laid_back(np.pad(_inside(), _PAD), near, photo.size)
    return np.asarray(trust * likely[0] + (1 - trust) * likely[1], np.float32)


@cache
def _inside() -> NDArray[np.float32]:
    """Return how far each pixel of a square is in it, less at its rim, in [0, 1]."""
    away = np.minimum(np.arange(PERSON_SIDE), np.arange(PERSON_SIDE)[::-1]) / (_RIM * PERSON_SIDE)
    return np.clip(np.minimum(away, away[:, None]), 0, 1).astype(np.float32)


def _laid_back(seen: NDArray[np.float32], square: Square, size: tuple[int, int]) -> NDArray[np.float32]:
    """Return what was made of a square, and padded, at each pixel of the photo; 0 beyond it."""
    turn = square.turn * PERSON_SIDE / square.side  # (x, y) of the photo to those of what was seen
    first = (len(seen) - 1) / 2 - turn @ (square.x, square.y)
    how = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
    # One plane at a time: of two at once, OpenCV rounds the places to 1/32 px.
    return np.asarray(cv2.warpAffine(seen, np.column_stack([turn, first]), size, flags=how))


def _square_round(view: View, side: float, below: float) -> Square:
    """Return a square round a head, along its eyes."""
    face = view.regions
    middle = _middle(view) - below * face.interocular_distance * face.up
    x, y = face.across
    angle = float(np.arctan2(y, x))
    return Square(float(middle[0]), float(middle[1]), side * face.interocular_distance, angle)


def _middle(view: View) -> NDArray[np.float64]:
    """Return the point between the eyes, or in the middle of a face that tells of no eyes."""
    eyes, outline = view.landmarks.eyes, view.regions.outline
    return outline.mean(axis=0) if eyes is None else np.asarray(eyes[:, :2].mean(axis=0))
