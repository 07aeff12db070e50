"""Files made to harm: decompression bombs, wild claims, circles, and what once went wrong here."""

from __future__ import annotations

import functools
import io
import struct
import zlib
from typing import TYPE_CHECKING

import imagecodecs
import numpy as np
import tifffile
from hostile_corpus import Case, by_pillow, by_tifffile, exif, photos, png, png_chunks, profile
from PIL import Image, ImageCms

if TYPE_CHECKING:
    from collections.abc import Iterator

_HUGE = 195_000_000  # px, within what is allowed
_WIDE, _HIGH = 15_000, 13_000


def crafted(*kinds: str) -> Iterator[Case]:
    """Yield every crafted file, or those of some kinds; the large ones are made one at a time."""
    parts = {
        "png": _pngs,
        "jpeg": _jpegs,
        "tiff": _tiffs,
        "webp": _webps,
        "pnm": _pnms,
        "bmp": _bmps,
        "other": _others,
        "metadata": _metadata,
        "landmarks": _landmarks,
    }
    for kind in kinds or parts:
        for name, data in parts[kind]():
            yield Case(name, f".{name.rpartition('.')[2]}", data)


def deflated(count: int) -> bytes:
    """Return so many zeros, compressed, without ever holding them: blocks that know of no other, repeated."""
    packer = zlib.compressobj(9, zlib.DEFLATED, -15)
    block = packer.compress(bytes(1 << 20)) + packer.flush(zlib.Z_FULL_FLUSH)
    rest = packer.compress(bytes(count % (1 << 20))) + packer.flush()
    return b"\x78\x9c" + block * (count >> 20) + rest + struct.pack(">HH", count % 65521, 1)


def header(
    width: int, height: int, depth: int = 8, colour: int = 2, interlace: int = 0
) -> tuple[bytes, bytes]:
    """Return the header chunk of a PNG."""
    return b"IHDR", struct.pack(">IIBBBBB", width, height, depth, colour, 0, 0, interlace)


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


