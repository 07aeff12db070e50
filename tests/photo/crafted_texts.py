"""Photos whose texts, IPTC, named colours and places on earth are made to harm."""

from __future__ import annotations

import struct
import zlib
from typing import TYPE_CHECKING

import numpy as np
from crafted_photos import deflated
from hostile_corpus import XMP, by_tifffile, exif, photos, png, png_chunks

if TYPE_CHECKING:
    from collections.abc import Iterator

IPTC = b"\x1c\x02\x50\0\3Ann" * 3


def texts() -> Iterator[tuple[str, bytes]]:
    yield from _png_texts()
    yield from _raw_profiles()
    yield from _named_colours()
    yield from _jpegs()
    yield from _tiffs()


def _with(*chunks: tuple[bytes, bytes], behind: bool = False) -> bytes:
    """Return a PNG with these chunks before its pixels, or behind them."""
    plain = [chunk for chunk in png_chunks(photos()["rgba.png"]) if chunk[0] in (b"IHDR", b"IDAT", b"IEND")]
    at = len(plain) - 1 if behind else 1
    return png(*plain[:at], *chunks, *plain[at:])


def _png_texts() -> Iterator[tuple[str, bytes]]:
    long = b"k" * 80
    odd = {
        "text-empty": (b"tEXt", b""),
        "text-without-gap": (b"tEXt", b"Author"),
        "text-without-keyword": (b"tEXt", b"\0Ann"),
        "text-with-a-long-keyword": (b"tEXt", long + b"\0Ann"),
        "text-of-zeros": (b"tEXt", b"Author\0" + bytes(5000)),
        "text-of-controls": (b"tEXt", b"\x1b]0;x\7\0\x1b[2J"),
        "packed-empty": (b"zTXt", b"Author\0"),
        "packed-by-nobody": (b"zTXt", b"Author\0\xff" + zlib.compress(b"Ann")),
        "packed-junk": (b"zTXt", b"Author\0\0junk"),
        "packed-without-end": (b"zTXt", b"Author\0\0" + zlib.compress(b"Ann" * 99)[:-5]),
        "packed-bomb": (b"zTXt", b"Author\0\0" + deflated(1 << 28)),
        "world-empty": (b"iTXt", b""),
        "world-without-language": (b"iTXt", b"Author\0\0\0"),
        "world-without-end-of-language": (b"iTXt", b"Author\0\0\0" + b"e" * 100_000),
        "world-not-unicode": (b"iTXt", b"Author\0\0\0en\0\xff\xfe\0\xff\xc0\x80"),
        "world-surrogates": (b"iTXt", b"Author\0\0\0en\0a\0\xed\xa0\x80\xed\xb0\x80"),
        "world-packed-oddly": (b"iTXt", b"Author\0\2\5en\0a\0text"),
        "world-bomb": (b"iTXt", b"Author\0\1\0\0\0" + deflated(1 << 28)),
        "xmp-as-plain-text": (b"tEXt", b"XML:com.adobe.xmp\0" + XMP),
        "text-of-60-megabytes": (b"tEXt", b"Comment\0" + b"x" * 60_000_000),
    }
    for name, chunk in odd.items():
        yield f"{name}.png", _with(chunk)
    bomb = (b"zTXt", b"Comment\0\0" + deflated(15 << 20))
    yield "many-packed-bombs-behind.png", _with(*[bomb] * 900, behind=True)
    xmp_bomb = (b"iTXt", b"XML:com.adobe.xmp\0\1\0\0\0" + deflated(17 << 20))
    yield "many-xmp-bombs.png", _with(*[xmp_bomb] * 3000)
    halves = deflated(8 << 20)
    yield "many-broken-bombs.png", _with(*[(b"zTXt", b"Comment\0\0" + halves[:-4] + b"oops")] * 3000)
    yield "million-texts.png", _with(*[(b"tEXt", b"a\0b")] * 1_000_000)
    yield (
        "xmp-behind-many-texts.png",
        _with(*[(b"tEXt", b"a\0b")] * 2000, (b"iTXt", b"XML:com.adobe.xmp\0\0")),
    )


def _raw(kind: bytes, text: bytes, chunk: bytes = b"tEXt") -> tuple[bytes, bytes]:
    packed = b"\0" + zlib.compress(text) if chunk == b"zTXt" else text
    return chunk, b"Raw profile type " + kind + b"\0" + packed


