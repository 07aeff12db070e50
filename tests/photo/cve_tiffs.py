"""TIFF files made after what once broke libtiff and Pillow: our own bytes, of the same class."""

from __future__ import annotations

import struct
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    Files = Iterator[tuple[str, bytes]]
    Field = tuple[int, Sequence[int]]  # a type of TIFF, and values

BYTE, ASCII, SHORT, LONG, RATIONAL, LONG8 = 1, 2, 3, 4, 5, 16
_LETTERS = {
    10: "i",
    BYTE: "B",
    ASCII: "B",
    SHORT: "H",
    LONG: "I",
    RATIONAL: "I",
    LONG8: "Q",
    7: "B",
    12: "d",
    13: "I",
}
DATA = -1  # in a field: where the pixels are

_PLAIN: dict[int, Field] = {
    256: (LONG, [8]),
    257: (LONG, [8]),
    258: (SHORT, [8]),
    259: (SHORT, [1]),
    262: (SHORT, [1]),
    273: (LONG, [DATA]),
    277: (SHORT, [1]),
    278: (LONG, [8]),
    279: (LONG, [64]),
}


def tiff(
    changed: Mapping[int, Field | None],
    data: bytes = bytes(range(64)),
    *,
    following: int = 0,
    plain: bool = True,
) -> bytes:
    """Return a TIFF of one directory: a grey 8x8, with some fields changed, added, or left out by None."""
    fields = {tag: field for tag, field in ((_PLAIN if plain else {}) | dict(changed)).items() if field}
    start = 8 + 2 + 12 * len(fields) + 4
    values = start + len(data)
    entries, tail = b"", b""
    for tag, (kind, numbers) in sorted(fields.items()):
        count = len(numbers) // (2 if kind in (RATIONAL, 10) else 1)
        packed = struct.pack(
            f"<{len(numbers)}{_LETTERS[kind]}", *(start if n == DATA else n for n in numbers)
        )
        if len(packed) > 4:
            packed, tail = struct.pack("<I", values + len(tail)), tail + packed
        entries += struct.pack("<HHI", tag, kind, count) + packed.ljust(4, b"\0")
    return (
        struct.pack("<2sHIH", b"II", 42, 8, len(fields))
        + entries
        + struct.pack("<I", following)
        + data
        + tail
    )


def tiles(width: int, height: int, count: int = 1, **more: Field) -> dict[int, Field | None]:
    """Return fields that make tiles of the strip."""
    own = {
        322: (LONG, [width]),
        323: (LONG, [height]),
        324: (LONG, [DATA] * count),
        325: (LONG, [64] * count),
    }
    return dict.fromkeys((273, 278, 279)) | own | {int(tag[1:]): field for tag, field in more.items()}


def counts() -> Files:
    """Strips and tiles that are fewer or more than the size asks for: CVE-2016-9273, CVE-2022-3570, -3598."""
    yield "plain.tif", tiff({})
    yield "strips-fewer-than-rows.tif", tiff({278: (LONG, [1])})
    yield "strips-more-than-rows.tif", tiff({273: (LONG, [DATA] * 99), 279: (LONG, [64] * 99)})
    yield "strip-starts-without-counts.tif", tiff({279: None})
    yield "strip-counts-without-starts.tif", tiff({273: None})
    yield "strip-counts-fewer-than-starts.tif", tiff({273: (LONG, [DATA] * 8), 278: (LONG, [1])})
    yield "strips-of-shorts-and-longs.tif", tiff({273: (SHORT, [122]), 279: (LONG8, [2**63])})
    yield (
        "tiles-fewer-than-area.tif",
        tiff(tiles(16, 16) | {256: (LONG, [64]), 257: (LONG, [64])}, bytes(256)),
    )
    yield "tiles-more-than-area.tif", tiff(tiles(16, 16, 500), bytes(256))
    yield "tiles-and-strips.tif", tiff({322: (LONG, [16]), 323: (LONG, [16]), 324: (LONG, [DATA])})
    yield "tiles-of-odd-size.tif", tiff(tiles(3, 5), bytes(64))
    yield "tiles-wide-and-flat.tif", tiff(tiles(2**31 - 16, 16), bytes(64))
    yield "planes-fewer-than-samples.tif", tiff({277: (SHORT, [3]), 262: (SHORT, [2]), 284: (SHORT, [2])})
    yield "planes-of-no-kind.tif", tiff({284: (SHORT, [7])})
    yield "one-depth-for-three-samples.tif", tiff({277: (SHORT, [3]), 262: (SHORT, [2]), 258: (SHORT, [8])})
    yield "depths-that-differ.tif", tiff({277: (SHORT, [3]), 262: (SHORT, [2]), 258: (SHORT, [8, 16, 1])})


