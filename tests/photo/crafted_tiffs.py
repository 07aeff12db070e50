"""TIFF files made to harm: wild directories, circles, bombs in strips and tiles."""

from __future__ import annotations

import io
import struct
import zlib
from typing import TYPE_CHECKING

import numpy as np
import tifffile
from crafted_photos import HIGH, HUGE, WIDE, blank_jpeg, blank_webp, deflated, header
from hostile_corpus import by_tifffile, png

if TYPE_CHECKING:
    from collections.abc import Iterator


def tagged(*tags: tuple[int, int, int, int], tail: bytes = b"", following: int = 0) -> bytes:
    """Return a TIFF of one directory at 8, of entries (tag, type, count, value); `tail` comes after."""
    entries = b"".join(struct.pack("<HHII", *tag) for tag in sorted(tags))
    return b"II*\0\x08\0\0\0" + struct.pack("<H", len(tags)) + entries + struct.pack("<I", following) + tail


def page(width: int, height: int, data: bytes, **changed: int) -> bytes:
    """Return a grey TIFF of one strip, with some of its numbers changed."""
    given = {"bits": 8, "compression": 8, "photometric": 1, "samples": 1, "rows": height, "bytes": len(data)}
    at = given | {"start": 8 + 2 + 12 * 9 + 4} | changed
    return tagged(
        (256, 4, 1, width),
        (257, 4, 1, height),
        (258, 3, 1, at["bits"]),
        (259, 3, 1, at["compression"]),
        (262, 3, 1, at["photometric"]),
        (273, 4, 1, at["start"]),
        (277, 3, 1, at["samples"]),
        (278, 4, 1, at["rows"]),
        (279, 4, 1, at["bytes"]),
        tail=data,
    )


