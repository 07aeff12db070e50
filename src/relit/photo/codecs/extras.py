"""The formats that take a library of their own, an extra of relit: HEIC, camera raw and OpenEXR."""

from __future__ import annotations

import io
import sys
from contextlib import contextmanager, redirect_stdout
from importlib import import_module
from typing import TYPE_CHECKING, Any, BinaryIO

import numpy as np

from relit.errors import ImageError
from relit.photo.codecs.metadata import FURTHER, put_upright
from relit.photo.codecs.named_colors import refuse_hdr
from relit.photo.codecs.tiff import read_metadata
from relit.photo.photo import Metadata, Photo
from relit.photo.pixels import divide_by_alpha, to_depth, to_unit
from relit.photo.profile import decode_srgb, encode_srgb, rgb_profile
from relit.runtime.muting import muted

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from numpy.typing import NDArray

    from relit.photo.codecs import CheckSize

#: Of ITU-T H.273: primaries that are not stated.
_UNSTATED = 2
_EXR_CHANNELS = [("RGB",), ("RGBA",), ("Y",), ("A", "Y")]
#: What half floats may round 1 up to.
_ONE = 1 + 2**-10


def _extra(library: str, name: str, what: str) -> Any:
    """Return an optional library, or say how to install it."""
    try:
        return import_module(library)
    except ImportError as error:
        raise ImageError(f"{what} need an extra: pip install 'relit[{name}]'") from error


def _heif() -> Any:
    """Return a library for HEIC: pillow-heif, or its twin without an encoder, which is under the GPL."""
    try:
        return import_module("pillow_heif")
    except ImportError:
        return _extra("pi_heif", "heic", "HEIC files")


def decode_heif(stream: BinaryIO, check_size: CheckSize) -> Photo:
    """Read the primary image of a HEIC; 10 and 12 bits become 16."""
    file = _heif().open_heif(stream, convert_hdr_to_8bit=False)
    image = file[file.primary_index]
    check_size(*image.size, 6)
    samples = np.array(image)  # a copy: the memory of older releases goes with the image
    if samples.dtype == np.uint16:  # pillow-heif shifts fewer bits to the left
        bits = image.info["bit_depth"]
        samples = to_depth(samples >> (16 - bits), np.uint16, 2**bits - 1)
    if image.premultiplied_alpha:
        divide_by_alpha(samples)
    info = image.info
    left_out = (FURTHER,) if len(file) > 1 or info.get("aux") or info.get("depth_images") else ()
    # libheif has turned the pixels already, as the file's own box tells; EXIF only repeats it.
    _orientation, metadata = put_upright(Metadata(info["exif"], info.get("xmp"), left_out=left_out))
    return Photo.from_samples(samples, _heif_profile(info), metadata)


def _heif_profile(info: dict[str, Any]) -> bytes | None:
    """Return the ICC profile of a HEIC, or one of the primaries that it names instead."""
    if profile := info.get("icc_profile"):
        return bytes(profile)
    named = info.get("nclx_profile", {})
    refuse_hdr(named.get("transfer_characteristics", _UNSTATED))
    if named.get("color_primaries", _UNSTATED) == _UNSTATED:
        return None
    points = ("red", "green", "blue", "white")
    return rgb_profile([named[f"color_primary_{point}_{axis}"] for point in points for axis in "xy"])


def decode_raw(stream: BinaryIO, check_size: CheckSize) -> Photo:
    """Develop a camera raw file to 16-bit sRGB, upright, as the camera balanced and exposed it."""
    rawpy = _extra("rawpy", "raw", "camera raw files")
    harm: list[bytes] = []

    def is_of_harm(line: bytes) -> bool:
        # LibRaw goes on with black where a file ends too soon, and tells stderr alone.
        if told := line.startswith(b"unknown file: "):
            harm.append(line)
        return told

    try:
        with muted(is_of_harm):
            opened = rawpy.imread(stream)
    except rawpy.LibRawFileUnsupportedError as error:
        raise ImageError(
            "starts with a preview, as camera raw files do, but is none that LibRaw knows; "
            "save the photo alone"
        ) from error
    with opened as raw, muted(is_of_harm):
        check_size(raw.sizes.width, raw.sizes.height, 6)
        samples = raw.postprocess(
            output_bps=16,
            output_color=rawpy.ColorSpace.sRGB,
            gamma=(2.4, 12.92),
            use_camera_wb=True,
            no_auto_bright=True,  # it would burn out the brightest 1 % of every photo
        )
    if harm:
        raise ImageError("the RAW data is damaged or cut short; get the file again")
    # LibRaw has turned the pixels already, as EXIF tells.
    _orientation, metadata = put_upright(read_metadata(stream))
    return Photo.from_samples(samples, metadata=metadata)


