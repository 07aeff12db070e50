"""JPEG files made after what once broke libjpeg, libexif and GDI+: our own bytes, of the same class."""

from __future__ import annotations

import functools
import struct
from typing import TYPE_CHECKING

import numpy as np
from hostile_corpus import by_pillow, exif, photos
from PIL import Image

if TYPE_CHECKING:
    from collections.abc import Iterator

    Files = Iterator[tuple[str, bytes]]
    Segment = tuple[int, bytes]

START, END = b"\xff\xd8", b"\xff\xd9"
SOF0, DHT, SOS, DQT, DNL, DRI, APP1, APP2, APP14, COM = (
    0xC0,
    0xC4,
    0xDA,
    0xDB,
    0xDC,
    0xDD,
    0xE1,
    0xE2,
    0xEE,
    0xFE,
)


@functools.cache
def parts(progressive: bool = False) -> tuple[tuple[Segment, ...], bytes]:
    """Return the segments of a small photo up to its scan, and the scan and all after it."""
    data = by_pillow(
        Image.fromarray(np.arange(768, dtype=np.uint8).reshape(16, 16, 3)), "JPEG", progressive=progressive
    )
    found, at = [], 2
    while data[at + 1] != SOS:
        length = struct.unpack_from(">H", data, at + 2)[0]
        found.append((data[at + 1], data[at + 4 : at + 2 + length]))
        at += 2 + length
    return tuple(found), data[at:]


def written(segments: tuple[Segment, ...] | list[Segment], scan: bytes) -> bytes:
    """Return a JPEG of segments and a scan."""
    packed = (
        b"\xff" + bytes([kind]) + struct.pack(">H", len(content) + 2) + content for kind, content in segments
    )
    return START + b"".join(packed) + scan


def changed(kind: int, *contents: bytes, to: int | None = None, progressive: bool = False) -> bytes:
    """Return the photo with the first segment of a kind replaced by others."""
    segments, scan = parts(progressive)
    at = next(i for i, (found, _) in enumerate(segments) if found == kind)
    new = [(to or kind, content) for content in contents]
    return written([*segments[:at], *new, *segments[at + 1 :]], scan)


def added(*more: Segment) -> bytes:
    """Return the photo with segments before all others."""
    segments, scan = parts()
    return written([*more, *segments], scan)


def tables() -> Files:
    """Tables of wild counts and numbers: CVE-2013-6630, CVE-2014-9092, CVE-2020-14153, CVE-2017-15232."""
    yield "plain.jpg", written(*parts())
    code = bytes(16)
    for name, content in {
        "empty": b"",
        "counts-of-255": b"\0" + b"\xff" * 16 + bytes(200),
        "sum-of-257": b"\0" + code[:15] + b"\xff" + bytes(257),
        "codes-overflow": b"\0\3" + code[:15] + bytes(3),
        "index-15": b"\x0f" + code,
        "class-2": b"\x20" + code,
        "symbols-of-255": b"\0\0\1" + code[:14] + b"\xff",
        "cut": b"\0\0\0",
        "no-codes": b"\0" + code,
        "many": (b"\0" + code) * 3000,
    }.items():
        yield f"huffman-{name}.jpg", changed(DHT, content)
    for name, content in {
        "empty": b"",
        "of-zeros": b"\0" + bytes(64),
        "index-9": b"\x09" + bytes(64),
        "of-16-bits-cut": b"\x10" + bytes(64),
        "precision-15": b"\xf0" + bytes(64),
        "of-65535": b"\x10" + b"\xff" * 128,
    }.items():
        yield f"quantization-{name}.jpg", changed(DQT, content)
    segments, scan = parts()
    yield "no-huffman.jpg", written([s for s in segments if s[0] != DHT], scan)
    yield "no-quantization.jpg", written([s for s in segments if s[0] != DQT], scan)
    yield "no-frame.jpg", written([s for s in segments if s[0] != SOF0], scan)


