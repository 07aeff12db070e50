"""Views: a face in a window of a photo, as large as the work needs it and no larger.

A face says the same about its light at any size. So it is looked at through a *view*, reduced by a whole
factor until its eyes are as far apart as the method asks, and what changes is brought back to the photo's own
pixels by `compose.blend`.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from relit.face.landmarks import Landmarks
from relit.face.regions import FaceRegions
from relit.face.skin import Skin, skin_of
from relit.photo.color import luma
from relit.photo.filters import gaussian
from relit.photo.pixels import size_and_dtype, to_unit
from relit.photo.resampling import reduced
from relit.runtime.memo import remembered

if TYPE_CHECKING:
    from numpy.typing import NDArray

Window = tuple[slice, slice]

# What each of these is worth: docs/leaderboard.md, The constants.
_GRAIN = 0.015  # interocular distances


@dataclass(frozen=True, eq=False)
class View:
    """A face in part of a photo, reduced; what is measured on it is measured once, when first asked for.

    Attributes
    ----------
    pixels : (h, w) or (h, w, 3) array
        The photo's own samples at factor 1; else means over ``factor x factor`` px, uint16 of integers and
        float32 of floats. At the photo's end, the last pixel counts as often as a block has to be filled.
    landmarks : Landmarks
        In px of the view.
    window : (slice, slice)
        Rows and columns of the photo that it shows.
    factor : int
        How many px of the photo one of the view is wide.
    """

    pixels: NDArray[Any]
    landmarks: Landmarks
    window: Window
    factor: int

    def __repr__(self) -> str:
        """Return size and dtype, and by how much the photo is reduced."""
        return f"View({size_and_dtype(self.pixels)}, factor={self.factor})"

    @cached_property
    def regions(self) -> FaceRegions:
        """Where the face and its parts are."""
        return FaceRegions(self.landmarks, self.pixels.shape[:2])

    @cached_property
    def brightness(self) -> NDArray[Any]:
        """The luma, or of a grey photo its values, (h, w) in [0, 1]."""
        unit = to_unit(self.pixels)
        return unit if unit.ndim == 2 else luma(unit)

    @cached_property
    def smooth(self) -> NDArray[np.float32]:
        """The pixels in [0, 1] without grain."""
        return without_grain(self.pixels, self.regions.interocular_distance)

    @cached_property
    def skin(self) -> Skin:
        """The colours of the face's skin."""
        return skin_of(self.smooth, self.regions.skin_area)

    @cached_property
    def skin_likeness(self) -> NDArray[np.float32]:
        """How likely each pixel is skin by its colour, (h, w) in [0, 1]."""
        return self.skin.likeness(self.smooth)


def without_grain(image: NDArray[Any], interocular_distance: float) -> NDArray[np.float32]:
    """Return a photo in [0, 1] without its grain, in which a dark skin would lose its hue."""
    return gaussian(to_unit(image), _GRAIN * interocular_distance, edge="repeated")


def whole(image: NDArray[Any], landmarks: Landmarks) -> View:
    """Return the view of all of a photo at its own size."""
    return View(image, landmarks, (slice(0, image.shape[0]), slice(0, image.shape[1])), 1)


def view_of(image: NDArray[Any], landmarks: Landmarks, window: Window, factor: int) -> View:
    """Look at part of a photo.

    Parameters
    ----------
    image : (H, W) or (H, W, 3) array
        uint8, uint16 or float.
    landmarks : Landmarks
        In px of the photo.
    window : (slice, slice)
        Rows and columns to look at.
    factor : int
        1 or more.

    Returns
    -------
    View

    Examples
    --------
    >>> import numpy as np
    >>> ramp = np.tile(np.arange(8, dtype=np.uint16), (8, 1))
    >>> face = Landmarks([[2, 2], [5, 2], [2, 5]])
    >>> view = view_of(ramp, face, (slice(0, 8), slice(2, 8)), 2)
    >>> view.pixels[0].tolist(), view.landmarks.xy[1].tolist()
    ([3, 5, 7], [1.25, 0.75])
    """
    part = image[window]
    shifted = landmarks.shifted(-window[1].start, -window[0].start)
    return View(reduced(part, factor), shifted.reduced(factor), window, factor)


@remembered
def as_seen_before(view: View) -> View:
    """Return a view, or if the same was seen before, that one with what has been measured on it."""
    return view


def window_round(
    points: NDArray[np.float64], margin: float, shape: tuple[int, ...], factor: int = 1
) -> Window:
    """Return the rows and columns of an image that hold points and a margin, in px, round them.

    They start at multiples of the factor.

    Examples
    --------
    >>> import numpy as np
    >>> window_round(np.array([[10.0, 20], [30, 40]]), 6, (100, 33))
    (slice(14, 47, None), slice(4, 33, None))
    """
    left, top = np.floor(points.min(axis=0) - margin).astype(int).tolist()
    right, bottom = (np.ceil(points.max(axis=0) + margin).astype(int) + 1).tolist()
    height, width = shape[:2]
    return (
        slice(max(top, 0) // factor * factor, min(bottom, height)),
        slice(max(left, 0) // factor * factor, min(right, width)),
    )
