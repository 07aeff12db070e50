"""PNG files made after what once broke libpng and those who call it: our own bytes, of the same class."""

from __future__ import annotations

import struct
import zlib
from typing import TYPE_CHECKING

from crafted_photos import header
from hostile_corpus import png

if TYPE_CHECKING:
    from collections.abc import Iterator

    Files = Iterator[tuple[str, bytes]]
    Chunk = tuple[bytes, bytes]

END: Chunk = (b"IEND", b"")


def rows(width: int, height: int, bits: int) -> Chunk:
    """Return the pixels of a blank picture."""
    return b"IDAT", zlib.compress(bytes(height * (1 + -(-width * bits // 8))))


def small(*chunks: Chunk, colour: int = 2, depth: int = 8) -> bytes:
    """Return a PNG of 4x4 with chunks before its pixels."""
    samples = {0: 1, 2: 3, 3: 1, 4: 2, 6: 4}[colour]
    return png(header(4, 4, depth, colour), *chunks, rows(4, 4, depth * samples), END)


def palettes() -> Files:
    """Palettes and transparency of the wrong length.

    As in CVE-2004-0597, CVE-2015-8126, -8472, CVE-2013-6954, CVE-2025-64505.
    """
    yield "plain.png", small()
    whole = (b"PLTE", bytes(768))
    for colour in (0, 2, 3, 4, 6):
        yield f"trns-of-300-colour-{colour}.png", small(whole, (b"tRNS", bytes(300)), colour=colour)
    for size in (0, 1, 2, 4, 769, 771, 6000):
        yield f"plte-of-{size}.png", small((b"PLTE", bytes(size)), colour=3)
    for depth in (1, 2, 4):
        yield f"plte-longer-than-{depth}-bits.png", small(whole, colour=3, depth=depth)
    yield "plte-twice.png", small(whole, whole, colour=3)
    yield "plte-of-grey.png", small(whole, colour=0)
    yield "trns-before-plte.png", small((b"tRNS", bytes(9)), whole, colour=3)
    yield "trns-longer-than-plte.png", small((b"PLTE", bytes(6)), (b"tRNS", bytes(200)), colour=3)
    yield "trns-of-16-bits-short.png", small((b"tRNS", b"\1"), colour=0, depth=16)
    yield "trns-empty.png", small((b"tRNS", b""))
    for kind, content in (
        (b"hIST", b""),
        (b"hIST", bytes(600)),
        (b"bKGD", b"\xff" * 3),
        (b"sBIT", b"\xff" * 9),
    ):
        yield f"{kind.decode()}-of-{len(content)}.png", small((b"PLTE", bytes(6)), (kind, content), colour=3)
    index = (b"IDAT", zlib.compress(b"\0\xff\xff\xff\xff" * 4))
    yield (
        "index-beyond-with-trns.png",
        png(header(4, 4, 8, 3), (b"PLTE", bytes(3)), (b"tRNS", b"\0"), index, END),
    )


def pixels() -> Files:
    """Pixels that are none, too many or wildly cut.

    As in CVE-2010-1205, CVE-2014-0333, CVE-2018-13785, CVE-2014-9495.
    """
    data = zlib.compress(bytes(52))
    head = header(4, 4)
    yield "idat-of-nothing-first.png", png(head, (b"IDAT", b""), (b"IDAT", data), END)
    yield "idat-of-nothing-only.png", png(head, (b"IDAT", b""), END)
    yield "idat-byte-by-byte.png", png(head, *[(b"IDAT", data[i : i + 1]) for i in range(len(data))], END)
    yield "idat-apart.png", png(head, (b"IDAT", data[:5]), (b"tIME", bytes(7)), (b"IDAT", data[5:]), END)
    yield "idat-of-more-rows.png", png(head, (b"IDAT", zlib.compress(bytes(500_000))), END)
    yield "idat-of-fewer-rows.png", png(head, (b"IDAT", zlib.compress(bytes(20))), END)
    yield "idat-behind-the-end.png", png(head, END, (b"IDAT", data))
    yield "idat-with-a-dictionary.png", png(head, (b"IDAT", b"\x78\xbb\0\0\0\1" + data[2:]), END)
    yield "idat-of-a-large-window.png", png(head, (b"IDAT", b"\xf8\x1d" + data[2:]), END)
    yield "idat-of-another-method.png", png(head, (b"IDAT", b"\x79\x9b" + data[2:]), END)
    yield "idat-wrong-sum.png", png(head, (b"IDAT", data[:-4] + b"\0\0\0\0"), END)
    yield (
        "idat-stored-length-wrong.png",
        png(head, (b"IDAT", b"\x78\x01\x01\xff\xff\xff\xff" + bytes(52)), END),
    )
    for number in (5, 6, 255):
        filtered = bytes(b for _ in range(4) for b in (number, *bytes(12)))
        yield f"filter-{number}.png", png(head, (b"IDAT", zlib.compress(filtered)), END)
    for width, height in ((1, 1), (3, 1), (1, 5), (5, 7), (2**29, 1), (1, 2**29), (2**31 - 8, 1)):
        claim = (b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 6, 0, 0, 1))
        yield f"interlaced-{width}x{height}.png", png(claim, (b"IDAT", zlib.compress(bytes(9))), END)
    for width in (2**30, 2**31 // 24 + 1, 0x55555555):
        yield f"row-overflows-{width}.png", png(header(width, 1), (b"IDAT", data), END)
    yield "row-of-zero-factor.png", png(header(2**29, 1, 16, 6), (b"IDAT", data), END)
    yield "interlaced-16-bits.png", png(header(5, 5, 16, 2, 1), (b"IDAT", zlib.compress(bytes(300))), END)


def lengths() -> Files:
    """Chunks whose length lies: CVE-2017-12652, CVE-2008-1382, CVE-2013-7353, CVE-2007-2445."""
    whole = small()
    for length in (2**31 - 1, 2**31, 2**32 - 1, 2**32 - 12):
        for kind in (b"IDAT", b"tEXt", b"zzZz"):
            chunk = struct.pack(">I4s", length, kind) + bytes(60)
            yield f"length-{length}-of-{kind.decode()}.png", whole[:33] + chunk + whole[33:]
    for size in (0, 12, 14, 4000):
        yield (
            f"head-of-{size}.png",
            png((b"IHDR", header(4, 4)[1].ljust(size, b"\0")[:size]), rows(4, 4, 24), END),
        )
    yield "head-twice.png", png(header(4, 4), header(9000, 9000), rows(4, 4, 24), END)
    yield "head-not-first.png", png((b"gAMA", bytes(4)), header(4, 4), rows(4, 4, 24), END)
    yield "end-with-content.png", png(header(4, 4), rows(4, 4, 24), (b"IEND", bytes(9000)))
    yield "unknown-critical.png", small((b"ABCD", bytes(9)))
    yield "unknown-empty.png", small((b"abCd", b""))
    yield "kind-of-no-letters.png", small((b"\0\xff1!", b"x"))
    yield "wrong-sum-of-trns.png", small((b"tRNS", bytes(6))).replace(b"tRNS\0", b"tRNS\1")


def notes() -> Files:
    """Notes that are cut, empty or packed to burst.

    As in CVE-2010-0205, CVE-2011-3026, CVE-2015-8540, CVE-2015-7981.
    """
    bomb = zlib.compress(bytes(40_000_000))
    contents = {
        b"tEXt": (b"", b"\0", b" " * 90, b"k" * 200 + b"\0v", b"no separator"),
        b"zTXt": (b"", b"k\0", b"k\0\x07" + bomb[:99], b"k\0\0", b"k\0\0" + bomb),
        b"iTXt": (b"", b"k\0\1\0", b"k\0\1\0\0\0", b"k\0\2\2\0\0x", b"k\0\0\0" + b"a" * 9999),
        b"iCCP": (
            b"",
            b"\0\0",
            b"n" * 200 + b"\0\0",
            b"n\0\x09" + bomb[:99],
            b"n\0\0" + bomb,
            b"n\0\0" + zlib.compress(b""),
        ),
        b"sCAL": (b"", b"\1", b"\1-1\0" + b"2", b"\1" + b"9" * 999 + b"\0"),
        b"pCAL": (b"", b"p\0" + bytes(8) + b"\xff\xff", b"p" * 99),
        b"sPLT": (b"", b"s\0\x09", b"s\0\x10" + bytes(10_001)),
        b"tIME": (b"", b"\xff" * 7, b"\x07\xd0\x0d\x20\x19\x3d\x3d"),
        b"cHRM": (b"", bytes(32), b"\xff" * 32),
        b"gAMA": (b"", bytes(4), b"\xff" * 4),
        b"sRGB": (b"", b"\xff"),
        b"pHYs": (b"\xff" * 9, b"\xff" * 8),
        b"eXIf": (b"", b"II", b"II*\0\xff\xff\xff\xff"),
        b"acTL": (b"\xff" * 8, bytes(8)),
    }
    for kind, several in contents.items():
        for number, content in enumerate(several):
            yield f"{kind.decode()}-{number}.png", small((kind, content))


PARTS = (palettes, pixels, lengths, notes)
