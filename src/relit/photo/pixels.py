"""Pixel arrays: which ones we take, and how they go from one depth to another."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from relit.errors import ImageError

if TYPE_CHECKING:
    from numpy.typing import DTypeLike, NDArray

_DTYPES = (np.uint8, np.uint16, np.float32, np.float64)
_PART = 1 << 20

#: Photos are encoded by about this power of the light.
GAMMA = 2.2

#: The least light we tell from none: half a grey level of 8 bits. Darker pixels count as this bright, so that
#: the logarithm exists and noise in black does not become a face's features.
DARKEST = 0.5 / 255

#: The smallest side, in px, of an image that can hold a face.
SMALLEST_SIDE = 8


def check_pixels(image: Any, name: str) -> NDArray[Any]:
    """Return `image` if it passes `check_samples` and may hold a face: no side is below 8 px.

    Examples
    --------
    >>> check_pixels(np.zeros((8, 8, 4)), "target")
    Traceback (most recent call last):
        ...
    relit.errors.ImageError: target: expected shape (H, W) or (H, W, 3), got (8, 8, 4); keep alpha aside
    """
    check_samples(image, name)
    if min(image.shape[:2]) < SMALLEST_SIDE:
        height, width = image.shape[:2]
        raise ImageError(
            f"{name}: {width}x{height} px cannot hold a face; each side must be at least {SMALLEST_SIDE} px"
        )
    return np.asarray(image)


def check_samples(image: Any, name: str) -> None:
    """Refuse what is not the samples of a grey or RGB photo.

    Parameters
    ----------
    image : (H, W) or (H, W, 3) array
        uint8, uint16, or float32/float64 in [0, 1].
    name : str
        The argument's name, for the message.

    Raises
    ------
    ImageError
        If it is not an array of such a shape and dtype, or has values outside [0, 1] or NaN.
    """
    if not isinstance(image, np.ndarray):
        raise ImageError(
            f"{name}: expected a NumPy array, got {type(image).__name__}; of a Photo, take the .pixels"
        )
    if image.dtype not in _DTYPES:
        raise ImageError(f"{name}: expected uint8, uint16, float32 or float64, got {image.dtype}")
    if image.size == 0 or image.ndim not in (2, 3) or (image.ndim == 3 and image.shape[2] != 3):
        advice = "; keep alpha aside" if image.ndim == 3 and image.shape[2] in (2, 4) else ""
        raise ImageError(f"{name}: expected shape (H, W) or (H, W, 3), got {image.shape}{advice}")
    if image.dtype.kind == "f" and not (image.min() >= 0 and image.max() <= 1):
        raise ImageError(
            f"{name}: floats must be finite and in [0, 1], got values from {image.min():g} to "
            f"{image.max():g}; scale or clip them"
        )


def size_and_dtype(image: NDArray[Any]) -> str:
    """Return what the repr of an image says of its pixels.

    Examples
    --------
    >>> import numpy as np
    >>> size_and_dtype(np.zeros((2, 3), np.uint8)), size_and_dtype(np.zeros((2, 3, 3)))
    ('3x2 grey uint8', '3x2 float64')
    """
    height, width, *planes = image.shape
    return f"{width}x{height} {'' if planes else 'grey '}{image.dtype}"


def full_of(dtype: DTypeLike) -> int:
    """Return the number that means white, or opaque."""
    return int(np.iinfo(np.dtype(dtype)).max) if np.dtype(dtype).kind == "u" else 1


def to_unit(image: NDArray[Any]) -> NDArray[np.float32]:
    """Return `image` as float32 in [0, 1], whatever its dtype.

    Examples
    --------
    >>> to_unit(np.array([[0, 51, 255]], np.uint8)).tolist()
    [[0.0, 0.20000000298023224, 1.0]]
    """
    if image.dtype.kind == "u":
        return image.astype(np.float32) / np.float32(full_of(image.dtype))
    return image.astype(np.float32)


def from_unit(image: NDArray[np.floating[Any]], dtype: DTypeLike) -> NDArray[Any]:
    """Return float values as `dtype`, clipped to [0, 1] and, for integers, rounded to the nearest.

    Examples
    --------
    >>> from_unit(np.array([[-0.1, 0.2, 1.5]]), np.uint8).tolist()
    [[0, 51, 255]]
    """
    clipped = np.clip(image, 0, 1)  # a new array
    if np.dtype(dtype).kind == "u":
        clipped *= full_of(dtype)
        np.rint(clipped, out=clipped)
    return np.asarray(clipped, dtype)


def to_depth(samples: NDArray[Any], dtype: DTypeLike, maximum: int | None = None) -> NDArray[Any]:
    """Return samples as uint8, uint16, or float32 in [0, 1], rounded to the nearest.

    Integers are in [0, `maximum`], by default the largest number of their dtype.

    Examples
    --------
    >>> to_depth(np.array([0, 128, 129, 65535], dtype=np.uint16), np.uint8)
    array([  0,   0,   1, 255], dtype=uint8)
    >>> to_depth(np.array([0, 512, 1023]), np.uint16, 1023)
    array([    0, 32800, 65535], dtype=uint16)
    """
    if maximum is None and samples.dtype == dtype:
        return samples
    if np.dtype(dtype).kind == "f":
        return to_unit(samples)
    if samples.dtype.kind == "f":
        return from_unit(samples, dtype)
    full, maximum = full_of(dtype), maximum or full_of(samples.dtype)
    if maximum == full:
        return samples.astype(dtype)
    # In parts, because 32 bits for each sample of a large photo are gigabytes.
    flat, scaled = samples.reshape(-1), np.empty(samples.size, dtype)
    for start in range(0, flat.size, _PART):
        part = slice(start, start + _PART)
        # 65535 * 65535 + 32767 is the largest number met here, and it fits 32 bits.
        wide = np.minimum(flat[part], maximum).astype(np.uint32)
        scaled[part] = (wide * full + maximum // 2) // maximum
    return scaled.reshape(samples.shape)


def divide_by_alpha(samples: NDArray[Any]) -> None:
    """Undo, in place, the multiplication of the colours of ``(H, W, C)`` samples with the last, alpha."""
    full = full_of(samples.dtype)
    colour, alpha = samples[..., :-1].astype(np.float64), samples[..., -1:]
    np.divide(colour * full, alpha, out=colour, where=alpha > 0)
    samples[..., :-1] = (colour if full == 1 else np.rint(colour)).clip(0, full)
