"""Pictures in layers, as programs for painting and retouching open them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from relit.photo.photo import Photo
from relit.photo.pixels import from_unit, full_of

if TYPE_CHECKING:
    from numpy.typing import NDArray

_ROWS = 256  # of a photo at a time, so that a large one is not held as floats

#: How a layer goes over what is below it, both in [0, 1]: it lies on it; ``below · layer``; and
#: ``below / (1 - layer)``.
Mode = Literal["normal", "multiply", "color-dodge"]


@dataclass(frozen=True, eq=False)
class Layer:
    """A picture that lies on others.

    Attributes
    ----------
    name : str
    photo : Photo
        Grey or RGB, with alpha or without, uint8 or uint16.
    left, top : int
        Where its first pixel is in the whole picture, in px.
    mode : str
    visible : bool
    """

    name: str
    photo: Photo
    left: int = 0
    top: int = 0
    mode: Mode = "normal"
    visible: bool = True


@dataclass(frozen=True, eq=False)
class Layers:
    """Layers, and what one sees of them; all of one depth, in grey or in RGB, and in one profile.

    Attributes
    ----------
    picture : Photo
        All layers that are visible, laid on each other.
    layers : tuple of Layer
        From the top.
    """

    picture: Photo
    layers: tuple[Layer, ...]


def change_in_layers(before: NDArray[Any], after: NDArray[Any]) -> tuple[NDArray[Any], NDArray[Any]]:
    """Return two layers that turn one picture into another: the lower one to dodge, the upper to multiply.

    The lower one makes all bright that is to be brighter, and a little more than it is to be, since of strong
    changes its levels are far apart; the upper one takes that back, and darkens the rest.

    Parameters
    ----------
    before, after : (H, W) or (H, W, 3) array
        uint8 or uint16, alike in shape and dtype.

    Returns
    -------
    (NDArray, NDArray)
        ``before / (1 - lower) · upper`` is `after` to a level, except where `before` is 0, which they leave
        as it is.

    Examples
    --------
    >>> before, after = (np.array([[levels]], np.uint8).T for levels in ([100, 100, 100], [50, 100, 200]))
    >>> [layer.ravel().tolist() for layer in change_in_layers(before, after)]
    [[0, 0, 128], [128, 255, 254]]
    """
    lower, upper = np.empty_like(before), np.empty_like(before)
    full = np.float32(full_of(before.dtype))
    for top in range(0, len(before), _ROWS):
        rows = slice(top, top + _ROWS)
        old, new = (image[rows].astype(np.float32) for image in (before, after))
        dodge = np.ceil(full * np.maximum(new - old, 0) / np.maximum(new, 1))
        dodge[old == 0] = 0
        dodged = np.minimum(np.rint(full * old / np.maximum(full - dodge, 1)), full)
        lower[rows] = dodge
        upper[rows] = np.where(old == 0, full, np.rint(full * np.minimum(new / np.maximum(dodged, 1), 1)))
    return lower, upper


def as_mask(name: str, share: NDArray[np.float32], like: Photo) -> Layer | None:
    """Return a hidden white layer that is opaque where a share, (H, W) in [0, 1], is 1; None if nowhere."""
    alpha = from_unit(share, like.pixels.dtype)
    box = box_of(alpha)
    if box is None:
        return None
    alpha = np.ascontiguousarray(alpha[box])
    shape = (*alpha.shape, *like.pixels.shape[2:])
    white = Photo(np.full(shape, full_of(alpha.dtype), alpha.dtype), alpha)
    return Layer(name, white, box[1].start, box[0].start, visible=False)


def box_of(plane: NDArray[Any]) -> tuple[slice, slice] | None:
    """Return the rows and columns that hold all of a plane that is not 0; None if it is 0.

    Examples
    --------
    >>> box_of(np.array([[0, 0, 0], [0, 2, 1]]))
    (slice(1, 2, None), slice(1, 3, None))
    """
    rows, columns = (np.flatnonzero(plane.any(axis=axis)) for axis in (1, 0))
    if not rows.size:
        return None
    return slice(int(rows[0]), int(rows[-1]) + 1), slice(int(columns[0]), int(columns[-1]) + 1)
