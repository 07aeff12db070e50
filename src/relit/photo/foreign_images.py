"""Images of other libraries, alone or in a sample of training data, as photos and back.

PyTorch and torchvision are never imported here: whoever hands over a tensor has done so.
"""

from __future__ import annotations

import copy
import sys
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from PIL import Image

from relit.errors import ImageError
from relit.photo.photo import Photo
from relit.photo.pixels import SMALLEST_SIDE, check_pixels
from relit.photo.profile import is_usable

#: Mode of a PIL image → the mode of its colours.
_PIL_MODES = {"L": "L", "LA": "L", "RGB": "RGB", "RGBA": "RGB", "I;16": "I;16"}
_PLAIN = ("uint8", "uint16", "float16", "bfloat16", "float32", "float64")

#: Where in a sample something is: the keys and indices on the way there.
Place = tuple[Any, ...]


class Opened(NamedTuple):
    """An image as a photo, and what makes an image of its kind from new pixels."""

    photo: Photo
    back: Callable[[Any], Any]


def opened(image: Any, name: str) -> Opened:
    """Open an image of any kind.

    Parameters
    ----------
    image : array, Photo, PIL image or torch tensor
        ``(H, W)`` or ``(H, W, 3)``; of a tensor ``(1, H, W)`` or ``(3, H, W)``.
    name : str
        The argument's name, for messages.

    Raises
    ------
    ImageError
        If it is of another kind, or not a photo's pixels.

    Examples
    --------
    >>> photo, back = opened(Image.new("L", (12, 8), 7), "image")
    >>> photo.pixels.shape, back(photo.pixels + 1).getpixel((0, 0))
    ((8, 12), 8)
    """
    if isinstance(image, Photo):
        kind = Opened(image, lambda pixels: replace(image, pixels=pixels))
    elif isinstance(image, Image.Image):
        kind = _opened_pil(image, name)
    elif _is_tensor(image):
        kind = _opened_tensor(image, name)
    elif isinstance(image, np.ndarray):
        kind = Opened(Photo(image), lambda pixels: pixels)
    else:
        raise ImageError(
            f"{name}: expected an array, a Photo, a PIL image or a torch tensor, got {type(image).__name__}"
        )
    check_pixels(kind.photo.pixels, name)
    return kind


def _opened_pil(image: Image.Image, name: str) -> Opened:
    if image.mode not in _PIL_MODES:
        raise ImageError(f"{name}: expected mode {', '.join(_PIL_MODES)}, got {image.mode}; convert it first")
    try:
        image.load()
    except (OSError, SyntaxError) as error:  # a file that is read only now, and cut short
        raise ImageError(f"{name}: cannot be read ({error}); get the file again") from error
    alpha = image.getchannel("A") if image.mode.endswith("A") else None
    pixels = np.array(image.convert(_PIL_MODES[image.mode]))
    profile = image.info.get("icc_profile")

    def back(made: Any) -> Image.Image:
        result = Image.fromarray(made)
        if alpha is not None:
            result.putalpha(alpha)
        result.info = dict(image.info)
        return result

    return Opened(Photo(pixels, profile=profile if profile and is_usable(profile, pixels) else None), back)


def _opened_tensor(image: Any, name: str) -> Opened:
    torch = sys.modules["torch"]
    if image.ndim != 3 or image.shape[0] not in (1, 3):
        raise ImageError(
            f"{name}: expected a tensor of shape (3, H, W) or (1, H, W), got {tuple(image.shape)}; hand over "
            "the images of a batch one by one"
        )
    # NumPy has no bfloat16, and relit no float16.
    small = image.is_floating_point() and image.element_size() < 4
    planes = (image.float() if small else image).detach().cpu().numpy()
    wrap = _tv_tensors().wrap if _is_tv_tensor(image) else lambda tensor, like: tensor  # noqa: ARG005

    def back(made: Any) -> Any:
        channels = made[None] if made.ndim == 2 else made.transpose(2, 0, 1)
        tensor = torch.from_numpy(np.ascontiguousarray(channels))
        return wrap(tensor.to(device=image.device, dtype=image.dtype), like=image)

    return Opened(Photo(planes[0] if len(planes) == 1 else planes.transpose(1, 2, 0)), back)


def find(sample: Any) -> Place:
    """Return where in a sample the image is; an image alone is a sample, too.

    It is the first PIL image, Photo or ``tv_tensors.Image``; where there is none of these, the first array
    or plain tensor that has the shape of a photo.

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
    for is_image in (_is_explicit, _is_plain):
        for place, leaf in leaves:
            if is_image(leaf):
                return place
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
    return isinstance(leaf, (Photo, Image.Image)) or (
        _is_tv_tensor(leaf) and isinstance(leaf, _tv_tensors().Image)
    )


def _is_plain(leaf: Any) -> bool:
    """Whether something can be an image by its shape; boxes, masks and key points of torchvision are not."""
    if isinstance(leaf, np.ndarray):
        sides = leaf.shape[:2] if leaf.ndim == 2 or (leaf.ndim == 3 and leaf.shape[2] == 3) else ()
    elif _is_tensor(leaf) and not _is_tv_tensor(leaf):
        sides = leaf.shape[1:] if leaf.ndim == 3 and leaf.shape[0] in (1, 3) else ()
    else:
        return False
    known = str(leaf.dtype).removeprefix("torch.") in _PLAIN
    return known and len(sides) == 2 and min(sides) >= SMALLEST_SIDE


def _is_tensor(value: Any) -> bool:
    torch = sys.modules.get("torch")
    return torch is not None and isinstance(value, torch.Tensor)


def _is_tv_tensor(value: Any) -> bool:
    tv_tensors = _tv_tensors()
    return tv_tensors is not None and isinstance(value, tv_tensors.TVTensor)


def _tv_tensors() -> Any:
    return sys.modules.get("torchvision.tv_tensors")