def sizes() -> Files:
    """Sizes whose products overflow.

    As in CVE-2010-2065, CVE-2017-11613, CVE-2019-14973, CVE-2023-52355, CVE-2025-9900.
    """
    for width, height in ((2**16, 2**16), (2**31 - 1, 2), (2**32 - 1, 1), (1, 2**32 - 1), (46341, 46341)):
        yield f"product-of-{width}x{height}.tif", tiff({256: (LONG, [width]), 257: (LONG, [height])})
    yield "size-of-64-bits.tif", tiff({256: (LONG8, [2**32 + 8])})
    yield "rows-of-a-strip-overflow.tif", tiff({278: (LONG, [2**31])})
    yield "samples-times-bits-overflow.tif", tiff({277: (SHORT, [65535]), 258: (SHORT, [65535])})
    yield "scanline-of-gigabytes.tif", tiff({256: (LONG, [2**28]), 277: (SHORT, [4]), 258: (SHORT, [16] * 4)})
    yield (
        "tall-in-one-strip.tif",
        tiff({257: (LONG, [190_000_000]), 256: (LONG, [1]), 278: (LONG, [2**32 - 1])}),
    )
    yield (
        "value-count-overflow.tif",
        tiff({}).replace(struct.pack("<HHI", 273, 4, 1), struct.pack("<HHI", 273, 16, 2**29)),
    )


def directories() -> Files:
    """Directories in circles and without end: CVE-2018-5784, CVE-2022-40090, CVE-2015-8870, CVE-2023-6277."""
    yield "next-is-itself.tif", tiff({}, following=8)
    yield (
        "next-is-in-pixels.tif",
        tiff({}, struct.pack("<HHHIIIH", 1, 256, 4, 1, 8, 122, 0) * 4, following=122),
    )
    yield "next-is-odd.tif", tiff({}, following=9)
    yield "next-is-far.tif", tiff({}, following=2**32 - 2)
    yield "sub-directory-is-itself.tif", tiff({330: (LONG, [8])})
    yield "sub-directories-in-circles.tif", tiff({330: (13, [8] * 500)})
    yield "sub-directories-far.tif", tiff({330: (LONG, [2**32 - 1, 2**31, 3])})
    yield "exif-is-itself.tif", tiff({34665: (LONG, [8]), 34853: (LONG, [8]), 40965: (LONG, [8])})
    yield "directory-of-no-tags.tif", b"II*\0\x08\0\0\0" + bytes(6)
    yield "directory-unsorted.tif", tiff({})[:10] + tiff({})[10:118][::-1] + tiff({})[118:]
    yield (
        "tags-twice.tif",
        struct.pack("<2sHIH", b"II", 42, 8, 18) + tiff({})[10:118] * 2 + bytes(4) + bytes(64),
    )
    yield "big-header-wrong.tif", b"II+\0\x04\0\0\0" + struct.pack("<Q", 16) + bytes(40)
    big = struct.pack("<2sHHHQQ", b"II", 43, 8, 0, 16, 2**63)
    yield "big-tags-without-end.tif", big + bytes(200)
    yield "big-next-is-itself.tif", struct.pack("<2sHHHQQ", b"II", 43, 8, 0, 16, 0) + struct.pack("<Q", 16)


def fields() -> Files:
    """Fields of the wrong type and count.

    As in CVE-2022-0561, -0562, CVE-2017-18013, CVE-2018-7456, CVE-2022-34526.
    """
    for tag in (258, 259, 262, 277, 284, 317, 320, 338, 339):
        yield f"no-value-of-{tag}.tif", tiff({tag: (SHORT, [])})
    yield "strips-of-text.tif", tiff({273: (ASCII, [65] * 9)})
    yield "transfer-function-short.tif", tiff({301: (SHORT, [1])})
    yield "colour-map-missing.tif", tiff({262: (SHORT, [3])})
    yield "colour-map-short.tif", tiff({262: (SHORT, [3]), 320: (SHORT, [1, 2, 3])})
    yield "colour-map-of-16-bits.tif", tiff({262: (SHORT, [3]), 258: (SHORT, [16]), 320: (SHORT, [0] * 768)})
    yield (
        "ink-names-without-end.tif",
        tiff({262: (SHORT, [5]), 333: (ASCII, [65] * 9), 334: (SHORT, [65535])}),
    )
    yield "extra-samples-beyond.tif", tiff({338: (SHORT, [2] * 300)})
    yield (
        "resolution-by-zero.tif",
        tiff({282: (RATIONAL, [1, 0]), 283: (RATIONAL, [0, 0]), 296: (SHORT, [9])}),
    )
    yield "orientation-of-99.tif", tiff({274: (SHORT, [99])})
    yield "fill-order-of-9.tif", tiff({266: (SHORT, [9])})
    yield "samples-of-no-format.tif", tiff({339: (SHORT, [77])})
    yield "floats-of-24-bits.tif", tiff({258: (SHORT, [24]), 339: (SHORT, [3])}, bytes(192))
    yield "complex-numbers.tif", tiff({258: (SHORT, [64]), 339: (SHORT, [6])}, bytes(512))
    yield (
        "profile-beyond-the-end.tif",
        tiff({}).replace(struct.pack("<HHII", 278, 4, 1, 8), struct.pack("<HHII", 34675, 7, 2**31, 2**31)),
    )


PARTS = (counts, sizes, directories, fields)
