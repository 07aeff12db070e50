"""Photoshop's image resources, where JPEG, TIFF and PSD keep IPTC and more.

Adobe's "Photoshop File Format Specification" has their layout, "Image Resource Blocks". Read here and not by
Pillow, which loses their names, and cuts what goes on in a JPEG's next segment.
"""

from __future__ import annotations

import struct
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Iterator

_SIGNATURES = (b"8BIM", b"MeSa", b"AgHg", b"PHUT", b"DCSR")
_IPTC = 1028
#: Thumbnails, which would still show the old light, and the profile, EXIF and XMP, which a photo keeps apart.
_LEFT_OUT = {1033, 1036, 1039, 1058, 1059, 1060}
#: Guides, slices and paths: places in the picture.
_PLACES = {1032, 1050, *range(2000, 2999)}
_MOST = 10_000  # more than any photo has; damage may ask for millions
_SEGMENT = 65533  # bytes of a JPEG's segment, without its length
_JPEG_PREFIX = b"Photoshop 3.0\0"


class _Resource(NamedTuple):
    """A resource: its number, its data, and the whole of it as it lies in the file."""

    number: int
    data: bytes
    whole: bytes


def split(block: bytes) -> tuple[bytes | None, bytes | None]:
    """Return the IPTC in image resources, and the resources that a photo keeps beside it."""
    iptc, others = None, []
    for found in _resources(block):
        if found.number == _IPTC:
            iptc = iptc or iptc_of(found.data)
        elif found.number not in _LEFT_OUT:
            others.append(found.whole)
    return iptc, b"".join(others) or None


def joined(iptc: bytes | None, others: bytes | None) -> bytes:
    """Return image resources: the inverse of `split`."""
    return (resource(_IPTC, iptc) if iptc else b"") + (others or b"")


def iptc_of(data: bytes) -> bytes | None:
    """Return the IPTC in some data; None where there is none.

    Zeros behind are no part of it: a TIFF fills it up to whole numbers of four bytes. The layout is that of
    IPTC's "Information Interchange Model", 1.6.
    """
    if data[:1] != b"\x1c":
        return None
    at, iptc = 0, data
    for _ in range(_MOST):
        if iptc[at : at + 1] != b"\x1c" or at + 5 > len(iptc):
            break
        length, start = int.from_bytes(iptc[at + 3 : at + 5]), at + 5
        if length & 0x8000:  # of an extended dataset, the length of the length
            wide, start = length & 0x7FFF, start + (length & 0x7FFF)
            length = int.from_bytes(iptc[start - wide : start]) if wide <= 4 else len(iptc)
        at = start + length
    if not at:
        return None
    return iptc if iptc[at:].strip(b"\0") else iptc[:at]


def resource(number: int, data: bytes) -> bytes:
    """Return an image resource without a name."""
    return struct.pack(">4sH2xI", b"8BIM", number, len(data)) + data + bytes(len(data) % 2)


def numbers(block: bytes) -> set[int]:
    """Return the numbers of image resources."""
    return {found.number for found in _resources(block)}


def without_places(block: bytes | None) -> bytes | None:
    """Return image resources without those that tell places in the picture."""
    kept = [found.whole for found in _resources(block or b"") if found.number not in _PLACES]
    return b"".join(kept) or None


def from_segments(segments: list[bytes]) -> tuple[bytes | None, bytes | None]:
    """Return what `split` does, of a JPEG's APP13 segments, which may each go on where the last was full."""
    parts = [part.removeprefix(_JPEG_PREFIX) for part in segments if part.startswith(_JPEG_PREFIX)]
    return split(b"".join(parts))


def to_segments(block: bytes) -> bytes:
    """Return a JPEG's segments for image resources."""
    room = _SEGMENT - len(_JPEG_PREFIX)
    parts = [_JPEG_PREFIX + block[at : at + room] for at in range(0, len(block), room)]
    return b"".join(struct.pack(">HH", 0xFFED, 2 + len(part)) + part for part in parts)


def _resources(block: bytes) -> Iterator[_Resource]:
    """Go through image resources, up to the first that is cut short or none."""
    at = 0
    for _ in range(_MOST):
        name = at + 6
        if block[at : at + 4] not in _SIGNATURES or name >= len(block):
            return
        size = name + (block[name] + 2) // 2 * 2  # the name with its length, filled up to an even number
        if size + 4 > len(block):
            return
        (number,), (length,) = struct.unpack_from(">H", block, at + 4), struct.unpack_from(">I", block, size)
        start, end = size + 4, size + 4 + length
        if end > len(block):
            return
        whole = block[at:end] + bytes(length % 2)
        yield _Resource(number, block[start:end], whole)
        at = end + length % 2
