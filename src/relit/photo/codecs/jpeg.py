"""JPEG: pixels by imagecodecs, all else by Pillow; written as it was, to get no worse and no larger."""

from __future__ import annotations

import re
from contextlib import nullcontext
from typing import TYPE_CHECKING, Any, BinaryIO

import numpy as np
from PIL import ImageFile

from relit.errors import ImageError
from relit.photo.codecs.metadata import EXIF_PREFIX
from relit.photo.codecs.pillow import QUALITY, open_image, photo_from, pillow_setting, save_image
from relit.photo.photo import JpegSettings, Photo

if TYPE_CHECKING:
    from PIL import Image

    from relit.photo.codecs import CheckSize

_RGB_NAMES = [82, 71, 66]
#: The (px across, px down) sharing a colour that Pillow can write, beside 4:4:4.
_SUBSAMPLING = {(2, 2): "4:2:0", (2, 1): "4:2:2"}
#: More than a pixel of pure noise takes at the highest quality.
_WORST_BYTES = 8
_LARGEST_SEGMENT = 65533
_XMP_PREFIX = b"http://ns.adobe.com/xap/1.0/\0"
#: A marker: not a byte of the pixels, a restart between them, or one of several to fill up.
_MARKER = re.compile(rb"\xff([^\x00\xff\xd0-\xd7])")
_END = b"\xff\xd9"
#: Damage may ask for work without end: 200 million px in 20 scans take 5 s.
_MOST_IN_SCANS = 4_000_000_000


def decode_jpeg(stream: BinaryIO, check_size: CheckSize) -> Photo:
    """Read a JPEG, and how it is compressed; its pixels without Pillow, which keeps them twice."""
    import imagecodecs

    image = open_image(stream, check_size, "JPEG")
    stream.seek(0)
    data = stream.read()
    if image.width * image.height * _scans(data) > _MOST_IN_SCANS:
        raise ImageError("goes over its pixels again and again; get the file again")
    # Into an array of the size that was checked: one parser might find another size than the other.
    samples = np.empty(image.size[::-1] if image.mode == "L" else (*image.size[::-1], 3), np.uint8)
    imagecodecs.jpeg8_decode(data, out=samples)
    return photo_from(image, samples, _settings_of(image))


def _scans(data: bytes) -> int:
    """Count how often a JPEG goes over its pixels: once, or a dozen times where it is progressive.

    One whose last time has no end is refused: the decoder would leave the rest grey.
    """
    at = scans = last = 0
    while (found := _MARKER.search(data, at)) and found[0] != _END:
        start = at = found.end()
        if found[1] == b"\xda":
            scans, last = scans + 1, start
        if found[1] != b"\xd8":
            at += int.from_bytes(data[start : start + 2])
    if data.find(_END, last) < 0:
        raise EOFError("no end of the image")
    return scans


def _settings_of(image: Image.Image) -> JpegSettings | None:
    """Return how an opened JPEG is compressed; None where its tables come among its pixels."""
    opened: Any = image
    names, across, down, numbers = zip(*opened.layer, strict=True)
    if not set(numbers) <= set(opened.quantization):
        return None
    tables = [tuple(opened.quantization[number]) for number in numbers]
    if len(tables) == 3 and tables[1] == tables[2]:
        tables.pop()
    transform = image.info.get("adobe_transform", 0 if list(names) == _RGB_NAMES else 1)
    return JpegSettings(
        tuple(tables),
        (across[0] // max(across[1:], default=across[0]), down[0] // max(down[1:], default=down[0])),
        bool(image.info.get("progressive")),
        rgb=len(names) == 3 and transform == 0 and "jfif" not in image.info,
    )


def encode_jpeg(photo: Photo) -> bytes:
    """Write a JPEG, compressed as the photo was, or at quality 95 with colours at full resolution.

    EXIF and XMP that exceed a JPEG's segments, 64 KiB, are left out.
    """
    exif = EXIF_PREFIX + photo.metadata.exif if photo.metadata.exif else b""
    xmp = photo.metadata.xmp or b""
    options = _options(photo.jpeg, grey=photo.is_grey)
    height, width = photo.pixels.shape[:2]
    # A progressive JPEG must fit one buffer, and Pillow's guess is too small where the quality is highest.
    room = pillow_setting(ImageFile, "MAXBLOCK", _WORST_BYTES * height * width)
    with room if options.get("progressive") else nullcontext():
        return save_image(
            photo,
            "JPEG",
            icc_profile=photo.profile,
            exif=exif if len(exif) <= _LARGEST_SEGMENT else b"",
            xmp=xmp if len(_XMP_PREFIX + xmp) <= _LARGEST_SEGMENT else b"",
            **options,
        )


def _options(settings: JpegSettings | None, *, grey: bool) -> dict[str, Any]:
    """Return the options that Pillow takes for these settings.

    What not every reader takes becomes the nearest finer: a subsampling that Pillow does not write, and
    quantization beyond 8 bits.
    """
    if settings is None:
        return {"quality": QUALITY, "subsampling": 0}
    tables = [[min(step, 255) for step in table] for table in settings.tables]
    options = {"progressive": settings.progressive}
    if grey:
        return {"qtables": tables[:1], **options}
    across, down = (min(shared, 2) for shared in settings.subsampling)
    name = _SUBSAMPLING.get((across, down), "4:4:4")
    return {"qtables": tables, "subsampling": name, "keep_rgb": settings.rgb, **options}
