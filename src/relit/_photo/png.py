"""PNG: pixels by imagecodecs, at any depth, and metadata in chunks that it neither reads nor writes."""

from __future__ import annotations

import struct
import zlib
from typing import TYPE_CHECKING, BinaryIO

from relit._photo.metadata import Metadata, resolution
from relit._photo.raster import Raster
from relit.errors import ImageError

if TYPE_CHECKING:
    from collections.abc import Iterator

    from relit._photo.raster import CheckSize

_SIGNATURE_AND_HEADER = 33
_LARGEST_TEXT = 1 << 24
_METRES_PER_INCH = 0.0254
_XMP = b"XML:com.adobe.xmp\0"

# Filtering and compressing at level 6, zlib's own default, takes 2.5 times as long to save 3 %.
_LEVEL = 3


def decode_png(stream: BinaryIO, check_size: CheckSize) -> Raster:
    """Read a PNG; palettes become RGB, transparent colours alpha, 1 to 4 bits 8."""
    import imagecodecs

    data = stream.read()
    check_size(*struct.unpack_from(">II", data, 16))
    profile, exif, xmp, dpi = None, None, None, None
    for kind, content in _chunks(data):
        if kind == b"acTL" and struct.unpack_from(">I", content)[0] > 1:
            raise ImageError("animated; save one frame as a photo of its own")
        if kind == b"iCCP":
            profile = _inflate(content.partition(b"\0")[2][1:])
        elif kind == b"eXIf":
            exif = content
        elif kind == b"iTXt" and content.startswith(_XMP):
            xmp = _text(content)
        elif kind == b"pHYs" and content[8:] == b"\1":
            dpi = resolution(*(count * _METRES_PER_INCH for count in struct.unpack(">II", content[:8])))
    samples = imagecodecs.png_decode(data)
    return Raster(samples.reshape(*samples.shape[:2], -1), profile, Metadata(exif, xmp, dpi))


def encode_png(raster: Raster) -> bytes:
    """Write a PNG, lossless, at 8 or 16 bits."""
    import imagecodecs

    samples = raster.samples
    data = bytes(imagecodecs.png_encode(samples[..., 0] if samples.shape[2] == 1 else samples, level=_LEVEL))
    metadata, chunks = raster.metadata, b""
    if raster.profile:
        chunks += _chunk(b"iCCP", b"ICC profile\0\0" + zlib.compress(raster.profile))
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


def _chunks(data: bytes) -> Iterator[tuple[bytes, bytes]]:
    """Yield the kind and the content of each chunk after the header; a checksum ends each."""
    start = _SIGNATURE_AND_HEADER
    while start + 12 <= len(data):
        length, kind = struct.unpack_from(">I4s", data, start)
        yield kind, b"" if kind == b"IDAT" else data[start + 8 : start + 8 + length]
        start += length + 12


def _text(content: bytes) -> bytes | None:
    """Return what an iTXt chunk says: keyword, compression flag and method, language, keyword, text."""
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
