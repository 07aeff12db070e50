"""Who is in a photo: the person whose face it is, with hair, neck and clothes, told from what is behind.

A network, MediaPipe's selfie segmentation, looks at a square round the head, and at a wider one for shoulders
and chest. It sees persons, not which.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import cv2
import numpy as np
from PIL import Image

from relit.face.face_models import Square, see_person
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
    near, wide = (_seen(photo, _square_round(view, *where)) for where in (_NEAR, _WIDE))
    likely, trust = cv2.split(near)
    return np.asarray(trust * likely + (1 - trust) * wide[..., 0], np.float32)


def _seen(photo: Image.Image, square: Square) -> NDArray[np.float32]:
    """Return how likely each pixel is a person's, and if it is in the square, less at its rim: (h, w, 2)."""
    likely = see_person(photo, square)
    pad = len(likely) // 4  # a view may reach beyond the square
    step = square.side / len(likely)
    # From (x, y) of the view to those of what was seen.
    turn = square.turn / step
    first = (len(likely) - 1) / 2 + pad - turn @ (square.x, square.y)
    away = np.minimum(np.arange(len(likely)), np.arange(len(likely))[::-1]) / (_RIM * len(likely))
    inside = np.clip(np.minimum(away, away[:, None]), 0, 1).astype(np.float32)
    planes = cv2.merge([np.pad(likely, pad, mode="edge"), np.pad(inside, pad)])
    how = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
    return np.asarray(cv2.warpAffine(planes, np.column_stack([turn, first]), photo.size, flags=how))


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