def frames() -> Files:
    """Frames of odd components and precisions.

    As in CVE-2012-2806, CVE-2013-6629, CVE-2018-20330, CVE-2023-2804.
    """

    def frame(*components: tuple[int, int, int], bits: int = 8, high: int = 16, wide: int = 16) -> bytes:
        return struct.pack(">BHHB", bits, high, wide, len(components)) + b"".join(map(bytes, components))

    three = ((1, 0x22, 0), (2, 0x11, 1), (3, 0x11, 1))
    for name, content in {
        "no-components": frame(),
        "255-components": frame(*[(i, 0x11, 0) for i in range(255)]),
        "same-components": frame(three[0], three[0], three[0]),
        "claims-more-components": frame(*three)[:5] + b"\x0a" + frame(*three)[6:],
        "sampling-0": frame((1, 0, 0), *three[1:]),
        "sampling-15": frame((1, 0xFF, 0), *three[1:]),
        "sampling-3x3": frame((1, 0x33, 0), *three[1:]),
        "sampling-larger-of-colours": frame((1, 0x11, 0), (2, 0x42, 1), (3, 0x24, 1)),
        "table-255": frame((1, 0x22, 255), *three[1:]),
        "two-components": frame(*three[:2]),
        "5-components": frame(*three, (4, 0x11, 0), (5, 0x11, 0)),
        "no-height": frame(*three, high=0),
        "65500-square": frame(*three, high=65500, wide=65500),
        "1x65535": frame(*three, high=65535, wide=1),
        "0-bits": frame(*three, bits=0),
        "12-bits": frame(*three, bits=12),
        "16-bits": frame(*three, bits=16),
    }.items():
        yield f"frame-{name}.jpg", changed(SOF0, content)
    good = frame(*three)
    for kind, name in (
        (0xC1, "12-bits"),
        (0xC3, "lossless"),
        (0xC5, "differential"),
        (0xC7, "differential-lossless"),
    ):
        yield (
            f"frame-{name}-{kind:x}.jpg",
            changed(SOF0, frame(*three, bits=12 if kind == 0xC1 else 8), to=kind),
        )
    for kind in (0xC9, 0xCA, 0xCB, 0xCF, 0xC8, 0xF7):
        yield f"frame-kind-{kind:x}.jpg", changed(SOF0, good, to=kind)
    yield "frame-twice.jpg", changed(SOF0, good, frame(*three, high=9000, wide=9000))
    yield "arithmetic-conditioning.jpg", added((0xCC, b"\xff\xff" * 40))
    yield "hierarchical.jpg", added((0xDE, struct.pack(">BHHB", 8, 16, 16, 3) + bytes(9)), (0xDF, b"\x11"))


def scans() -> Files:
    """Scans that repeat components or bands.

    As in CVE-2013-6629, CVE-2018-11813, CVE-2020-14152, CVE-2021-29390.
    """
    segments, scan = parts()
    body = scan[14:]

    def of(*components: tuple[int, int], band: bytes = b"\0\x3f\0") -> bytes:
        content = bytes([len(components)]) + b"".join(map(bytes, components)) + band
        return b"\xff\xda" + struct.pack(">H", len(content) + 2) + content

    good = ((1, 0), (2, 0x11), (3, 0x11))
    for name, head in {
        "no-components": of(),
        "same-components": of(good[0], good[0], good[0]),
        "unknown-component": of((9, 0), *good[1:]),
        "tables-of-15": of((1, 0xFF), *good[1:]),
        "5-components": of(*good, (1, 0), (2, 0)),
        "band-backwards": of(*good, band=b"\x3f\0\0"),
        "band-beyond": of(*good, band=b"\0\xff\xff"),
        "cut": b"\xff\xda\0\3\3",
        "length-0": b"\xff\xda\0\0",
        "length-65535": b"\xff\xda\xff\xff",
    }.items():
        yield f"scan-{name}.jpg", written(segments, head + body)
    yield "scan-of-nothing.jpg", written(segments, of(*good) + END)
    yield "scan-without-end.jpg", written(segments, scan[:-2])
    yield "scan-of-restarts.jpg", written(segments, of(*good) + b"\xff\xd0\xff\xd7" * 4000 + END)
    yield "scan-of-ones.jpg", written(segments, of(*good) + b"\xff\0" * 40_000 + END)
    yield "scans-many-and-empty.jpg", written(segments, (of(*good) + b"\0") * 2000 + END)
    for content in (b"", b"\0", b"\0\1", b"\xff\xff", bytes(40)):
        yield f"restart-interval-{content.hex()[:8] or 'none'}.jpg", added((DRI, content))
    number = b"\xff\xdc\0\4\0\x10"
    yield "lines-behind-a-scan.jpg", written(segments, scan[:-2] + number + END)
    yield "lines-of-65535.jpg", written(segments, scan[:-2] + b"\xff\xdc\0\4\xff\xff" + END)
    many, scanned = parts(progressive=True)
    first = scanned[:4] + scanned[4 : 2 + struct.unpack_from(">H", scanned, 2)[0]]
    for name, band in {
        "high-bit-15": b"\0\0\x0f",
        "bits-backwards": b"\0\0\x12",
        "dc-with-ac": b"\0\x3f\0",
        "ac-of-all": b"\1\x3f\0",
    }.items():
        yield f"progressive-{name}.jpg", written(many, first[:-3] + band + scanned[len(first) :])
    yield "progressive-refined-first.jpg", written(many, first[:-3] + b"\0\0\x10" + scanned[len(first) :])
    yield "progressive-cut.jpg", written(many, scanned[: len(first) + 4])


