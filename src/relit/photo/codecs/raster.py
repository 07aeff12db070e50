"""What the codecs exchange: samples as they lie in a file, with what the file says about them."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from relit.photo.codecs.jpeg import JpegSettings
from relit.photo.codecs.metadata import Metadata
from relit.photo.pixels import from_unit, to_unit

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import DTypeLike, NDArray

    #: Called with width, height and perhaps the bytes a pixel takes (3, unless told), before any pixel is
    #: decoded; raises where they are too large.
    CheckSize = Callable[..., None]


_PART = 1 << 20


@dataclass(frozen=True, eq=False)
class Raster:
    """Samples of a file.

    Attributes
    ----------
    samples : ndarray, shape (H, W, C)
        Grey, grey and alpha, RGB, or RGB and alpha; uint8, uint16, or float32 in [0, 1].
    profile : bytes or None
        ICC profile.
    metadata : Metadata
    jpeg : JpegSettings or None
        How a JPEG is compressed.
    """

    samples: NDArray[Any]
    profile: bytes | None = None
    metadata: Metadata = field(default_factory=Metadata)
    jpeg: JpegSettings | None = None

    @property
    def has_alpha(self) -> bool:
        """Whether the last channel is alpha."""
        return self.samples.shape[2] in (2, 4)


def rescale(samples: NDArray[Any], maximum: int, dtype: DTypeLike) -> NDArray[Any]:
    """Return integers in [0, `maximum`] spread over the whole range of `dtype`, uint8 or uint16.

    Examples
    --------
    >>> rescale(np.array([0, 512, 1023]), 1023, np.uint16)
    array([    0, 32800, 65535], dtype=uint16)
    """
    full = int(np.iinfo(np.dtype(dtype)).max)
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


def to_depth(samples: NDArray[Any], dtype: DTypeLike) -> NDArray[Any]:
    """Return samples as uint8, uint16, or float32 in [0, 1], rounded to the nearest.

    Examples
    --------
    >>> to_depth(np.array([0, 128, 129, 65535], dtype=np.uint16), np.uint8)
    array([  0,   0,   1, 255], dtype=uint8)
    """
    if samples.dtype == dtype:
        return samples
    if np.dtype(dtype).kind == "f":
        return to_unit(samples)
    if samples.dtype.kind == "f":
        return from_unit(samples, dtype)
    return rescale(samples, int(np.iinfo(samples.dtype).max), dtype)


def full_of(samples: NDArray[Any]) -> int:
    """Return the number that is 1: white, or opaque."""
    return 1 if samples.dtype.kind == "f" else int(np.iinfo(samples.dtype).max)


def divide_by_alpha(samples: NDArray[Any]) -> None:
    """Undo, in place, the multiplication of the colours with alpha."""
    full = full_of(samples)
    colour, alpha = samples[..., :-1].astype(np.float64), samples[..., -1:]
    np.divide(colour * full, alpha, out=colour, where=alpha > 0)
    samples[..., :-1] = (colour if full == 1 else np.rint(colour)).clip(0, full)
