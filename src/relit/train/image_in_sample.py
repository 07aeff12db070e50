"""Samples of training data: where in one the image is, and the same sample with another image there."""

from __future__ import annotations

import copy
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from PIL import Image

from relit.errors import ImageError
from relit.photo.foreign_images import is_tensor, is_tv_tensor
from relit.photo.photo import Photo
from relit.photo.pixels import SMALLEST_SIDE

if TYPE_CHECKING:
    from collections.abc import Iterator

#: Where in a sample something is: the keys and indices on the way there.
Place = tuple[Any, ...]

_DTYPES = ("uint8", "uint16", "float16", "bfloat16", "float32", "float64")


def find(sample: Any) -> Place:
    """Return where in a sample the image is; an image alone is a sample, too.

    It is the first PIL image, Photo or ``tv_tensors.Image``; where there is none of these, the first array
    ``(H, W)`` or ``(H, W, 3)`` or plain tensor ``(1, H, W)`` or ``(3, H, W)``; and at last, the first array
    ``(H, W, 1)``, ``(H, W, 2)`` or ``(H, W, 4)``.

    Parameters
    ----------
    sample : any
        An image, or a tuple, list or dict of anything, nested as deep as may be.

    Raises
    ------
    ImageError
        If there is none.

    Examples
    --------
    >>> find({"label": 3, "views": [np.zeros((8, 8)), np.zeros((8, 8))]})
    ('views', 0)
    """
    leaves = list(_leaves(sample, ()))
    for is_image in (_is_explicit, _is_plain, _is_plain_in_planes):
        for place, leaf in leaves:
            if is_image(leaf):
                return place
    if isinstance(sample, (str, Path)):
        raise ImageError(
            "image: expected an array, a Photo, a PIL image or a torch tensor, got "
            f"{type(sample).__name__}; read it first (relit.read_image)"
        )
    if not isinstance(sample, (dict, tuple, list)):
        return ()
    kinds = ", ".join(sorted({type(leaf).__name__ for _, leaf in leaves})) or "nothing"
    raise ImageError(
        "sample: expected an array (H, W) or (H, W, 3), a Photo, a PIL image or a tensor (3, H, W) or "
        f"(1, H, W) in it, found {kinds}"
    )


def take(sample: Any, place: Place) -> Any:
    """Return what is at a place in a sample."""
    for key in place:
        sample = sample[key]
    return sample


def put(sample: Any, place: Place, image: Any) -> Any:
    """Return a copy of a sample with another image at a place; all else in it is the same objects.

    Examples
    --------
    >>> put(("a", {"b": 1, "c": 2}), (1, "c"), 3)
    ('a', {'b': 1, 'c': 3})
    """
    if not place:
        return image
    first, *rest = place
    inner = put(sample[first], tuple(rest), image)
    if isinstance(sample, tuple):
        parts = [inner if number == first else part for number, part in enumerate(sample)]
        return type(sample)(*parts) if hasattr(sample, "_fields") else tuple(parts)
    changed = copy.copy(sample)
    changed[first] = inner
    return changed


def _leaves(sample: Any, place: Place) -> Iterator[tuple[Place, Any]]:
    if isinstance(sample, dict):
        parts: Any = sample.items()
    elif isinstance(sample, (tuple, list)):
        parts = enumerate(sample)
    else:
        yield place, sample
        return
    for key, part in parts:
        yield from _leaves(part, (*place, key))


def _is_explicit(leaf: Any) -> bool:
    return isinstance(leaf, (Photo, Image.Image)) or is_tv_tensor(leaf, "Image")


def _is_plain(leaf: Any) -> bool:
    """Whether something can be an image by its shape; boxes, masks and key points of torchvision are not."""
    if isinstance(leaf, np.ndarray):
        return _is_photo(leaf.dtype, leaf.shape[:2], leaf.shape[2:] in ((), (3,)))
    if is_tensor(leaf) and not is_tv_tensor(leaf):
        return _is_photo(leaf.dtype, leaf.shape[1:], leaf.shape[:1] in ((1,), (3,)))
    return False


def _is_plain_in_planes(leaf: Any) -> bool:
    """Whether an array can be an image with alpha, or with an axis for its only channel."""
    return isinstance(leaf, np.ndarray) and _is_photo(
        leaf.dtype, leaf.shape[:2], leaf.shape[2:] in ((1,), (2,), (4,))
    )


def _is_photo(dtype: Any, sides: tuple[int, ...], planes_fit: bool) -> bool:
    known = str(dtype).removeprefix("torch.") in _DTYPES
    return known and planes_fit and len(sides) == 2 and min(sides) >= SMALLEST_SIDE
