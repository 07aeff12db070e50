"""Images of every kind that users have, as photos and back: arrays, files, and those of other libraries.

PyTorch and torchvision are never imported here: whoever hands over a tensor has done so.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

import numpy as np
from PIL import Image

from relit.errors import ImageError
from relit.photo.photo import Photo
from relit.photo.pixels import check_pixels
from relit.photo.profile import is_usable
from relit.photo.reading import read_image

if TYPE_CHECKING:
    from numpy.typing import NDArray

#: Mode of a PIL image → the mode of its colours.
_PIL_MODES = {"L": "L", "LA": "L", "RGB": "RGB", "RGBA": "RGB", "I;16": "I;16"}


class Tensor(Protocol):
    """A torch tensor, for type checkers that have no torch."""

    def detach(self) -> Any:
        """Return it without its gradient."""

    def cpu(self) -> Any:
        """Return it in the memory of the processor."""


if TYPE_CHECKING:
    AnyImage = NDArray[Any] | Photo | Image.Image | Tensor | str | Path


class Opened(NamedTuple):
    """An image as a photo, and what makes an image of its kind from new pixels."""

    photo: Photo
    back: Callable[[NDArray[Any]], Any]


def opened(image: AnyImage, name: str) -> Opened:
    """Open an image of any kind.

    Parameters
    ----------
    image : array, Photo, PIL image, torch tensor, or path
        An array ``(H, W)`` or ``(H, W, 3)``, ``(H, W, 1)``, or with alpha ``(H, W, 2)`` or ``(H, W, 4)``; a
        PIL image of mode L, LA, RGB, RGBA or I;16; a tensor ``(1, H, W)`` or ``(3, H, W)``; the path of a
        photo.
    name : str
        The argument's name, for messages.

    Returns
    -------
    Opened
        New pixels go back with the alpha that was given, and in colour where they are; those of a `Photo` or
        of a file, as they are.

    Raises
    ------
    ImageError
        If it is of another kind, or not a photo's pixels, or there is no such file.

    Examples
    --------
    >>> photo, back = opened(Image.new("L", (12, 8), 7), "image")
    >>> photo.pixels.shape, back(photo.pixels + 1).getpixel((0, 0))
    ((8, 12), 8)
    """
    kind = _opened(image, name)
    check_pixels(kind.photo.pixels, name)
    return kind


def pixels_of(image: AnyImage, name: str) -> NDArray[Any]:
    """Return the pixels of an image of any kind, without alpha; whether a face fits on them is not checked.

    Raises
    ------
    ImageError
        If it is of another kind, or there is no such file.

    Examples
    --------
    >>> pixels_of(np.zeros((5, 6, 4)), "image").shape
    (5, 6, 3)
    """
    return _opened(image, name).photo.pixels


def _opened(image: Any, name: str) -> Opened:
    if isinstance(image, (str, Path)):
        image = read_image(image)
    if isinstance(image, Photo):
        return Opened(image, lambda made: made)
    if isinstance(image, np.ndarray):
        return _opened_array(image)
    if isinstance(image, Image.Image):
        return _opened_pil(image, name)
    if is_tensor(image):
        return _opened_tensor(image, name)
    raise ImageError(
        f"{name}: expected an array, a Photo, a PIL image, a torch tensor or a path, got "
        f"{type(image).__name__}"
    )


def _opened_array(image: NDArray[Any]) -> Opened:
    planes = image.shape[2] if image.ndim == 3 else 0
    if planes not in (1, 2, 4):
        return Opened(Photo(image), lambda made: made)
    alpha = [image[..., -1]] if planes > 1 else []
    pixels = np.ascontiguousarray(image[..., :3] if planes == 4 else image[..., 0])
    return Opened(Photo(pixels), lambda made: np.dstack([made, *alpha]))


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

    def back(made: NDArray[Any]) -> Image.Image:
        if made.ndim == 3 and made.dtype != np.uint8:
            raise ImageError(
                f"{name}: a PIL image has no 16-bit colours, which the reference gives it; give a grey "
                "reference, or the target as an array"
            )
        result = Image.fromarray(made)
        if alpha is not None:
            result.putalpha(alpha)
        result.info = dict(image.info)
        if made.ndim != pixels.ndim:
            result.info.pop("icc_profile", None)  # a grey one; colours come in sRGB
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
    wrap = _tv_tensors().wrap if is_tv_tensor(image) else lambda tensor, like: tensor  # noqa: ARG005

    def back(made: NDArray[Any]) -> Any:
        channels = made[None] if made.ndim == 2 else made.transpose(2, 0, 1)
        tensor = torch.from_numpy(np.ascontiguousarray(channels))
        return wrap(tensor.to(device=image.device, dtype=image.dtype), like=image)

    return Opened(Photo(planes[0] if len(planes) == 1 else planes.transpose(1, 2, 0)), back)


def is_tensor(value: Any) -> bool:
    """Return whether something is a torch tensor."""
    torch = sys.modules.get("torch")
    return torch is not None and isinstance(value, torch.Tensor)


def is_tv_tensor(value: Any, kind: str = "TVTensor") -> bool:
    """Return whether something is a tensor of torchvision's, such as its ``Image`` or ``Mask``."""
    tv_tensors = _tv_tensors()
    return tv_tensors is not None and isinstance(value, getattr(tv_tensors, kind))


def _tv_tensors() -> Any:
    return sys.modules.get("torchvision.tv_tensors")
