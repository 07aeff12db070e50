"""Pass 3: a frame with the change of light of its time."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from relit.compose.blend import base_of, blend
from relit.compose.share import share_of_change
from relit.face.views import view_of
from relit.inputs import face_window, reduction
from relit.runtime.memo import doing_once

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from relit.face.landmarks import Landmarks
    from relit.photo.planes import PlaneSpace
    from relit.settings.options import TransferOptions
    from relit.video.face_frame import FaceFrame


def relit(
    pixels: NDArray[Any],
    landmarks: Landmarks,
    frame: FaceFrame,
    change: NDArray[np.float32],
    share: float,
    space: PlaneSpace,
    options: TransferOptions,
) -> NDArray[Any]:
    """Return a picture, (H, W, 3), with so much of a change of light as `share`, 0 to 1, says.

    Parameters
    ----------
    pixels : (H, W, 3) array
    landmarks : Landmarks
        Of the picture.
    frame : FaceFrame
    change : (h, w, k) array
        In the frame of the face.
    share : float
    space : PlaneSpace
        The planes that the change is one of.
    options : TransferOptions
    """
    factor = reduction(landmarks, options, None)
    window = face_window(pixels.shape, landmarks, options, factor)
    view = view_of(pixels, landmarks, window, factor)
    size = view.pixels.shape[:2]
    if min(size) == 0:
        return pixels
    corner = window[1].start, window[0].start
    made = frame.placed(landmarks.points).laid(change, (size[0], size[1]), factor, corner)
    with doing_once():
        mask = share_of_change(view, options, None)
    if share < 1 or mask is None:
        mask = np.float32(share) * (np.ones(size, np.float32) if mask is None else mask)
    return blend(pixels, view, made, mask, space, base_of(space.of_target(view.pixels)))