def _raw_profiles() -> Iterator[tuple[str, bytes]]:
    block = exif().hex().encode()
    size = len(block) // 2
    for kind in (b"exif", b"APP1", b"8bim", b"icc"):
        name = kind.decode()
        lengths = (b"0", b"-1", b"%d" % (size + 1), b"4294967296", b"9" * 5000, b"", b"nan", b"\xb2")
        for number, length in enumerate(lengths):
            yield (
                f"raw-{name}-length-{number}.png",
                _with(_raw(kind, b"\n" + kind + b"\n" + length + b"\n" + block)),
            )
        yield f"raw-{name}-odd-digits.png", _with(_raw(kind, b"\nx\n%d\n" % size + block[:-1]))
        yield f"raw-{name}-no-digits.png", _with(_raw(kind, b"\nx\n%d\n" % size + b"zz" * size))
        yield f"raw-{name}-no-lines.png", _with(_raw(kind, b"\n" * 100_000))
    yield (
        "raw-nested.png",
        _with(_raw(b"8bim", b"\nx\n40\n" + (b"8BIM\4\4\0\0\0\0\0\x1c" * 4).hex().encode())),
    )
    yield "raw-bomb.png", _with((b"zTXt", b"Raw profile type exif\0\0" + deflated(1 << 28)))
    digits = b"\nexif\n%8d\n" % (5 << 20) + b"00" * (5 << 20)
    yield "raw-of-zeros.png", _with(_raw(b"exif", digits, b"zTXt"))
    yield "raw-without-kind.png", _with(_raw(b"", b"\nx\n1\n00"))


def _named_colours() -> Iterator[tuple[str, bytes]]:
    for numbers in (
        (255,) * 4,
        (0, 0, 0, 0),
        (12, 13, 9, 1),
        (9, 16, 255, 7),
        (10, 8, 0, 1),
        (22, 5, 0, 200),
    ):
        name = "-".join(map(str, numbers))
        yield f"cicp-{name}.png", _with((b"cICP", bytes(numbers)))
    yield "cicp-long.png", _with((b"cICP", bytes([12, 13, 0, 1]) * 1000))
    for gamma in (0, 1, 2**31, 2**32 - 1, 10**6):
        yield f"gamma-{gamma}.png", _with((b"gAMA", struct.pack(">I", gamma)))
    yield "gamma-short.png", _with((b"gAMA", b"\1"))
    good = [31270, 32900, 64000, 33000, 30000, 60000, 15000, 6000]
    odd = {
        "zeros": [0] * 8,
        "largest": [2**32 - 1] * 8,
        "white-without-light": [31270, 0, *good[2:]],
        "white-on-an-edge": [64000, 33000, *good[2:]],
        "white-outside": [1, 99_999, *good[2:]],
        "a-line": [31270, 32900, 10_000, 10_000, 20_000, 20_000, 30_000, 30_000],
        "a-point": [31270, 32900, *[33_333, 33_333] * 3],
        "hardly-a-triangle": [31270, 32900, 64000, 33000, 30000, 60000, 63999, 33001],
        "turned": [31270, 32900, *good[6:], *good[4:6], *good[2:4]],
        "blue-without-y": [*good[:7], 1],
    }
    for name, numbers in odd.items():
        for gamma in (45455, 100_000, 1):
            chunks = (b"cHRM", struct.pack(">8I", *numbers)), (b"gAMA", struct.pack(">I", gamma))
            yield f"primaries-{name}-{gamma}.png", _with(*chunks)
    yield "primaries-short.png", _with((b"cHRM", struct.pack(">7I", *good[:7])))


def _segment(marker: int, content: bytes) -> bytes:
    return struct.pack(">HH", 0xFF00 | marker, 2 + len(content)) + content


def _resource(number: int, data: bytes, length: int | None = None, name: bytes = b"\0\0") -> bytes:
    told = len(data) if length is None else length
    return b"8BIM" + struct.pack(">H", number) + name + struct.pack(">I", told) + data + bytes(len(data) % 2)


