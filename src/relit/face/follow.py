"""Follow a face from one frame of a video to the next, without looking for it anew."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from PIL import Image

from relit.face.detect import LEAST_PRESENCE, faces_in, square_round
from relit.face.face_models import see_mesh
from relit.face.landmarks import Landmarks

if TYPE_CHECKING:
    from numpy.typing import NDArray

_BRIGHTENED = 0.45  # as of `detect`
_SAME = 0.7  # interocular distances that two faces of one person lie apart at most, where both were found


def follow(pixels: NDArray[np.uint8], before: Landmarks) -> Landmarks | None:
    """Return the mesh in the square round where it was a moment before; None where there is no face.

    Parameters
    ----------
    pixels : (H, W, 3) uint8 array
    before : Landmarks
        Of scheme ``mesh478``.

    Examples
    --------
    >>> from relit import detect_landmarks, read_image, sample
    >>> photo = read_image(sample("target")).pixels
    >>> face = detect_landmarks(photo)
    >>> bool(np.abs(follow(photo, face.shifted(5, 3)).xy - face.xy).max() < 4)
    True
    """
    photo = Image.fromarray(pixels)
    square = square_round(before.points)
    for gamma in (1.0, _BRIGHTENED):
        ((points, presence),) = see_mesh(photo, square, (gamma,))
        if presence >= LEAST_PRESENCE:
            return Landmarks(points, "mesh478", presence)
    return None


def nearest_face(pixels: NDArray[np.uint8], before: Landmarks | None, face: int) -> Landmarks | None:
    """Look for faces anew; return the one that is where it was before, else the so-manieth largest.

    None where there are not so many. A face that was lost a moment ago may have moved by its own size.
    """
    faces = faces_in(pixels)
    if before is not None:
        middle = before.xy.mean(axis=0)
        away = [float(np.linalg.norm(one.xy.mean(axis=0) - middle)) for one in faces]
        if away and min(away) < _SAME * before.interocular_distance:
            return faces[int(np.argmin(away))]
    return faces[face] if face < len(faces) else None
