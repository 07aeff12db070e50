"""PNG: pixels by imagecodecs, at any depth, and metadata in chunks that it neither reads nor writes."""

from __future__ import annotations

import struct
import zlib
from typing import TYPE_CHECKING, BinaryIO

from relit.errors import ImageError
from relit.photo.codecs.metadata import resolution
from relit.photo.photo import Metadata, Photo

if TYPE_CHECKING:
    from relit.photo.codecs import CheckSize

_SIGNATURE_AND_HEADER = 33
_LARGEST_TEXT = 1 << 24
_METRES_PER_INCH = 0.0254
_PICTURE = {b"PLTE", b"tRNS", b"IDAT", b"IEND"}
_KNOWN = {b"acTL", b"tRNS", b"iCCP", b"eXIf", b"iTXt", b"pHYs"}
_XMP = b"XML:com.adobe.xmp\0"


def decode_png(stream: BinaryIO, check_size: CheckSize) -> Photo:
    """Read a PNG; palettes become RGB, transparent colours alpha, 1 to 4 bits 8."""
    import imagecodecs

    data = stream.read()
    width, height, bits, colour = struct.unpack_from(">IIBB", data, 16)
    found, parts = _chunks(data)
    channels = {0: 1, 2: 3, 3: 3, 4: 2}.get(colour, 4) + (b"tRNS" in found)
    check_size(width, height, channels * max(1, bits // 8))
    if struct.unpack_from(">I", found.get(b"acTL", bytes(4)))[0] > 1:
        raise ImageError("animated; save one frame as a photo of its own")
    profile = _inflate(found[b"iCCP"].partition(b"\0")[2][1:]) if b"iCCP" in found else None
    xmp = _text(found[b"iTXt"]) if b"iTXt" in found else None
    dots, dpi = found.get(b"pHYs", b""), None
    if dots[8:] == b"\1":
        dpi = resolution(*(count * _METRES_PER_INCH for count in struct.unpack(">II", dots[:8])))
    data = b"".join(parts)
    parts.clear()
    return Photo.from_samples(imagecodecs.png_decode(data), profile, Metadata(found.get(b"eXIf"), xmp, dpi))


def encode_png(photo: Photo) -> bytes:
    """Write a PNG, lossless, at 8 or 16 bits."""
    import imagecodecs

    samples = photo.samples
    # What is left of a photo by Paeth's predictor hardly repeats itself: with runs alone, five photos take a
    # third of the time of the usual search for repetitions, at level 3, and up to 12 % less room.
    data = bytes(
        imagecodecs.png_encode(
            samples[..., 0] if samples.shape[2] == 1 else samples,
            strategy=imagecodecs.PNG.STRATEGY.RLE,
            filter=imagecodecs.PNG.FILTER.PAETH,
        )
    )
    metadata, chunks = photo.metadata, b""
    if photo.profile:
        chunks += _chunk(b"iCCP", b"ICC profile\0\0" + zlib.compress(photo.profile))
    if metadata.dpi:
        counts = [round(dots / _METRES_PER_INCH) for dots in metadata.dpi]
        chunks += _chunk(b"pHYs", struct.pack(">IIB", *counts, 1))
    if metadata.exif:
        chunks += _chunk(b"eXIf", metadata.exif)
    if metadata.xmp:
        chunks += _chunk(b"iTXt", _XMP + b"\0\0\0\0" + metadata.xmp)
    return data[:_SIGNATURE_AND_HEADER] + chunks + data[_SIGNATURE_AND_HEADER:]


def _chunk(kind: bytes, content: bytes) -> bytes:
    return struct.pack(">I", len(content)) + kind + content + struct.pack(">I", zlib.crc32(kind + content))


def _chunks(data: bytes) -> tuple[dict[bytes, bytes], list[memoryview]]:
    """Return the first chunk of each kind behind the header, and the parts of the file that make the picture.

    Of texts, only XMP counts. libpng gets to see no more than these parts: it would unpack every other chunk,
    of which a file of a megabyte can hold gigabytes.
    """
    view, start = memoryview(data), _SIGNATURE_AND_HEADER
    found: dict[bytes, bytes] = {}
    parts = [view[:start]]
    while start + 12 <= len(data):
        length, kind = struct.unpack_from(">I4s", data, start)
        end = start + length + 12
        if kind in _PICTURE:
            parts.append(view[start:end])
        if kind in _KNOWN and kind not in found:
            content = data[start + 8 : end - 4]
            if kind != b"iTXt" or content.startswith(_XMP):
                found[kind] = content
        start = end
    return found, parts


def _text(content: bytes) -> bytes | None:
    """Return the text of an iTXt chunk: keyword, compression flag and method, language, keyword, text."""
    rest = content.partition(b"\0")[2]
    text = rest[2:].partition(b"\0")[2].partition(b"\0")[2]
    return _inflate(text) if rest[:1] == b"\1" else text


def _inflate(data: bytes) -> bytes | None:
    """Return the content of a compressed chunk; None where it is damaged, or larger than an honest one."""
    inflater = zlib.decompressobj()
    try:
        content = inflater.decompress(data, _LARGEST_TEXT)
    except zlib.error:
        return None
    return content if inflater.eof else None
