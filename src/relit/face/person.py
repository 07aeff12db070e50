"""Who is in a photo: the person whose face it is, with hair, neck and clothes, told from what is behind.

A network, MediaPipe's selfie segmentation, looks at a square round the head. It sees persons, not which.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from PIL import Image

from relit.face.face_models import Square, see_person
from relit.photo.pixels import to_unit
from relit.runtime.memo import remembered

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from relit.face.views import View

# Side of the square, and how far below the eyes its middle is, in interocular distances. On twelve rendered
# heads, sides of 5 to 6 and 0 to 0.3 have a mean IoU of .991; a side of 4 at most .97, one of 7 .989.
_SIDE, _BELOW_EYES = 5.5, 0.3


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
    square = _square_round(view)
    photo = Image.fromarray(np.rint(255 * to_unit(view.pixels)).astype(np.uint8)).convert("RGB")
    seen = see_person(photo, square)
    pad = len(seen) // 4  # a view may reach beyond the square
    step = square.side / len(seen)
    # From (x, y) of the view to those of what was seen, both from the corners of pixels.
    turn = square.turn / step
    first = len(seen) / 2 + pad - turn @ (square.x + 0.5, square.y + 0.5)
    padded = Image.fromarray(np.pad(seen, pad, mode="edge"))
    rows = (*turn[0], first[0], *turn[1], first[1])
    likely = padded.transform(photo.size, Image.Transform.AFFINE, rows, Image.Resampling.BILINEAR)
    return np.asarray(likely, np.float32)


def _square_round(view: View) -> Square:
    """Return the square round a head, along its eyes."""
    face = view.regions
    middle = _middle(view) - _BELOW_EYES * face.interocular_distance * face.up
    x, y = face.across
    side, angle = _SIDE * face.interocular_distance, float(np.arctan2(y, x))
    return Square(float(middle[0]), float(middle[1]), side, angle)


def _middle(view: View) -> NDArray[np.float64]:
    """Return the point between the eyes, or in the middle of a face that tells of no eyes."""
    eyes, outline = view.landmarks.eyes, view.regions.outline
    return outline.mean(axis=0) if eyes is None else np.asarray(eyes[:, :2].mean(axis=0))