def _resources() -> Iterator[tuple[str, bytes]]:
    yield "empty", b""
    yield "signature", b"8BIM"
    yield "number-alone", b"8BIM\4\4"
    yield "name-beyond", b"8BIM\4\4\xffname"
    yield "length-cut", b"8BIM\4\4\0\0\0\0"
    for length in (0, 1, 2**31, 2**32 - 1):
        yield f"length-{length}", _resource(1028, IPTC, length)
    yield "odd-and-not-filled-up", _resource(1028, IPTC + b"x")[:-1]
    yield "nested", _resource(1028, _resource(1028, _resource(1028, IPTC)))
    yield "thousands", _resource(1, b"") * 5000
    yield "twice", _resource(1028, IPTC) + _resource(1028, b"\x1c\2\x50\0\3Eve")
    yield "iptc-extended", _resource(1028, b"\x1c\2\x78\x80\4\xff\xff\xff\xff" + b"x" * 9)
    yield "iptc-extended-by-much", _resource(1028, b"\x1c\2\x78\xff\xff" + b"\xff" * 20)
    yield "iptc-beyond", _resource(1028, b"\x1c\2\x78\x7f\xffx")
    yield "iptc-none", _resource(1028, b"no datasets")
    yield "path-of-junk", _resource(2000, b"\xff" * 27, name=b"\4path\0")
    yield "thumbnail", _resource(1036, b"\0" * 28 + b"\xff\xd8\xff")


def _jpegs() -> Iterator[tuple[str, bytes]]:
    start, rest = photos()["rgb.jpg"][:2], photos()["rgb.jpg"][2:]
    for name, block in _resources():
        yield f"resources-{name}.jpg", start + _segment(0xED, b"Photoshop 3.0\0" + block) + rest
    part = _segment(0xED, b"Photoshop 3.0\0" + _resource(1028, bytes(65000)))
    yield "many-resources.jpg", start + part * 300 + rest
    tiny = _segment(0xED, b"Photoshop 3.0\0" + _resource(1, b"") * 5000)
    yield "millions-of-resources.jpg", start + tiny * 400 + rest
    yield "resources-never-whole.jpg", start + _segment(0xED, b"Photoshop 3.0\0" + b"8BIM") * 10_000 + rest
    yield "million-comments.jpg", start + _segment(0xFE, b"x") * 1_000_000 + rest
    yield "comment-of-zeros.jpg", start + _segment(0xFE, bytes(65533)) + rest
    yield "comment-of-controls.jpg", start + _segment(0xFE, b"\x1b]0;x\7\r\n\xff\xfe\xed\xa0\x80") + rest
    further = b"http://ns.adobe.com/xmp/extension/\0" + b"G" * 32 + struct.pack(">II", 2**32 - 1, 2**32 - 1)
    yield "extended-xmp.jpg", start + _segment(0xE1, further) * 1000 + rest


def _tiffs() -> Iterator[tuple[str, bytes]]:
    pixels = np.zeros((4, 4, 3), np.uint8)

    def made(*tags: tuple[int, int, int, object]) -> bytes:
        return by_tifffile(pixels, photometric="rgb", extratags=[(*tag, True) for tag in tags])

    for name, block in _resources():
        if len(block) > 8:
            yield f"resources-{name}.tif", made((34377, 7, len(block), block))
    yield "iptc-as-numbers.tif", made((33723, 4, 6, (0x5002_1C, 1, 2, 3, 0, 0)))
    yield "iptc-as-text.tif", made((33723, 2, 0, "no datasets"))
    yield "iptc-of-many-datasets.tif", made((33723, 7, 5_000_000, b"\x1c\2\x50\0\0" * 1_000_000))
    scale, keys = (33550, 12, 3, (1.0, 1.0, 0.0)), (34735, 3, 8, (1, 1, 0, 1, 1024, 0, 1, 1))
    yield "geo-keys-beyond.tif", made(scale, (34735, 3, 8, (1, 1, 0, 65535, 1026, 34737, 65535, 65535)))
    yield "geo-keys-in-a-circle.tif", made((34735, 3, 8, (1, 1, 0, 1, 1024, 34735, 65535, 0)))
    yield "geo-not-a-number.tif", made((33550, 12, 3, (float("nan"), float("inf"), -0.0)), keys)
    yield "geo-of-another-type.tif", made((33550, 3, 3, (1, 1, 0)), keys)
    yield "geo-one-number.tif", made((33550, 12, 1, 1.0), (34735, 3, 1, 1))
    yield "geo-text-not-ascii.tif", made(keys, (34737, 2, 0, "WGS\x7f 84|"))
    yield "geo-many-points.tif", made((33922, 12, 600_000, (1.0,) * 600_000))
    whole = made(scale, keys)
    for tag, kind in ((33550, 12), (34735, 3)):
        at = whole.index(struct.pack("<HH", tag, kind))
        for count in (0, 2**31, 2**32 - 1):
            yield f"geo-{tag}-count-{count}.tif", whole[: at + 4] + struct.pack("<I", count) + whole[at + 8 :]
        yield f"geo-{tag}-elsewhere.tif", whole[: at + 8] + b"\xff\xff\xff\x7f" + whole[at + 12 :]
