"""EXIF, XMP and resolution, put upright as the pixels are."""

from __future__ import annotations

import re
import struct

from PIL.ExifTags import Base

from relit.photo.photo import Metadata

EXIF_PREFIX = b"Exif\0\0"
_XMP_ORIENTATION = re.compile(rb"(tiff:Orientation(?:\s*=\s*[\"']|>))\s*[1-8]")


def put_upright(metadata: Metadata) -> tuple[int, Metadata]:
    """Return the EXIF orientation of a file, and its metadata once the pixels are upright.

    EXIF that cannot be parsed is left out, and counts as orientation 1.
    """
    orientation, exif = _take_orientation(metadata.exif or b"")
    xmp, dpi = metadata.xmp, metadata.dpi
    if orientation > 1 and xmp:
        xmp = _XMP_ORIENTATION.sub(rb"\g<1>1", xmp)
    if orientation > 4 and dpi:
        dpi = dpi[::-1]
    return orientation, Metadata(exif, xmp, dpi)


def resolution(horizontal: float, vertical: float) -> tuple[float, float] | None:
    """Return a resolution in dpi, or None where a file states one that every container would refuse."""
    known = all(1 <= dots <= 65535 for dots in (horizontal, vertical))
    return (horizontal, vertical) if known else None


def _take_orientation(exif: bytes) -> tuple[int, bytes | None]:
    """Return the orientation, and the block with that tag set to 1 and the thumbnail unlinked.

    The block is patched in place, not parsed and rebuilt: makers' notes hold offsets that only work where
    they are.
    """
    block = bytearray(exif.removeprefix(EXIF_PREFIX))
    order = {b"II*\0": "<", b"MM\0*": ">"}.get(bytes(block[:4]))
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