def _pngs() -> Iterator[tuple[str, bytes]]:
    pixel = (b"IDAT", zlib.compress(b"\0\0\0\0"))
    end = (b"IEND", b"")
    bomb = deflated(1 << 28)
    yield "empty.png", b""
    yield "signature-only.png", b"\x89PNG\r\n\x1a\n"
    for width, height in (
        (0, 0),
        (0, 5),
        (5, 0),
        (2**31 - 1, 1),
        (2**31 - 1, 2**31 - 1),
        (2**32 - 1, 2**32 - 1),
    ):
        yield f"claims-{width}x{height}.png", png(header(width, height), pixel, end)
    yield "claims-much-and-has-little.png", png(header(_WIDE, _HIGH), pixel, end)
    yield "claims-a-long-row.png", png(header(_HUGE, 1, 16, 6), pixel, end)
    rows = deflated(_HIGH * (1 + 8 * _WIDE))
    yield "blank-16-bit-rgba.png", png(header(_WIDE, _HIGH, 16, 6), (b"IDAT", rows), end)
    rows = deflated(_HIGH * (1 + 3 * _WIDE))
    yield "blank-rgb.png", png(header(_WIDE, _HIGH), (b"IDAT", rows), end)
    rows = deflated(_HIGH * (1 + _WIDE))
    palette = (b"PLTE", bytes(768)), (b"tRNS", bytes(256))
    yield "blank-palette.png", png(header(_WIDE, _HIGH, 8, 3), *palette, (b"IDAT", rows), end)
    yield "more-pixels-than-claimed.png", png(header(1, 1), (b"IDAT", bomb), end)
    profile_bomb = (b"iCCP", b"x\0\0" + bomb)
    text_bomb = (b"iTXt", b"XML:com.adobe.xmp\0\1\0\0\0" + bomb)
    old_text_bomb = (b"zTXt", b"Comment\0\0" + zlib.compress(b"a" * (7 << 20)))
    yield "profile-bomb.png", png(header(1, 1), profile_bomb, pixel, end)
    yield "text-bomb.png", png(header(1, 1), text_bomb, pixel, end)
    small_bomb = deflated(16 << 20)
    yield "many-profile-bombs.png", png(header(1, 1), *[(b"iCCP", b"x\0\0" + small_bomb)] * 900, pixel, end)
    packed = (b"iTXt", b"XML:com.adobe.xmp\0\1\0\0\0" + small_bomb)
    yield "many-text-bombs.png", png(header(1, 1), *[packed] * 900, pixel, end)
    yield "many-old-text-bombs.png", png(header(1, 1), *[old_text_bomb] * 900, pixel, end)
    yield "old-text-bombs-at-the-end.png", png(header(1, 1), pixel, *[old_text_bomb] * 900, end)
    yield "many-empty-chunks.png", png(header(1, 1), *[(b"teSt", b"")] * 1_000_000, pixel, end)
    yield "many-empty-pixel-chunks.png", png(header(1, 1), *[(b"IDAT", b"")] * 1_000_000, pixel, end)
    yield "chunk-beyond-the-end.png", png(header(1, 1))[:-4] + struct.pack(">I4s", 2**32 - 1, b"eXIf")
    yield "no-pixels.png", png(header(4, 4), end)
    yield "no-palette.png", png(header(1, 1, 8, 3), pixel, end)
    yield "palette-behind.png", png(header(1, 1, 8, 3), pixel, (b"PLTE", bytes(3)), end)
    yield (
        "index-out-of-palette.png",
        png(header(1, 1, 8, 3), (b"PLTE", bytes(3)), (b"IDAT", zlib.compress(b"\0\xff")), end),
    )
    for depth, colour in ((3, 0), (16, 3), (4, 2), (255, 255), (0, 0)):
        yield f"depth-{depth}-colour-{colour}.png", png(header(1, 1, depth, colour), pixel, end)
    yield "short-resolution.png", png(header(1, 1), (b"pHYs", b""), (b"pHYs", b"\0" * 8 + b"\1"), pixel, end)
    yield "short-animation.png", png(header(1, 1), (b"acTL", b""), pixel, end)
    yield "other-interlacing.png", png(header(1, 1, interlace=7), pixel, end)
    yield "text-behind-the-end.png", photos()["rgb.png"] + photos()["rgb.jpg"]
    yield "two-photos.png", photos()["rgb.png"] * 2


def _jpegs() -> Iterator[tuple[str, bytes]]:
    yield "start-only.jpg", b"\xff\xd8\xff"
    blank = _blank_jpeg()
    yield "blank.jpg", blank
    colour = by_pillow(Image.new("RGB", (_WIDE, _HIGH)), "JPEG", quality=10)
    yield "blank-rgb.jpg", colour
    yield "blank-cut-short.jpg", colour[:4000]
    frame = blank.index(b"\xff\xc0") + 5
    for width, height in ((0, 9), (9, 0), (65535, 65535), (65535, 3000)):
        yield (
            f"claims-{width}x{height}.jpg",
            blank[:frame] + struct.pack(">HH", height, width) + blank[frame + 4 :],
        )
    for size in (2000, 13000):
        tall = by_pillow(Image.new("L", (size, size)), "JPEG", progressive=True)
        yield f"many-scans-{size}.jpg", scans(tall, 5000)
    segments = b"\xff\xe1" + struct.pack(">H", 65535) + b"Exif\0\0" + bytes(65527)
    yield "many-exif-blocks.jpg", b"\xff\xd8" + segments * 300 + photos()["rgb.jpg"][2:]
    text = b"http://ns.adobe.com/xap/1.0/\0".ljust(65533, b"x")
    yield "many-xmp-packets.jpg", b"\xff\xd8" + (b"\xff\xe1\xff\xff" + text) * 100 + photos()["rgb.jpg"][2:]
    pieces = b"".join(
        b"\xff\xe2\xff\xff" + (b"ICC_PROFILE\0" + bytes([n, 255])).ljust(65533, b"p") for n in range(1, 256)
    )
    yield "profile-of-16-megabytes.jpg", b"\xff\xd8" + pieces + photos()["rgb.jpg"][2:]
    yield "fill-bytes.jpg", b"\xff\xd8" + b"\xff" * 5_000_000 + photos()["rgb.jpg"][2:]
    yield "empty-segments.jpg", b"\xff\xd8" + b"\xff\xfe\0\2" * 500_000 + photos()["rgb.jpg"][2:]
    yield "short-segment.jpg", b"\xff\xd8\xff\xe1\0\0" + photos()["rgb.jpg"][2:]
    mpf = b"\xff\xe2" + struct.pack(">H", 60) + b"MPF\0II*\0\x08\0\0\0" + b"\xff" * 46
    yield "wild-multi-picture.jpg", b"\xff\xd8" + mpf + photos()["rgb.jpg"][2:]


