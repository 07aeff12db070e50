"""JPEG, WebP and BMP: the formats that Pillow reads and writes in full."""

from __future__ import annotations

import io
import re
import threading
import warnings
from contextlib import contextmanager, nullcontext
from typing import TYPE_CHECKING, Any, BinaryIO

import numpy as np
from PIL import Image, ImageFile

from relit.errors import ImageError
from relit.photo.codecs.jpeg import encoder_options, settings_of
from relit.photo.codecs.metadata import EXIF_PREFIX, Metadata, resolution
from relit.photo.codecs.raster import Raster

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    from relit.photo.codecs.raster import CheckSize

_MODES = {"1": "L", "L": "L", "P": "RGB", "RGB": "RGB", "RGBA": "RGBA"}
_QUALITY = 95
#: More than a pixel of pure noise takes in a JPEG of the highest quality.
_WORST_BYTES = 8
_LARGEST_SEGMENT = 65533
_XMP_PREFIX = b"http://ns.adobe.com/xap/1.0/\0"
_PILLOW = threading.Lock()
_ROWS = 256
#: A marker of a JPEG: not a byte of its pixels, a restart between them, or one of several to fill up.
_MARKER = re.compile(rb"\xff([^\x00\xff\xd0-\xd7])")
# Damage may ask for work without end: 200 million px in 20 scans take 5 s; 10 million in run lengths, one
# byte at a time in Python, take 1 s.
_MOST_IN_SCANS = 4_000_000_000
_RUNS, _MOST_IN_RUNS = (1, 2), 10_000_000


@contextmanager
def quiet_pillow() -> Iterator[None]:
    """Keep Pillow from warning of odd metadata, which is left out, and from its own limit on pixels.

    Warning filters and the limit belong to the whole process: one thread at a time changes them, and only
    while a header is parsed.
    """
    with _PILLOW, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        limit, Image.MAX_IMAGE_PIXELS = Image.MAX_IMAGE_PIXELS, None
        try:
            yield
        finally:
            Image.MAX_IMAGE_PIXELS = limit


@contextmanager
def _room_for(size: int) -> Iterator[None]:
    """Let Pillow write a progressive JPEG of this many bytes.

    It must fit one buffer, for which Pillow's guess is too small where the quality is highest.
    """
    with _PILLOW:
        block, ImageFile.MAXBLOCK = ImageFile.MAXBLOCK, size
        try:
            yield
        finally:
            ImageFile.MAXBLOCK = block


def decode_with_pillow(stream: BinaryIO, check_size: CheckSize, *, name: str) -> Raster:
    """Read a JPEG, WebP or BMP; palettes become RGB, single bits 8."""
    with quiet_pillow():
        image = Image.open(stream, formats=(name,))
    with image:
        check_size(*image.size)
        # An MPO is a JPEG with further pictures behind the photo, such as a gain map.
        if image.format != "MPO" and getattr(image, "is_animated", False):
            raise ImageError("animated; save one frame as a photo of its own")
        if image.mode not in _MODES:
            raise ImageError(f"holds {image.mode} colours; convert it to RGB or grey first")
        area = image.width * image.height
        if name == "JPEG" and area * _scans(stream) > _MOST_IN_SCANS:
            raise ImageError("goes over its pixels again and again; get the file again")
        if name == "BMP" and image.info["compression"] in _RUNS and area > _MOST_IN_RUNS:
            raise ImageError("holds a large picture in run lengths; save it as PNG")
        samples = _webp_samples(stream) if name == "WEBP" else _samples(image)
    info = image.info
    metadata = Metadata(info.get("exif"), info.get("xmp"), resolution(*info.get("dpi", (0, 0))))
    jpeg = settings_of(image) if name == "JPEG" else None
    return Raster(samples.reshape(*samples.shape[:2], -1), info.get("icc_profile"), metadata, jpeg)


def _samples(image: Image.Image) -> NDArray[Any]:
    """Return the pixels as an array, part by part: `np.array(image)` copies the whole several times."""
    if image.mode != (mode := _MODES[image.mode]):
        image = image.convert(mode)
    samples = np.empty((image.height, image.width, len(mode)), np.uint8)
    for top in range(0, image.height, _ROWS):
        part = image.crop((0, top, image.width, min(top + _ROWS, image.height)))
        samples[top : top + _ROWS] = np.asarray(part).reshape(part.height, part.width, -1)
    return samples


def _webp_samples(stream: BinaryIO) -> NDArray[Any]:
    """Decode without Pillow, which keeps four copies of the whole."""
    import imagecodecs

    stream.seek(0)
    return np.asarray(imagecodecs.webp_decode(stream.read()))


def _scans(stream: BinaryIO) -> int:
    """Count how often a JPEG goes over its pixels: once, or a dozen times where it is progressive."""
    stream.seek(0)
    data = stream.read()
    at = scans = 0
    while (found := _MARKER.search(data, at)) and found[1] != b"\xd9":
        scans += found[1] == b"\xda"
        start = at = found.end()
        if found[1] != b"\xd8":
            at += int.from_bytes(data[start : start + 2])
    return scans


def encode_jpeg(raster: Raster) -> bytes:
    """Write a JPEG, compressed as the photo was, or at quality 95 with colours at full resolution.

    EXIF and XMP that exceed a JPEG's segments, 64 KiB, are left out.
    """
    exif = EXIF_PREFIX + raster.metadata.exif if raster.metadata.exif else b""
    xmp = raster.metadata.xmp or b""
    height, width, channels = raster.samples.shape
    options = encoder_options(raster.jpeg, grey=channels == 1)
    room = _room_for(_WORST_BYTES * height * width) if options.get("progressive") else nullcontext()
    with room:
        return _encode(
            raster,
            "JPEG",
            icc_profile=raster.profile,
            exif=exif if len(exif) <= _LARGEST_SEGMENT else b"",
            xmp=xmp if len(_XMP_PREFIX + xmp) <= _LARGEST_SEGMENT else b"",
            **options,
        )


def encode_webp(raster: Raster) -> bytes:
    """Write a lossy WebP at quality 95; alpha, and the colours where it is 0, are kept."""
    return _encode(
        raster,
        "WEBP",
        quality=_QUALITY,
        exact=True,
        icc_profile=raster.profile,
        exif=raster.metadata.exif or b"",
        xmp=raster.metadata.xmp or b"",
    )


def encode_bmp(raster: Raster) -> bytes:
    """Write a BMP, lossless, with no more metadata than the resolution."""
    return _encode(raster, "BMP")


def _encode(raster: Raster, name: str, **options: Any) -> bytes:
    samples = raster.samples
    image = Image.fromarray(samples[..., 0] if samples.shape[2] == 1 else samples)
    buffer = io.BytesIO()
    image.save(buffer, name, dpi=raster.metadata.dpi or (0, 0), **options)
    return buffer.getvalue()
