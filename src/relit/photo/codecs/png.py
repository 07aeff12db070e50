"""PNG: pixels by imagecodecs, at any depth, and metadata in chunks that it neither reads nor writes."""

from __future__ import annotations

import struct
import zlib
from typing import TYPE_CHECKING, BinaryIO

from relit.errors import ImageError
from relit.photo.codecs.metadata import resolution
from relit.photo.codecs.named_colors import png_profile
from relit.photo.codecs.png_text import read_texts, signed, write_texts
from relit.photo.photo import Metadata, Photo

if TYPE_CHECKING:
    from relit.photo.codecs import CheckSize

_SIGNATURE_AND_HEADER = 33
_METRES_PER_INCH = 0.0254
_PICTURE = {b"PLTE", b"tRNS", b"IDAT", b"IEND"}
_COLOURS = {b"cICP", b"sRGB", b"gAMA", b"cHRM"}
_KNOWN = {b"acTL", b"tRNS", b"eXIf", b"pHYs", b"iCCP", *_COLOURS}
_MOST_TEXTS = 10_000  # far more than any photo has; damage may make millions
_TEXTS = {b"tEXt", b"zTXt", b"iTXt"}


def decode_png(stream: BinaryIO, check_size: CheckSize) -> Photo:
    """Read a PNG; palettes become RGB, transparent colours alpha, 1 to 4 bits 8."""
    import imagecodecs

    data = stream.read()
    width, height, bits, colour = struct.unpack_from(">IIBB", data, 16)
    found, texts, parts = _chunks(data)
    channels = {0: 1, 2: 3, 3: 3, 4: 2}.get(colour, 4) + (b"tRNS" in found)
    check_size(width, height, channels * max(1, bits // 8))
    if struct.unpack_from(">I", found.get(b"acTL", bytes(4)))[0] > 1:
        raise ImageError("animated; save one frame as a photo of its own")
    told = read_texts(texts)
    texts.clear()
    profile = png_profile(found, told.raw.get("icc"), grey=colour in (0, 4))
    dots, dpi = found.get(b"pHYs", b""), None
    if dots[8:] == b"\1":
        dpi = resolution(*(count * _METRES_PER_INCH for count in struct.unpack(">II", dots[:8])))
    iptc, photoshop = told.iptc
    metadata = Metadata(
        found.get(b"eXIf") or told.raw.get("exif"),
        told.xmp or told.raw.get("xmp"),
        dpi,
        iptc=iptc,
        photoshop=photoshop,
        text=tuple(told.text),
        names_srgb=profile is None and not _COLOURS.isdisjoint(found),
    )
    data = b"".join(parts)
    parts.clear()
    return Photo.from_samples(imagecodecs.png_decode(data), profile, metadata)


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
    metadata, chunks = photo.metadata, write_texts(photo.metadata)
    if photo.profile:
        chunks.append((b"iCCP", b"ICC profile\0\0" + zlib.compress(photo.profile)))
    elif metadata.names_srgb:
        chunks.append((b"sRGB", b"\0"))
    if metadata.dpi:
        counts = [round(dots / _METRES_PER_INCH) for dots in metadata.dpi]
        chunks.append((b"pHYs", struct.pack(">IIB", *counts, 1)))
    if metadata.exif:
        chunks.append((b"eXIf", metadata.exif))
    added = b"".join(signed(kind, content) for kind, content in chunks)
    return data[:_SIGNATURE_AND_HEADER] + added + data[_SIGNATURE_AND_HEADER:]


def _chunks(
    data: bytes,
) -> tuple[dict[bytes, bytes], list[tuple[bytes, memoryview]], list[memoryview]]:
    """Return the first chunk of each kind behind the header, texts, and what makes the picture.

    libpng gets to see no more than the last: it would unpack every other chunk, of which a file of a megabyte
    can hold gigabytes.
    """
    view, start = memoryview(data), _SIGNATURE_AND_HEADER
    found: dict[bytes, bytes] = {}
    texts: list[tuple[bytes, memoryview]] = []
    parts = [view[:start]]
    while start + 12 <= len(data):
        length, kind = struct.unpack_from(">I4s", data, start)
        end = start + length + 12
        if kind in _PICTURE:
            parts.append(view[start:end])
        if kind in _KNOWN and kind not in found:
            found[kind] = data[start + 8 : end - 4]
        elif kind in _TEXTS and len(texts) < _MOST_TEXTS:
            texts.append((kind, view[start + 8 : end - 4]))
        start = end
    return found, texts, parts