def openexr() -> Any:
    """Return the library for OpenEXR."""
    return _extra("OpenEXR", "exr", "OpenEXR files")


def decode_exr(stream: BinaryIO, check_size: CheckSize) -> Photo:
    """Read an OpenEXR of one part, grey or RGB with or without alpha, of light in [0, 1]."""
    library = openexr()
    with _quiet():
        parts = library.File(stream, header_only=True).parts
    if len(parts) > 1:
        raise ImageError("holds several parts; save one as a photo of its own")
    header = parts[0].header
    (left, top), (right, bottom) = (corner.tolist() for corner in header["dataWindow"])
    check_size(right - left + 1, bottom - top + 1, 12)
    stream.seek(0)
    with _quiet():
        channels = library.File(stream).parts[0].channels
    if (names := tuple(sorted(channels))) not in _EXR_CHANNELS:
        raise ImageError(f"holds the channels {', '.join(names)}; save RGB, or RGB and A, alone")
    light = np.dstack([channels[name].pixels for name in reversed(names)])
    if light.dtype.kind != "f":
        raise ImageError(f"holds {light.dtype} values; save it in half or full floats")
    light = light.astype(np.float32)
    colours = light
    if light.shape[2] in (2, 4):  # its colours are multiplied with alpha
        colours, alpha = light[..., :-1], light[..., -1:]
        np.divide(colours, alpha, out=colours, where=alpha > 0)
    low, high = light.min(), light.max()
    if not (low >= 0 and high <= _ONE):
        raise ImageError(
            f"holds light from {low:g} to {high:g}, and a photo ends at 0 and 1; tone-map it first"
        )
    colours[...] = encode_srgb(colours)
    primaries = header.get("chromaticities")
    return Photo.from_samples(
        light.clip(0, 1, out=light), None if primaries is None else rgb_profile(primaries)
    )


@contextmanager
def _quiet() -> Iterator[None]:
    """Keep from stderr and stdout what OpenEXR says of a damaged file beside raising an exception."""

    def is_openexrs(line: bytes) -> bool:
        return line.startswith((b"<python_buffer>: ", b"Warning: Exception raised reading "))

    said = io.StringIO()
    with muted(is_openexrs):
        try:
            with redirect_stdout(said):  # which it prints to as Python does
                yield
        finally:
            for line in said.getvalue().splitlines(keepends=True):
                if sys.stdout and not is_openexrs(line.encode("utf-8", "replace")):
                    sys.stdout.write(line)


def encode_exr(photo: Photo) -> bytes:
    """Write an OpenEXR of linear light in float32, its colours multiplied with alpha as is the custom.

    That loses the colours of what cannot be seen, where alpha is 0.
    """
    return encode_exr_layers(photo, {})


def encode_exr_layers(photo: Photo, channels: Mapping[str, NDArray[np.floating[Any]]]) -> bytes:
    """Write a photo as `encode_exr` does, and further channels by their names, "layer.R" and so on."""
    library = openexr()
    light = to_unit(photo.samples)
    colours = light[..., : 1 if photo.is_grey else 3]
    colours[...] = decode_srgb(colours)
    if photo.alpha is not None:
        colours *= light[..., -1:]
    if photo.is_grey:
        planes = map(np.ascontiguousarray, np.moveaxis(light, 2, 0))
        own = dict(zip("YA", planes, strict=False))
    else:
        own = {"RGBA"[: light.shape[2]]: light}
    header = {"compression": library.ZIP_COMPRESSION, "type": library.scanlineimage}
    buffer = io.BytesIO()
    library.File(header, own | dict(channels)).write(buffer)
    return buffer.getvalue()
