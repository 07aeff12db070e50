"""JPEG: pixels by imagecodecs, all else by Pillow; written as it was, to get no worse and no larger."""

from __future__ import annotations

import re
from contextlib import nullcontext
from dataclasses import replace
from typing import TYPE_CHECKING, Any, BinaryIO

import numpy as np
from PIL import ImageFile

from relit.errors import ImageError
from relit.photo.codecs.metadata import EXIF_PREFIX, FURTHER
from relit.photo.codecs.photoshop import from_segments, joined, to_segments
from relit.photo.codecs.pillow import QUALITY, open_image, photo_from, pillow_setting, save_image
from relit.photo.photo import JpegSettings, Photo

if TYPE_CHECKING:
    from PIL import Image

    from relit.photo.codecs import CheckSize
    from relit.photo.photo import Metadata

_RGB_NAMES = [82, 71, 66]
#: The (px across, px down) sharing a colour that Pillow can write, beside 4:4:4.
_SUBSAMPLING = {(2, 2): "4:2:0", (2, 1): "4:2:2"}
#: No library that Python has writes these with a file's own quantization tables.
_NAMED = {(1, 2): "4:4:0", (4, 1): "4:1:1", (4, 2): "4:1:0", (1, 4): "4:4:1"}
#: More than a pixel of pure noise takes at the highest quality.
_WORST_BYTES = 8
_MOST_COMMENTS = 1000  # damage may make half a million
#: What a JPEG may tell beside what is kept: XMP that did not fit one segment, and signed statements on where
#: a photo is from, which do not hold of a photo that was changed.
_LEFT_OUT = {
    ("APP1", b"http://ns.adobe.com/xmp/extension/\0"): "extended XMP",
    ("APP11", b"JP"): "content credentials",
}
#: A marker: not a byte of the pixels, a restart between them, or one of several to fill up.
_MARKER = re.compile(rb"\xff([^\x00\xff\xd0-\xd7])")
_END, _COMMENT = b"\xff\xd9", b"\xff\xfe"
#: What begins another JPEG, and what fills up a file.
_ANOTHER, _FILLING = b"\xff\xd8\xff", b"\0\xff\r\n"
#: Damage may ask for work without end: 200 million px in 20 scans take 5 s.
_MOST_IN_SCANS = 4_000_000_000


def decode_jpeg(stream: BinaryIO, check_size: CheckSize) -> Photo:
    """Read a JPEG, and how it is compressed; its pixels without Pillow, which keeps them twice."""
    import imagecodecs

    image = open_image(stream, check_size, "JPEG")
    stream.seek(0)
    data = stream.read()
    scans, end = _scans(data)
    if image.width * image.height * scans > _MOST_IN_SCANS:
        raise ImageError("goes over its pixels again and again; get the file again")
    # Into an array of the size that was checked: one parser might find another size than the other.
    samples = np.empty(image.size[::-1] if image.mode == "L" else (*image.size[::-1], 3), np.uint8)
    imagecodecs.jpeg8_decode(data, out=samples)
    photo = photo_from(image, samples, _settings_of(image))
    return replace(photo, metadata=_with_segments(photo.metadata, image, data[end:]))


def _with_segments(metadata: Metadata, image: Image.Image, rest: bytes) -> Metadata:
    """Return metadata with what Pillow leaves in segments: Photoshop's resources, and comments.

    What is behind the picture belongs to it as it was: a gain map, a depth, a video.
    """
    opened: Any = image
    segments: list[tuple[str, bytes]] = opened.applist
    iptc, photoshop = from_segments([content for name, content in segments if name == "APP13"])
    comments = [content for name, content in segments if name == "COM" and content]
    left_out = [
        told
        for (name, start), told in _LEFT_OUT.items()
        if any(found == name and content.startswith(start) for found, content in segments)
    ]
    if rest.strip(_FILLING):
        left_out.append(FURTHER if _ANOTHER in rest else "data behind the picture")
    return replace(
        metadata,
        iptc=iptc,
        photoshop=photoshop,
        comments=tuple(comments[:_MOST_COMMENTS]),
        left_out=tuple(left_out),
    )


def _scans(data: bytes) -> tuple[int, int]:
    """Return how often a JPEG goes over its pixels, a dozen times where it is progressive; and where it ends.

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
    return scans, found.end() if found else len(data)


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
    """Write a JPEG, compressed as the photo was, or at quality 95 with colours at full resolution."""
    metadata = photo.metadata
    exif = EXIF_PREFIX + metadata.exif if metadata.exif else b""
    segments = to_segments(joined(metadata.iptc, metadata.photoshop))
    segments += b"".join(_COMMENT + (2 + len(told)).to_bytes(2) + told for told in metadata.comments)
    options = _options(photo.jpeg, grey=photo.is_grey)
    height, width = photo.pixels.shape[:2]
    # A progressive JPEG must fit one buffer, and Pillow's guess is too small where the quality is highest.
    room = pillow_setting(ImageFile, "MAXBLOCK", _WORST_BYTES * height * width)
    with room if options.get("progressive") else nullcontext():
        return save_image(
            photo,
            "JPEG",
            icc_profile=photo.profile,
            exif=exif,
            xmp=metadata.xmp or b"",
            extra=segments,
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
    subsampling = _written(settings.subsampling)
    return {"qtables": tables, "subsampling": subsampling, "keep_rgb": settings.rgb, **options}


def _written(subsampling: tuple[int, int]) -> str:
    """Return the subsampling that Pillow writes for another: that, or the nearest finer one."""
    across, down = (min(shared, 2) for shared in subsampling)
    return _SUBSAMPLING.get((across, down), "4:4:4")


def finer_subsampling(settings: JpegSettings | None) -> str | None:
    """Return in words that colours will be shared by fewer px than they were, if so."""
    if settings is None or settings.subsampling in {(1, 1), *_SUBSAMPLING}:
        return None
    named = _NAMED.get(settings.subsampling, "odd")
    return f"{named} subsampling of colours ({_written(settings.subsampling)} instead)"
