"""Metadata, put upright as the pixels are; EXIF with further texts."""

from __future__ import annotations

import re
import struct
from dataclasses import replace
from typing import TYPE_CHECKING

from PIL.ExifTags import Base

from relit.photo.codecs.photoshop import without_places

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from relit.photo.photo import Metadata

EXIF_PREFIX = b"Exif\0\0"
#: What is left out, in words: an EXIF block; a gain map, a depth, another shot.
UNREADABLE, FURTHER = "EXIF that cannot be read", "further pictures"
_ORDERS = {b"II*\0": "<", b"MM\0*": ">"}
_NO_EXIF = b"II*\0\x08\0\0\0" + bytes(6)
_THUMBNAILS_END = b"</xmp:Thumbnails>"
_MOST_NAMES = 4
_ASCII = 2  # the type of EXIF's texts
_XMP_ORIENTATION = re.compile(rb"(tiff:Orientation(?:\s*=\s*[\"']|>))\s*[1-8]")


def put_upright(metadata: Metadata) -> tuple[int, Metadata]:
    """Return the EXIF orientation of a file, and its metadata once the pixels are upright.

    EXIF that cannot be parsed is left out, and counts as orientation 1. So are thumbnails in XMP, which would
    still show the old light, and what tells places in pixels that are turned.
    """
    given = (metadata.exif or b"").removeprefix(EXIF_PREFIX)
    orientation, exif = _take_orientation(given)
    if given and exif is None:
        metadata = replace(metadata, left_out=(*metadata.left_out, UNREADABLE))
    metadata = replace(metadata, exif=exif, xmp=_without_thumbnails(metadata.xmp))
    if orientation > 1:
        if metadata.xmp:
            metadata = replace(metadata, xmp=_XMP_ORIENTATION.sub(rb"\g<1>1", metadata.xmp))
        photoshop = without_places(metadata.photoshop)
        gone = [*metadata.left_out]
        gone += ["GeoTIFF"] if metadata.geo else []
        gone += ["paths and guides"] if photoshop != metadata.photoshop else []
        metadata = replace(metadata, photoshop=photoshop, geo=(), left_out=tuple(gone))
    if orientation > 4 and metadata.dpi:
        metadata = replace(metadata, dpi=metadata.dpi[::-1])
    return orientation, metadata


def _without_thumbnails(xmp: bytes | None) -> bytes | None:
    """Return XMP without its list of thumbnails, as Adobe's programs and exiftool write it."""
    start, end = (xmp or b"").find(b"<xmp:Thumbnails>"), (xmp or b"").find(_THUMBNAILS_END)
    return xmp[:start] + xmp[end + len(_THUMBNAILS_END) :] if xmp and 0 <= start < end else xmp


def with_texts(
    exif: bytes | None, texts: Mapping[int, bytes], most: int | None
) -> tuple[bytes | None, set[int]]:
    """Return an EXIF block with texts by their tags, and the tags that tell just that in it.

    What it tells already stays, and so does where all of it is, since makers' notes hold offsets: a new
    directory comes behind. Texts that would make it larger than `most` bytes are left out.
    """
    block = exif or _NO_EXIF
    order = _ORDERS.get(block[:4])
    try:
        (start,) = struct.unpack_from(f"{order}I", block, 4)
        (count,) = struct.unpack_from(f"{order}H", block, start)
        entries = {}
        for at in range(start + 2, start + 2 + 12 * count, 12):
            (tag,) = struct.unpack_from(f"{order}H", block, at)
            entries[tag] = struct.unpack_from("12s", block, at)[0]
        (following,) = struct.unpack_from(f"{order}4s", block, start + 2 + 12 * count)
    except struct.error:
        return exif, set()
    told = {tag for tag in texts.keys() & entries.keys() if _text(block, entries[tag], order) == texts[tag]}
    new = texts.keys() - entries.keys()
    for tag in sorted(new):
        text = texts[tag]
        if len(block) + len(text) + 12 * len(entries) + 64 > (most or 1 << 30):
            continue
        value = text + b"\0"
        if len(value) <= 4:
            held = value.ljust(4, b"\0")
        else:
            block += bytes(len(block) % 2)
            held = struct.pack(f"{order}I", len(block))
            block += value
        entries[tag] = struct.pack(f"{order}HHI4s", tag, _ASCII, len(value), held)
        told.add(tag)
    if not told & new:
        return exif, told
    block += bytes(len(block) % 2)
    head = block[:4] + struct.pack(f"{order}I", len(block))
    directory = struct.pack(f"{order}H", len(entries)) + b"".join(entries[tag] for tag in sorted(entries))
    return head + block[8:] + directory + following, told


def _text(block: bytes, entry: bytes, order: str | None) -> bytes:
    """Return the text of an entry of a directory."""
    _tag, kind, count, at = struct.unpack(f"{order}HHII", entry)
    value = entry[8 : 8 + count] if count <= 4 else block[at : at + count]
    return value.rstrip(b"\0") if kind == _ASCII else b""


def resolution(horizontal: float, vertical: float) -> tuple[float, float] | None:
    """Return a resolution in dpi, or None where a file states one that every container would refuse."""
    known = all(1 <= dots <= 65535 for dots in (horizontal, vertical))
    return (horizontal, vertical) if known else None


def tags_of(exif: bytes) -> list[int]:
    """Return the tags in the directory of an EXIF block; raise a `struct.error` if it has none."""
    order = _ORDERS.get(exif[:4])
    (start,) = struct.unpack_from(f"{order}I", exif, 4)
    (count,) = struct.unpack_from(f"{order}H", exif, start)
    return [
        struct.unpack_from(f"{order}H", exif, at)[0] for at in range(start + 2, start + 2 + 12 * count, 12)
    ]


def listed(kind: str, names: Iterable[str]) -> tuple[str, ...]:
    """Return what is lost of a kind, in words: the first names, and how many more; nothing of none.

    Examples
    --------
    >>> listed("text", ["Title", "Source", "Title"]), listed("text", [])
    (('text (Title, Source)',), ())
    """
    told = [*dict.fromkeys(names)]
    if len(told) > _MOST_NAMES:
        told[_MOST_NAMES:] = [f"{len(told) - _MOST_NAMES} more"]
    return (f"{kind} ({', '.join(told)})",) if told else ()


def _take_orientation(exif: bytes) -> tuple[int, bytes | None]:
    """Return the orientation, and the block with that tag set to 1 and the thumbnail unlinked.

    The block is patched in place, not parsed and rebuilt: makers' notes hold offsets that only work where
    they are.
    """
    block = bytearray(exif)
    order = _ORDERS.get(bytes(block[:4]))
    if order is None:
        return 1, None
    orientation = 1
    try:
        (start,) = struct.unpack_from(f"{order}I", block, 4)
        (count,) = struct.unpack_from(f"{order}H", block, start)
        end = start + 2 + 12 * count
        for entry in range(start + 2, end, 12):
            tag, kind = struct.unpack_from(f"{order}HH", block, entry)
            if tag == Base.Orientation:
                value = f"{order}{'I' if kind == 4 else 'H'}"
                (orientation,) = struct.unpack_from(value, block, entry + 8)
                struct.pack_into(value, block, entry + 8, 1)
    except struct.error:
        return 1, None
    if len(block) >= end + 4:
        struct.pack_into(f"{order}I", block, end, 0)
    return orientation if 1 <= orientation <= 8 else 1, bytes(block)
