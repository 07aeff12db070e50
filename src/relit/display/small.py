"""Images of every kind as small pictures for the eye."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from PIL import Image

from relit.photo.foreign_images import opened
from relit.photo.photo import Photo
from relit.photo.pixels import to_depth

if TYPE_CHECKING:
    from relit.photo.foreign_images import AnyImage


def small(image: AnyImage, longest: int) -> Image.Image:
    """Return an image in sRGB and 8 bits, no side longer than so many px; it is never enlarged.

    Parameters
    ----------
    image : array, Photo, PIL image, torch tensor, or path
        As of `relit.transfer`.
    longest : int

    Returns
    -------
    PIL image
        L or RGB, with alpha LA or RGBA.

    Raises
    ------
    ImageError
        If it is of another kind, or cannot be read.

    Examples
    --------
    >>> small(np.zeros((200, 400, 3)), 100).size
    (100, 50)
    """
    photo, back = opened(image, "image")
    whole = back(photo.pixels)  # with the alpha of its kind
    if isinstance(whole, Image.Image):
        alpha = whole.getchannel("A") if whole.mode.endswith("A") else None
    elif photo.alpha is not None:
        alpha = Image.fromarray(to_depth(photo.alpha, np.uint8))
    elif isinstance(whole, np.ndarray) and whole.ndim == 3 and whole.shape[2] in (2, 4):
        alpha = Image.fromarray(to_depth(whole[..., -1], np.uint8))
    else:
        alpha = None
    colors = Photo(to_depth(photo.pixels, np.uint8), profile=photo.profile).to_profile(None)
    picture = Image.fromarray(colors.pixels)
    if alpha is not None:
        picture.putalpha(alpha)
    picture.thumbnail((longest, longest), Image.Resampling.LANCZOS)
    return picture
