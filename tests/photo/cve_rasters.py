"""WebP, BMP and PNM files made after what once broke libwebp, gdk-pixbuf, Qt and Netpbm: our own bytes."""

from __future__ import annotations

import struct
from typing import TYPE_CHECKING

import numpy as np
from hostile_corpus import by_pillow, photos
from PIL import Image

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    Files = Iterator[tuple[str, bytes]]


def riff(*chunks: tuple[bytes, bytes]) -> bytes:
    """Return a WebP of chunks."""
    body = b"".join(k + struct.pack("<I", len(c)) + c + b"\0" * (len(c) % 2) for k, c in chunks)
    return b"RIFF" + struct.pack("<I", len(body) + 4) + b"WEBP" + body


def bits(fields: Iterable[tuple[int, int]]) -> bytes:
    """Return numbers of so many bits each, the lowest first, as VP8L has them."""
    number, at = 0, 0
    for value, size in fields:
        number |= (value & ((1 << size) - 1)) << at
        at += size
    return number.to_bytes(at // 8 + 1, "little")


def _lossless(*fields: tuple[int, int], width: int = 16, height: int = 16) -> bytes:
    head = [(0x2F, 8), (width - 1, 14), (height - 1, 14), (0, 1), (0, 3)]
    return riff((b"VP8L", bits([*head, *fields]) + bytes(64)))


def huffman() -> Files:
    """Prefix codes of VP8L that overfill their tables.

    As in CVE-2023-4863; wild transforms: CVE-2020-36328, CVE-2018-25011.
    """
    lengths = [
        (0, 1),
        (15, 4),
        *[(1 + n % 7, 3) for n in range(19)],
        (0, 1),
    ]  # a code of code lengths, of all 19
    yield "vp8l-codes-overfull.webp", _lossless((0, 1), (0, 1), (0, 1), *lengths * 5)
    yield (
        "vp8l-codes-of-15-bits.webp",
        _lossless((0, 1), (0, 1), (0, 1), *[(0, 1), (15, 4), *[(7, 3)] * 19, (0, 1)] * 5),
    )
    yield "vp8l-codes-unfull.webp", _lossless((0, 1), (0, 1), (0, 1), *[(0, 1), (0, 4), *[(1, 3)] * 4] * 5)
    yield (
        "vp8l-codes-repeat-beyond.webp",
        _lossless((0, 1), (0, 1), (0, 1), (0, 1), (15, 4), *[(0, 3)] * 18, (1, 3), *[(1, 1)] * 600),
    )
    yield (
        "vp8l-simple-code-of-256.webp",
        _lossless((0, 1), (0, 1), (0, 1), *[(1, 1), (1, 1), (1, 1), (255, 8), (255, 8)] * 5),
    )
    for size in (1, 11, 12, 15):
        yield (
            f"vp8l-colour-cache-of-{size}.webp",
            _lossless((0, 1), (1, 1), (size, 4), (0, 1), *[(1, 1), (0, 1), (0, 1), (0, 1)] * 5),
        )
    for kind in range(4):
        yield (
            f"vp8l-transform-{kind}-twice.webp",
            _lossless((1, 1), (kind, 2), (7, 3), (1, 1), (kind, 2), (7, 3)),
        )
    yield "vp8l-transforms-without-end.webp", _lossless(*[(1, 1), (2, 2)] * 900)
    yield "vp8l-palette-of-256.webp", _lossless((1, 1), (3, 2), (255, 8), (0, 1), *[(1, 1)] * 90)
    yield (
        "vp8l-groups-many.webp",
        _lossless((0, 1), (0, 1), (1, 1), (0, 3), *[(1, 1)] * 900, width=4000, height=4000),
    )
    yield "vp8l-claims-16384.webp", _lossless((0, 1), width=16384, height=16384)
    yield (
        "vp8l-version-7.webp",
        riff((b"VP8L", b"\x2f" + struct.pack("<I", 7 << 29 | 3 << 14 | 3) + bytes(40))),
    )


def webps() -> Files:
    """Chunks that do not fit one another.

    As in CVE-2018-25009 to -25014, CVE-2020-36329 to -36332, CVE-2016-9085.
    """
    lossy = photos()["lossy.webp"]
    vp8 = lossy[lossy.index(b"VP8 ") + 8 :]
    vp8 = vp8[: struct.unpack_from("<I", lossy, lossy.index(b"VP8 ") + 4)[0]]

    def head(flags: int, width: int = 24, height: int = 20) -> tuple[bytes, bytes]:
        return b"VP8X", struct.pack("<I", flags) + (width - 1).to_bytes(3, "little") + (height - 1).to_bytes(
            3, "little"
        )

    yield "plain.webp", riff(head(0), (b"VP8 ", vp8))
    for name, chunks in {
        "canvas-smaller": [head(0, 3, 3), (b"VP8 ", vp8)],
        "canvas-larger": [head(0, 16000, 16000), (b"VP8 ", vp8)],
        "canvas-short": [(b"VP8X", bytes(4)), (b"VP8 ", vp8)],
        "canvas-twice": [head(0), head(0, 9, 9), (b"VP8 ", vp8)],
        "picture-twice": [head(0), (b"VP8 ", vp8), (b"VP8 ", vp8)],
        "picture-missing": [head(16)],
        "alpha-empty": [head(16), (b"ALPH", b""), (b"VP8 ", vp8)],
        "alpha-after": [head(16), (b"VP8 ", vp8), (b"ALPH", bytes(481))],
        "alpha-short": [head(16), (b"ALPH", bytes(9)), (b"VP8 ", vp8)],
        "animated-without-frames": [head(2), (b"ANIM", bytes(6))],
        "animated-frame-outside": [
            head(2),
            (b"ANIM", bytes(6)),
            (b"ANMF", b"\xff" * 16 + b"VP8 " + struct.pack("<I", len(vp8)) + vp8),
        ],
        "animated-frame-cut": [head(2), (b"ANIM", bytes(6)), (b"ANMF", bytes(7))],
        "profile-empty": [head(32), (b"ICCP", b""), (b"VP8 ", vp8)],
        "exif-without-flag": [head(0), (b"VP8 ", vp8), (b"EXIF", b"II*\0\xff\xff\xff\xff")],
        "flags-of-all": [head(0xFFFFFFFF), (b"VP8 ", vp8)],
        "unknown-many": [head(0), *[(b"zzzz", b"")] * 9000, (b"VP8 ", vp8)],
    }.items():
        yield f"{name}.webp", riff(*chunks)
    for filtering in range(0, 256, 20):
        yield (
            f"alpha-filter-{filtering}.webp",
            riff(head(16), (b"ALPH", bytes([filtering]) + bytes(480)), (b"VP8 ", vp8)),
        )
    for name, at, value in (
        ("partition-beyond", 0, b"\xf0\xff\xff"),
        ("not-a-key-frame", 0, b"\x01"),
        ("start-code", 3, b"\0\0\0"),
        ("claims-16383", 6, b"\xff\x3f\xff\x3f"),
        ("no-size", 6, bytes(4)),
        ("partitions-8", 10, b"\xff" * 8),
    ):
        yield f"vp8-{name}.webp", riff((b"VP8 ", vp8[:at] + value + vp8[at + len(value) :]))
    for length in (1, 2**31, 2**32 - 2):
        yield (
            f"chunk-of-{length}.webp",
            riff((b"VP8 ", vp8)).replace(struct.pack("<I", len(vp8)), struct.pack("<I", length), 1),
        )


def bmps() -> Files:
    """Run lengths, masks, palettes and heights.

    As in CVE-2015-7552 (gdk-pixbuf), CVE-2018-19873 (Qt), CVE-2014-1947.
    """

    def bmp(
        width: int = 8,
        height: int = 8,
        depth: int = 24,
        kind: int = 0,
        size: int = 40,
        colours: int = 0,
        more: bytes = b"",
        body: bytes = bytes(256),
        start: int | None = None,
    ) -> bytes:
        head = struct.pack("<IiiHHIIiiII", size, width, height, 1, depth, kind, len(body), 0, 0, colours, 0)
        at = 14 + len(head) + len(more) if start is None else start
        return b"BM" + struct.pack("<IHHI", at + len(body), 0, 0, at) + head + more + body

    yield "plain.bmp", bmp()
    palette = bytes(1024)
    for name, body in {
        "overrun": b"\xff\1" * 400,
        "absolute-overrun": b"\0\xff" + bytes(20),
        "delta-beyond": b"\0\2\xff\xff" * 40,
        "delta-cut": b"\0\2",
        "no-end": b"\1\1" * 20,
        "rows-without-end": b"\0\0" * 9000,
        "nothing": b"",
    }.items():
        for kind, depth in ((1, 8), (2, 4)):
            yield f"rle{depth}-{name}.bmp", bmp(depth=depth, kind=kind, more=palette, body=body)
    yield "rle-top-down.bmp", bmp(height=-8, depth=8, kind=1, more=palette, body=b"\x08\1\0\0" * 8)
    yield "rle-of-24-bits.bmp", bmp(kind=1)
    yield "rle-of-1-bit.bmp", bmp(depth=1, kind=1, more=palette)
    for name, masks in {
        "zero": (0, 0, 0),
        "all": (2**32 - 1,) * 3,
        "overlap": (0xFF00, 0xFF00, 0xFF00),
        "holes": (0x5555, 0xAAAA0000, 1),
        "wide": (0x7FFFFFFF, 1 << 31, 1),
    }.items():
        for depth in (16, 32):
            yield f"masks-{name}-of-{depth}.bmp", bmp(depth=depth, kind=3, more=struct.pack("<III", *masks))
    yield "masks-missing.bmp", bmp(depth=16, kind=3, body=b"", start=54)
    for colours in (257, 2**16, 2**30, 2**32 - 1):
        yield f"palette-of-{colours}.bmp", bmp(depth=8, colours=colours, more=palette)
    yield "palette-missing.bmp", bmp(depth=8, start=54)
    yield "palette-index-beyond.bmp", bmp(depth=8, colours=2, more=bytes(8), body=b"\xff" * 64)
    for height in (-8, -1, -(2**31) + 1, 0):
        yield f"height-{height}.bmp", bmp(height=height)
    for depth in (0, 2, 3, 15, 64, 65535):
        yield f"depth-{depth}.bmp", bmp(depth=depth)
    for kind in (4, 5, 6, 11, 2**32 - 1):
        yield f"kind-{kind}.bmp", bmp(kind=kind)
    for size in (0, 12, 13, 39, 52, 108, 124, 2**32 - 1):
        yield f"header-of-{size}.bmp", bmp(size=size)
    yield "row-overflows.bmp", bmp(width=2**31 // 3 + 1, height=1)
    yield "pixels-in-the-header.bmp", bmp(start=2)


def pnms() -> Files:
    """Numbers and comments without end.

    As in CVE-2017-2587 (Netpbm), CVE-2018-11212, CVE-2020-13790, CVE-2021-42716 (stb).
    """
    for name, data in {
        "comment-without-end": b"P6 #" + b"x" * 900_000,
        "comment-in-a-number": b"P5 1#c\n0 10 255\n" + bytes(100),
        "comment-behind-the-largest": b"P5 2 2 255#c\n" + bytes(4),
        "largest-0": b"P6 1 1 0\n\0\0\0",
        "largest-256": b"P6 1 1 256\n" + bytes(5),
        "largest-65536": b"P6 1 1 65536\n" + bytes(6),
        "above-the-largest": b"P5 2 2 7\n\xff\xff\xff\xff",
        "product-overflows": b"P6 65536 65536 255\n" + bytes(9),
        "product-overflows-64": b"P5 4294967296 4294967296 255\n\0",
        "minus-zero": b"P5 -0 4 255\n\0",
        "hexadecimal": b"P5 0x4 0x4 255\n" + bytes(16),
        "arabic-digits": "P5 ٤ ٤ 255\n".encode() + bytes(16),
        "other-spaces": b"P5\x0b4\x0c4\xa0255\n" + bytes(16),
        "cut-in-the-header": b"P6 4",
        "cut-of-16-bits": b"P5 2 2 65535\n" + bytes(7),
        "bits-above-1": b"P1 2 2\n2 3 4 5",
        "plain-without-end": b"P3 900 900 255\n" + b"1 " * 9,
        "any-map": b"P7\nWIDTH 1\nHEIGHT 1\nDEPTH 3\nMAXVAL 255\nENDHDR\n\0\0\0",
        "floats": b"PF 1 1 -1.0\n" + bytes(12),
    }.items():
        yield f"{name}.ppm", data


def others() -> Files:
    """Files of other kinds under the name of a photo, pickles (CVE-2019-6446) and archives among them."""
    pickle = (
        b"\x93NUMPY\x01\0\x46\0{'descr': '|O', 'fortran_order': False, 'shape': (1,), }".ljust(80)
        + b"cos\nsystem\n(S'true'\ntR."
    )
    grey = by_pillow(Image.fromarray(np.zeros((4, 4), np.uint8)), "PNG")
    archive = (
        b"PK\x03\x04"
        + struct.pack("<HHHHHIIIHH", 20, 0, 8, 0, 0, 0, 2**32 - 1, 2**32 - 1, 8, 0)
        + b"mimetype"
    )
    layered = b"8BPS\0\1" + bytes(6) + struct.pack(">HIIHH", 56, 300_000, 300_000, 8, 3) + b"\xff" * 60
    files = {
        "pickle": pickle,
        "archive": archive,
        "layered": layered,
        "raster": archive[:30] + b"mimetypeimage/openraster",
    }
    for name, data in files.items():
        for suffix in ("png", "tif"):
            yield f"{name}-as-a-photo.{suffix}", data
    yield "pickle-behind.png", grey + pickle


PARTS = (huffman, webps, bmps, pnms, others)