def notes() -> Files:
    """Notes whose length and order lie.

    As in CVE-2004-0200 (GDI+), CVE-2007-6351, CVE-2020-0093, CVE-2012-2836 (libexif).
    """
    segments, scan = parts()
    for kind in (COM, APP1, APP2, 0xED, APP14):
        for length in (0, 1, 2, 65535):
            head = b"\xff" + bytes([kind]) + struct.pack(">H", length)
            yield f"length-{length}-of-{kind:x}.jpg", START + head + written(segments, scan)[2:]
    for name, numbers in {
        "backwards": ((2, 2), (1, 2)),
        "zero": ((0, 0),),
        "missing": ((1, 3), (3, 3)),
        "same": ((1, 1),) * 9,
        "beyond": ((200, 2),),
        "counts-differ": ((1, 2), (2, 9)),
    }.items():
        pieces = [(APP2, b"ICC_PROFILE\0" + bytes(pair) + bytes(200)) for pair in numbers]
        yield f"profile-pieces-{name}.jpg", added(*pieces)
    for transform in (1, 2, 9):
        yield f"adobe-transform-{transform}.jpg", added((APP14, b"Adobe\0\x64\0\0\0\0" + bytes([transform])))
    yield "jfif-thumbnail-claims.jpg", added((0xE0, b"JFIF\0\1\1\0\0\1\0\1\xff\xff"))
    directory = struct.pack("<HHHII", 1, 0x927C, 7, 2**31, 8)
    blocks = {
        "first-far": b"II*\0\xff\xff\xff\xff",
        "first-negative": b"MM\0*\x80\0\0\0",
        "count-65535": b"II*\0\x08\0\0\0\xff\xff" + bytes(60),
        "maker-note-beyond": b"II*\0\x08\0\0\0" + directory + bytes(4),
        "sub-of-sub": b"II*\0\x08\0\0\0"
        + struct.pack("<HHHIIHHII", 2, 34665, 4, 1, 8, 40965, 4, 1, 8)
        + bytes(4),
        "thumbnail-far": exif() + struct.pack("<HHHIIHHII", 2, 513, 4, 1, 2**31, 514, 4, 1, 2**31),
        "kind-of-99": b"II*\0\x08\0\0\0" + struct.pack("<HHHII", 1, 274, 99, 1, 6) + bytes(4),
        "count-times-size": b"II*\0\x08\0\0\0" + struct.pack("<HHHII", 1, 282, 5, 2**29 + 1, 8) + bytes(4),
        "orientation-as-list": b"II*\0\x08\0\0\0" + struct.pack("<HHHII", 1, 274, 3, 2**16, 8) + bytes(4),
    }
    for name, block in blocks.items():
        yield f"exif-{name}.jpg", added((APP1, b"Exif\0\0" + block))
    xmp = b"http://ns.adobe.com/xap/1.0/\0"
    yield (
        "xmp-extended-circle.jpg",
        added(
            (
                APP1,
                b"http://ns.adobe.com/xmp/extension/\0"
                + b"A" * 32
                + struct.pack(">II", 2**32 - 1, 2**32 - 1)
                + b"x",
            )
        ),
    )
    yield (
        "xmp-entities.jpg",
        added((APP1, xmp + b"<!DOCTYPE x [<!ENTITY a 'aa'><!ENTITY b '&a;&a;'>]><x>&b;</x>")),
    )
    block = b"Photoshop 3.0\0" + b"8BIM\x04\x04\0\0" + struct.pack(">I", 2**32 - 1)
    yield "photoshop-block-beyond.jpg", added((0xED, block))
    yield "photo-in-photo.jpg", photos()["rgb.jpg"][:-2] + photos()["rgb.jpg"]


PARTS = (tables, frames, scans, notes)
