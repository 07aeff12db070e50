"""OpenEXR: linear light in floats, taken to the curve of sRGB and back."""

from __future__ import annotations

import io
from typing import TYPE_CHECKING, Any, BinaryIO

import numpy as np

from relit.errors import ImageError
from relit.photo.codecs import srgb
from relit.photo.codecs.extras import extra
from relit.photo.codecs.raster import Raster
from relit.photo.pixels import to_unit

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from relit.photo.codecs.raster import CheckSize

_LAYOUTS = [("RGB",), ("RGBA",), ("Y",), ("A", "Y")]
#: What half floats may round up to.
_ONE = 1 + 2**-10


def decode_exr(stream: BinaryIO, check_size: CheckSize) -> Raster:
    """Read an OpenEXR of one part, grey or RGB with or without alpha, of light in [0, 1]."""
    library = openexr()
    if len(parts := library.File(stream, header_only=True).parts) > 1:
        raise ImageError("holds several parts; save one as a photo of its own")
    header = parts[0].header
    (left, top), (right, bottom) = (corner.tolist() for corner in header["dataWindow"])
    check_size(right - left + 1, bottom - top + 1, 12)
    stream.seek(0)
    channels = library.File(stream).parts[0].channels
    if (names := tuple(sorted(channels))) not in _LAYOUTS:
        raise ImageError(f"holds the channels {', '.join(names)}; save RGB, or RGB and A, alone")
    light = np.dstack([channels[name].pixels for name in reversed(names)])
    if light.dtype.kind != "f":
        raise ImageError(f"holds {light.dtype} values; save it in half or full floats")
    return Raster(
        _encoded(light.astype(np.float32)),
        srgb.profile_of(header["chromaticities"]) if "chromaticities" in header else None,
    )


def encode_exr(raster: Raster) -> bytes:
    """Write an OpenEXR of linear light in float32, its colours multiplied with alpha as is the custom.

    That loses the colours of what cannot be seen, where alpha is 0.
    """
    library = openexr()
    light = to_unit(raster.samples)
    colours = light.shape[2] - raster.has_alpha
    light[..., :colours] = srgb.to_light(light[..., :colours])
    if raster.has_alpha:
        light[..., :colours] *= light[..., -1:]
    if colours == 1:
        planes = map(np.ascontiguousarray, np.moveaxis(light, 2, 0))
        channels = dict(zip("YA", planes, strict=False))
    else:
        channels = {"RGBA"[: light.shape[2]]: light}
    header = {"compression": library.ZIP_COMPRESSION, "type": library.scanlineimage}
    buffer = io.BytesIO()
    library.File(header, channels).write(buffer)
    return buffer.getvalue()


def openexr() -> Any:
    """Return the optional library."""
    return extra("OpenEXR", "exr", "OpenEXR files")


def _encoded(light: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return light as sRGB values, the colours no longer multiplied with alpha."""
    colours = light
    if light.shape[2] in (2, 4):
        colours, alpha = light[..., :-1], light[..., -1:]
        np.divide(colours, alpha, out=colours, where=alpha > 0)
    low, high = light.min(), light.max()
    if not (low >= 0 and high <= _ONE):
        raise ImageError(
            f"holds light from {low:g} to {high:g}, and a photo ends at 0 and 1; tone-map it first"
        )
    colours[...] = srgb.encode(colours)
    return light.clip(0, 1, out=light)