def tiffs() -> Iterator[tuple[str, bytes]]:
    blank = zlib.compress(bytes(16))
    yield "header-only.tif", b"II*\0\x08\0\0\0"
    yield "directory-is-the-header.tif", b"II*\0\0\0\0\0"
    yield "circle.tif", page(4, 4, blank).replace(b"\0\0\0\0" + blank, b"\x08\0\0\0" + blank)
    yield "bomb-in-a-strip.tif", page(4, 4, deflated(1 << 30))
    for width, height in ((0, 4), (4, 0), (2**32 - 1, 2**32 - 1), (2**31, 1), (HUGE, 1), (1, HUGE)):
        yield f"claims-{width}x{height}.tif", page(width, height, blank)
    yield "claims-much-and-has-little.tif", page(WIDE, HIGH, blank)
    for bits, samples in ((0, 1), (64, 1), (255, 1), (65535, 1), (8, 0), (8, 65535), (16, 4), (64, 4)):
        yield f"{bits}-bits-{samples}-samples.tif", page(WIDE, HIGH, blank, bits=bits, samples=samples)
    for rows in (0, 1, 2**32 - 1):
        yield f"{rows}-rows-a-strip.tif", page(4, 4, blank, rows=rows)
    yield "strip-beyond-the-end.tif", page(4, 4, blank, start=2**32 - 1)
    yield "strip-of-no-bytes.tif", page(4, 4, blank, bytes=0)
    yield "strip-of-4-gigabytes.tif", page(4, 4, blank, bytes=2**32 - 1)
    yield "plain-strip-beyond-the-end.tif", page(4, 4, bytes(16), compression=1, start=2**32 - 1)
    rows = deflated(HIGH * (1 + WIDE))
    blank_png = png(header(WIDE, HIGH, 8, 0), (b"IDAT", rows), (b"IEND", b""))
    inside = {7: blank_jpeg(), 34933: blank_png, 50001: blank_webp()}
    for number, data in inside.items():
        yield f"huge-photo-inside-{number}.tif", page(4, 4, data, compression=number)
    for number in (
        2,
        3,
        4,
        5,
        6,
        32773,
        32946,
        34676,
        34887,
        34892,
        34925,
        48124,
        50000,
        50002,
        52546,
        65000,
    ):
        yield f"compression-{number}.tif", page(64, 64, bytes(range(256)) * 9, compression=number)
    for number in (2, 3, 4):
        yield f"blank-fax-{number}.tif", page(WIDE, HIGH, bytes(1 << 16), compression=number, bits=1)
    for bits, samples, photometric in (
        (1, 1, 1),
        (10, 1, 1),
        (12, 1, 1),
        (8, 3, 2),
        (16, 3, 2),
        (16, 4, 2),
        (32, 3, 2),
    ):
        data = deflated(HIGH * -(-WIDE * bits * samples // 8))
        yield (
            f"blank-{bits}-bits-{samples}-samples.tif",
            page(WIDE, HIGH, data, bits=bits, samples=samples, photometric=photometric),
        )
    yield "blank-floats.tif", floats()
    yield "tile-larger-than-all.tif", tile(2**31, 2**31)
    yield "tile-of-gigabytes.tif", tile(50_000, 50_000)
    yield "tile-of-no-size.tif", tile(0, 0)
    yield "count-beyond-the-end.tif", tagged((256, 4, 2**32 - 1, 8), (257, 4, 1, 4), (273, 4, 2**30, 8))
    starts = struct.pack("<I", 8) * 1_000_000
    yield (
        "a-million-strips.tif",
        tagged(
            (256, 4, 1, 1),
            (257, 4, 1, 1_000_000),
            (258, 3, 1, 8),
            (259, 3, 1, 8),
            (262, 3, 1, 1),
            (273, 4, 1_000_000, 122),
            (277, 3, 1, 1),
            (278, 4, 1, 1),
            (279, 4, 1_000_000, 122),
            tail=starts,
        ),
    )
    directory = struct.pack("<H", 1) + struct.pack("<HHII", 256, 4, 1, 1)
    size = len(directory) + 4
    chain = b"".join(directory + struct.pack("<I", 8 + size * (n + 1)) for n in range(300_000))
    yield "many-directories.tif", b"II*\0\x08\0\0\0" + chain
    same = struct.pack("<HHII", 254, 4, 1, 1)
    reduced = struct.pack("<H", 1) + same
    chain = b"".join(reduced + struct.pack("<I", 122 + 18 * (n + 1)) for n in range(300_000))
    yield (
        "many-previews.tif",
        page(4, 4, chain + blank, start=122 + len(chain), bytes=len(blank)).replace(
            b"\0\0\0\0" + reduced, struct.pack("<I", 122) + reduced, 1
        ),
    )
    yield "every-tag.tif", tagged(*[(tag, 4, 1, 8) for tag in range(60_000)])
    whole = page(4, 4, blank)
    for tag in (256, 258, 259, 262, 277, 278):
        entry = whole.index(struct.pack("<HH", tag, 3 if tag in (258, 259, 262, 277) else 4))
        for name, kind, count, value in (("text", 2, 1, 7), ("list", 3, 60, 8), ("fraction", 5, 1, 8)):
            changed = struct.pack("<HHII", tag, kind, count, value)
            yield f"{name}-as-tag-{tag}.tif", whole[:entry] + changed + whole[entry + 12 :]
    yield "text-as-orientation.tif", tagged((256, 4, 1, 4), (257, 4, 1, 4), (274, 2, 4, 0x41414141))
    for place in (34665, 34853):
        yield (
            f"exif-in-circles-{place}.tif",
            tagged(
                (256, 4, 1, 4),
                (257, 4, 1, 4),
                (258, 3, 1, 8),
                (259, 3, 1, 1),
                (262, 3, 1, 1),
                (273, 4, 1, 8),
                (277, 3, 1, 1),
                (279, 4, 1, 16),
                (place, 4, 1, 8),
            ),
        )


def tile(width: int, height: int) -> bytes:
    """Return a TIFF of 4x4 px whose one tile claims this size."""
    data = zlib.compress(bytes(256))
    return tagged(
        (256, 4, 1, 4),
        (257, 4, 1, 4),
        (258, 3, 1, 8),
        (259, 3, 1, 8),
        (262, 3, 1, 1),
        (277, 3, 1, 1),
        (322, 4, 1, width),
        (323, 4, 1, height),
        (324, 4, 1, 134),
        (325, 4, 1, len(data)),
        tail=data,
    )


def floats() -> bytes:
    """Return a TIFF of blank double precision RGB, as large as is allowed."""
    blank = np.broadcast_to(np.zeros((), np.float64), (16, 16, 3))
    data = by_tifffile(blank, photometric="rgb", compression="zlib")
    file = io.BytesIO(data)
    with tifffile.TiffFile(file, mode="r+") as opened:
        tags = opened.pages.first.tags
        for tag, value in ((256, WIDE), (257, HIGH), (278, HIGH)):
            tags[tag].overwrite(value)
    return file.getvalue()