def scans(progressive: bytes, count: int) -> bytes:
    """Return a progressive JPEG with its last scan repeated: each goes over all pixels again."""
    start = progressive.rindex(b"\xff\xda")
    return progressive[:start] + progressive[start:-2] * count + b"\xff\xd9"


@functools.cache
def _blank_jpeg() -> bytes:
    return by_pillow(Image.new("L", (_WIDE, _HIGH)), "JPEG")


def _tiffs() -> Iterator[tuple[str, bytes]]:
    blank = zlib.compress(bytes(16))
    yield "header-only.tif", b"II*\0\x08\0\0\0"
    yield "directory-is-the-header.tif", b"II*\0\0\0\0\0"
    yield "circle.tif", page(4, 4, blank).replace(b"\0\0\0\0" + blank, b"\x08\0\0\0" + blank)
    yield "bomb-in-a-strip.tif", page(4, 4, deflated(1 << 30))
    for width, height in ((0, 4), (4, 0), (2**32 - 1, 2**32 - 1), (2**31, 1), (_HUGE, 1), (1, _HUGE)):
        yield f"claims-{width}x{height}.tif", page(width, height, blank)
    yield "claims-much-and-has-little.tif", page(_WIDE, _HIGH, blank)
    for bits, samples in ((0, 1), (64, 1), (255, 1), (65535, 1), (8, 0), (8, 65535), (16, 4), (64, 4)):
        yield f"{bits}-bits-{samples}-samples.tif", page(_WIDE, _HIGH, blank, bits=bits, samples=samples)
    for rows in (0, 1, 2**32 - 1):
        yield f"{rows}-rows-a-strip.tif", page(4, 4, blank, rows=rows)
    yield "strip-beyond-the-end.tif", page(4, 4, blank, start=2**32 - 1)
    yield "strip-of-no-bytes.tif", page(4, 4, blank, bytes=0)
    yield "strip-of-4-gigabytes.tif", page(4, 4, blank, bytes=2**32 - 1)
    yield "plain-strip-beyond-the-end.tif", page(4, 4, bytes(16), compression=1, start=2**32 - 1)
    rows = deflated(_HIGH * (1 + _WIDE))
    blank_png = png(header(_WIDE, _HIGH, 8, 0), (b"IDAT", rows), (b"IEND", b""))
    inside = {7: _blank_jpeg(), 34933: blank_png, 50001: _blank_webp()}
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
        yield f"blank-fax-{number}.tif", page(_WIDE, _HIGH, bytes(1 << 16), compression=number, bits=1)
    for bits, samples, photometric in (
        (1, 1, 1),
        (10, 1, 1),
        (12, 1, 1),
        (8, 3, 2),
        (16, 3, 2),
        (16, 4, 2),
        (32, 3, 2),
    ):
        data = deflated(_HIGH * -(-_WIDE * bits * samples // 8))
        yield (
            f"blank-{bits}-bits-{samples}-samples.tif",
            page(_WIDE, _HIGH, data, bits=bits, samples=samples, photometric=photometric),
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
        for tag, value in ((256, _WIDE), (257, _HIGH), (278, _HIGH)):
            tags[tag].overwrite(value)
    return file.getvalue()


@functools.cache
def _blank_webp() -> bytes:
    return bytes(imagecodecs.webp_encode(np.zeros((_HIGH, _WIDE, 4), np.uint8), lossless=True, level=0))


def _webps() -> Iterator[tuple[str, bytes]]:
    yield "start-only.webp", b"RIFF\x04\0\0\0WEBP"
    yield "no-picture.webp", b"RIFF\x0c\0\0\0WEBPVP8 \0\0\0\0"
    yield "blank.webp", by_pillow(Image.new("RGB", (6000, 6000)), "WEBP", quality=1, method=0)
    yield "blank-lossless.webp", _blank_webp()
    data = photos()["alpha.webp"]
    at = data.index(b"VP8X") + 12
    for size in (1, 2**24):
        canvas = (size - 1).to_bytes(3, "little") * 2
        yield f"canvas-of-{size}.webp", data[:at] + canvas + data[at + 6 :]
    lossless = photos()["lossless.webp"]
    yield "claims-16384x16384.webp", lossless[:21] + b"\xff\xff\xff\x0f" + lossless[25:]
    for size in (0, 2**32 - 1):
        yield f"length-{size}.webp", lossless[:4] + struct.pack("<I", size) + lossless[8:]


def _pnms() -> Iterator[tuple[str, bytes]]:
    yield "comments-without-end.ppm", b"P5 " + b"#\r" * 3000 + b"x"
    yield "comments-in-comments.ppm", b"P6\n" + b"# #\r\n" * 3000 + b"1 1 255\n"
    yield "blanks-without-end.ppm", b"P6" + b" " * 4_000_000
    yield "digits-without-end.ppm", b"P6 " + b"1" * 4_000_000
    for kind in range(1, 7):
        for size in (b"0 0", b"1000000000 1", b"-1 5", b"4294967297 1", b"1e3 5", b"%d %d" % (_WIDE, _HIGH)):
            yield f"p{kind}-{size.decode().replace(' ', 'x')}.ppm", b"P%d %s 255\n\1\2\3" % (kind, size)
        for largest in (b"0", b"65536", b"-1", b"9" * 5000, b""):
            yield f"p{kind}-largest-{largest[:9].decode()}.ppm", b"P%d 1 1 %s\n\1\2\3\4\5\6" % (kind, largest)
    yield "blank-bits.ppm", b"P4 %d %d\n" % (_WIDE, _HIGH) + bytes(_WIDE // 8 * _HIGH)
    yield "blank-of-100.ppm", b"P5 %d %d 100\n" % (_WIDE, _HIGH) + bytes(_WIDE * _HIGH)
    yield "plain-of-40-megabytes.ppm", b"P2 4000 5000 9\n" + b"1 " * 20_000_000
    yield "plain-bits-of-40-megabytes.ppm", b"P1 8000 5000\n" + b"1" * 40_000_000
    yield "plain-without-blanks.ppm", b"P3 2 1 255\n" + b"1" * 1_000_000
    yield "plain-words.ppm", b"P3 1 1 255\none two three"
    yield "plain-negative.ppm", b"P2 2 1 255\n-1 2"
    yield "plain-above-the-largest.ppm", b"P2 2 1 9\n99999999999999999999 2"
    yield "plain-of-comments.ppm", b"P2 1 1 255\n" + b"#\n" * 1_000_000 + b"7"
    yield "many-pictures.ppm", b"P5 1 1 255\n" + bytes(10_000_000)


def _bmps() -> Iterator[tuple[str, bytes]]:
    yield "start-only.bmp", b"BM"
    data = photos()["rgb.bmp"]
    for width, height in ((0, 0), (2**31 - 1, 1), (1, -(2**31)), (-1, -1), (_WIDE, _HIGH), (_HUGE, 1)):
        yield f"claims-{width}x{height}.bmp", data[:18] + struct.pack("<ii", width, height) + data[26:]
    packed = photos()["run-lengths.bmp"]
    start = int.from_bytes(packed[10:14], "little")

    def runs(width: int, height: int, body: bytes, kind: int = 1) -> bytes:
        size = struct.pack("<iiHHI", width, height, 1, 8 if kind == 1 else 4, kind)
        return packed[:18] + size + packed[34:start] + body

    yield "rows-filled-byte-by-byte.bmp", runs(_HUGE // 2, 2, b"\1\1\0\0" * 2)
    yield "runs-of-nibbles.bmp", runs(_WIDE, _HIGH, (b"\xff\x12" * 58 + b"\xd2\x12\0\0") * _HIGH, 2)
    yield "runs-beyond-the-row.bmp", runs(1, 2, b"\xff\x12" * 2_000_000)
    yield "steps.bmp", runs(_WIDE, _HIGH, b"\0\2\xff\xff" * 1000)
    for offset in (0, 2**32 - 1):
        yield f"pixels-at-{offset}.bmp", data[:10] + struct.pack("<I", offset) + data[14:]


def _others() -> Iterator[tuple[str, bytes]]:
    files = photos()
    for name in ("rgb.jpg", "rgb.png", "pillow.tif", "rgb.bmp"):
        for other in ("rgb.jpg", "rgb.png", "pillow.tif", "lossy.webp"):
            yield f"{name}-before-{other}", files[name] + files[other]
    yield "archive-behind.png", files["rgb.png"] + b"PK\x05\x06" + bytes(18)
    yield "script.bmp", b"BM=1/*" + bytes(60) + b"*/;alert(1)"
    yield "text.jpg", b"no photo at all\n" * 99
    yield "zeros.png", bytes(100_000)
    yield "html.jpg", b"<!DOCTYPE html><html><body>404</body></html>"


def _metadata() -> Iterator[tuple[str, bytes]]:
    plain = png_chunks(photos()["rgba.png"])
    pixels = [chunk for chunk in plain if chunk[0] in (b"IHDR", b"IDAT", b"IEND")]
    circle = b"II*\0\x08\0\0\0" + struct.pack("<HHHIIHHIII", 2, 34665, 4, 1, 8, 34853, 4, 1, 8, 8)
    itself = b"II*\0" + struct.pack("<I", 0)
    far = b"MM\0*" + struct.pack(">I", 2**32 - 1)
    many = b"II*\0\x08\0\0\0" + b"\xff\xff" + struct.pack("<HHII", 274, 3, 1, 6) * 65535
    huge = exif() + bytes(20_000_000)
    wild = b"II*\0\x08\0\0\0" + struct.pack("<HHHIII", 1, 270, 2, 2**32 - 1, 2**32 - 1, 0)
    blocks = {"circle": circle, "itself": itself, "far": far, "many": many, "huge": huge, "wild": wild}
    for name, block in blocks.items():
        yield f"exif-{name}.png", png(pixels[0], (b"eXIf", block), *pixels[1:])
        if len(block) < 60_000:
            rgb = Image.new("RGB", (8, 8))
            yield f"exif-{name}.jpg", by_pillow(rgb, "JPEG", exif=b"Exif\0\0" + block)
            yield f"exif-{name}.webp", by_pillow(rgb, "WEBP", exif=block)
    xmp = b"XML:com.adobe.xmp\0\0\0\0\0" + b"<x/>" * 5_000_000
    yield "xmp-of-20-megabytes.png", png(pixels[0], (b"iTXt", xmp), *pixels[1:])
    for name, content in _profiles():
        yield f"profile-{name}.png", png(pixels[0], (b"iCCP", b"x\0\0" + zlib.compress(content)), *pixels[1:])
        yield (
            f"profile-{name}.tif",
            by_tifffile(np.zeros((4, 4, 3), np.uint8), photometric="rgb", iccprofile=content),
        )


def _profiles() -> Iterator[tuple[str, bytes]]:
    good = profile()
    yield "empty", b"\0"
    yield "cut-short", good[: len(good) // 2]
    yield "header-only", good[:128]
    yield "padded-to-16-megabytes", good + bytes(2**24 - 1 - len(good))
    yield "grey", profile("gray")
    yield "lab", ImageCms.ImageCmsProfile(ImageCms.createProfile("LAB")).tobytes()
    yield "many-tags", good[:128] + struct.pack(">I", 2**32 - 1) + good[132:]
    for number, content in enumerate((b"\0\0\0\0", b"\xff\xff\xff\xff", b"\x7f\xff\xff\xff")):
        for at in range(132, 132 + 12 * 4, 4):
            yield f"number-{number}-at-{at}", good[:at] + content + good[at + 4 :]
    for signature in (b"CMYK", b"GRAY", b"XYZ ", b"nope"):
        yield f"space-{signature.decode().strip()}", good[:16] + signature + good[20:]


def _landmarks() -> Iterator[tuple[str, bytes]]:
    points = b"1 1\n2 9\n7 3\n"
    yield "count-of-a-million-millions.pts", b"version: 1\nn_points: 1000000000000\n{\n" + points + b"}\n"
    yield "count-of-999999.tem", b"999999\n" + points
    yield "many-points.pts", b"{\n" + b"1 1\n2 9\n7 3\n" * 330_000 + b"}"
    yield "points-all-different.csv", b"x,y\n" + b"".join(b"%d,%d\n" % (i % 997, i) for i in range(400_000))
    yield "a-long-number.pts", b"{\n" + b"9" * 3_000_000 + b" 1\n}"
    yield "a-long-fraction.csv", b"x,y\n0." + b"7" * 100_000 + b",1\n2,9\n7,3\n"
    for name, value in {
        "e": b"1e999999999",
        "nan": b"sNaN",
        "inf": b"Infinity",
        "tiny": b"1e-999999999",
    }.items():
        for extension, text in {
            "pts": b"{\n%s 1\n2 9\n7 3\n}",
            "tem": b"3\n%s 1\n2 9\n7 3\n0",
            "csv": b"x,y\n%s,1\n2,9\n7,3",
        }.items():
            yield f"value-{name}.{extension}", text % value
    yield "comments.pts", b"#" * 4_000_000
    yield "braces.pts", b"{\n" * 2_000_000
    yield "blank-lines.tem", b"\x0b" * 4_000_000
    columns = 400_000
    yield "a-million-columns.csv", b",".join(b"x_%d" % i for i in range(columns)) + b"\n" + b"1," * columns
    yield (
        "many-openface-columns.csv",
        b",".join(b"x_%d,y_%d" % (i, i) for i in range(200_000)) + b"\n" + b"1," * columns,
    )
    yield "no-openface-columns.csv", b"x_0,y_00\n1,2\n"
    yield "same-columns.csv", b"x,x,y,y\n1,2,3,4\n2,3,4,9\n7,7,7,7\n"
    yield "many-cells.csv", b"x,y\n" + b"12,34\n" * 650_000
    yield "many-rows-of-commas.csv", b",,,,,,,\n" * 400_000
    yield "many-faces.csv", b"x_0,y_0\n" + b"1,2\n" * 1_000_000
    yield "open-quote.csv", b'x,y\n"' + b"1,2\n" * 900_000
    yield "too-large.csv", b"x,y\n" + b"1,2\n" * 1_100_000
    yield "nul.csv", b"x,y\n1\0,2\n"
    yield "a-field-without-end.csv", b"x,y\n" + b"1" * 200_000 + b",2\n"
    yield "two-byte-order-marks.csv", b"\xef\xbb\xbf" * 2 + b"x,y\n1,1\n2,9\n7,3\n"
    yield "utf-16.csv", "x,y\n1,1\n2,9\n7,3\n".encode("utf-16")

    def ljson(marks: str, more: str = "") -> bytes:
        return f'{{"version": 3, "groups": {{"a": {{"landmarks": {{"points": {marks}}}{more}}}}}}}'.encode()

    for name, value in {
        "1e400": "1e400",
        "nan": "NaN",
        "minus-infinity": "-Infinity",
        "huge": "9" * 4000,
        "longer-than-allowed": "9" * 5000,
        "true": "true",
        "text": '"12"',
        "lone-surrogate": '"\\ud800"',
        "deep": "[" * 500 + "]" * 500,
    }.items():
        yield f"value-{name}.json", ljson(f"[[1, {value}], [2, 9], [7, 3]]")
        yield f"depth-{name}.json", ljson("[[1, 1], [2, 9], [7, 3]]", f', "depth": [1, {value}, 2]')
        yield f"confidence-{name}.json", ljson("[[1, 1], [2, 9], [7, 3]]", f', "confidence": {value}')
    yield "nested-lists.json", b"[" * 4_000_000
    yield "nested-lists-that-close.json", b"[" * 2_000_000 + b"]" * 2_000_000
    yield "nested-objects.json", b'{"a":' * 800_000
    yield "nested-points.json", ljson("[" * 900 + "]" * 900)
    yield "many-points.json", ljson("[" + "[1,1],[2,9],[7,3]," * 200_000 + "[0,0]]")
    yield (
        "many-groups.json",
        (
            '{"version": 3, "groups": {'
            + ",".join(f'"{i}": {{"landmarks": {{"points": []}}}}' for i in range(80_000))
            + "}}"
        ).encode(),
    )
    yield "a-long-name.json", ljson("[[1, null], 2]").replace(b'"a"', b'"' + b"a\\n" * 1_000_000 + b'"')
    yield "many-empty-lists.json", b"[" + b"[]," * 1_300_000 + b"[]]"
    mask = '{"label": "mouth", "mask": %s}'
    rows = "[" + ", ".join(f"[{i}, {i * i}]" for i in range(68)) + "]"
    for name, label in {"huge": "9" * 400, "negative": "-1", "float": "1.5", "nested": "[[]]"}.items():
        masks = mask % f"[{label}]"
        yield f"mask-{name}.json", ljson(rows, f', "labels": [{masks}]')
    yield "version-of-lists.json", b'{"version": [[[1]]], "groups": []}'
    yield "version-1.json", b'{"version": 1, "groups": [{"landmarks": [{"point": [1, 2]}, 5]}, 7, null]}'

    part = "<part name='%s' x='%s' y='1'/>"
    box = "<dataset><images><image file='a'><box>%s</box></image></images></dataset>"
    laughs = "".join(f"<!ENTITY l{i} '{f'&l{i - 1};' * 10}'>" for i in range(1, 10))
    yield "billion-laughs.xml", f"<!DOCTYPE d [<!ENTITY l0 'ha'>{laughs}]><dataset>&l9;</dataset>".encode()
    yield (
        "laughs-in-attributes.xml",
        (f"<!DOCTYPE d [<!ENTITY l0 'ha'>{laughs}<!ATTLIST dataset a CDATA '&l9;'>]><dataset/>").encode(),
    )
    for place in ("file:///etc/passwd", "http://127.0.0.1:9/x"):
        text = f'<!DOCTYPE d [<!ENTITY e SYSTEM "{place}">]><dataset>&e;</dataset>'
        yield f"external-{place[:4]}.xml", text.encode()
        yield f"external-subset-{place[:4]}.xml", f'<!DOCTYPE d SYSTEM "{place}"><dataset/>'.encode()
    yield "unknown-entity.xml", (box % part % ("&e;", 1)).encode()
    yield "nested.xml", b"<dataset>" + b"<a>" * 1_300_000
    yield "nested-that-closes.xml", b"<dataset>" + b"<a>" * 550_000 + b"</a>" * 550_000 + b"</dataset>"
    yield "images-in-images.xml", b"<dataset>" + b"<image>" * 250_000 + b"</image>" * 250_000 + b"</dataset>"
    yield (
        "boxes-in-boxes.xml",
        b"<dataset><image>" + b"<box>" * 350_000 + b"</box>" * 350_000 + b"</image></dataset>",
    )
    yield "many-elements.xml", b"<dataset>" + b"<a/>" * 1_000_000 + b"</dataset>"
    yield (
        "many-attributes.xml",
        ("<dataset " + " ".join(f"a{i}=''" for i in range(380_000)) + "/>").encode(),
    )
    yield "many-parts.xml", (box % "".join(part % (i, i) for i in range(90_000))).encode()
    yield (
        "many-small-boxes.xml",
        (box % "").replace("<box></box>", ("<box>" + part % (0, 1) + "</box>") * 80_000).encode(),
    )
    for value in ("1e999", "nan", "\uff19", "1_0", ""):
        parts = part % (0, value) + part % (1, 2) + part % (2, 3)
        yield f"value-{value or 'none'}.xml", (box % parts).encode()
    for encoding in (
        "utf-7",
        "zip",
        "hex",
        "idna",
        "unicode_escape",
        "undefined",
        "utf-16",
        "ebcdic-cp-be",
        "x" * 9999,
    ):
        yield (
            f"encoding-{encoding[:20]}.xml",
            f"<?xml version='1.0' encoding='{encoding}'?><dataset/>".encode(),
        )
