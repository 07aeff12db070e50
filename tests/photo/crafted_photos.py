"""PNG, JPEG, WebP, PNM and BMP files made to harm: decompression bombs and wild claims."""

from __future__ import annotations

import functools
import struct
import zlib
from typing import TYPE_CHECKING

import imagecodecs
import numpy as np
from hostile_corpus import by_pillow, photos, png
from PIL import Image

if TYPE_CHECKING:
    from collections.abc import Iterator


HUGE = 195_000_000  # px, within what is allowed
WIDE, HIGH = 15_000, 13_000


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


def pngs() -> Iterator[tuple[str, bytes]]:
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
    yield "claims-much-and-has-little.png", png(header(WIDE, HIGH), pixel, end)
    yield "claims-a-long-row.png", png(header(HUGE, 1, 16, 6), pixel, end)
    rows = deflated(HIGH * (1 + 8 * WIDE))
    yield "blank-16-bit-rgba.png", png(header(WIDE, HIGH, 16, 6), (b"IDAT", rows), end)
    rows = deflated(HIGH * (1 + 3 * WIDE))
    yield "blank-rgb.png", png(header(WIDE, HIGH), (b"IDAT", rows), end)
    rows = deflated(HIGH * (1 + WIDE))
    palette = (b"PLTE", bytes(768)), (b"tRNS", bytes(256))
    yield "blank-palette.png", png(header(WIDE, HIGH, 8, 3), *palette, (b"IDAT", rows), end)
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


def jpegs() -> Iterator[tuple[str, bytes]]:
    yield "start-only.jpg", b"\xff\xd8\xff"
    blank = blank_jpeg()
    yield "blank.jpg", blank
    colour = by_pillow(Image.new("RGB", (WIDE, HIGH)), "JPEG", quality=10)
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
def blank_jpeg() -> bytes:
    return by_pillow(Image.new("L", (WIDE, HIGH)), "JPEG")


@functools.cache
def blank_webp() -> bytes:
    return bytes(imagecodecs.webp_encode(np.zeros((HIGH, WIDE, 4), np.uint8), lossless=True, level=0))


def webps() -> Iterator[tuple[str, bytes]]:
    yield "start-only.webp", b"RIFF\x04\0\0\0WEBP"
    yield "no-picture.webp", b"RIFF\x0c\0\0\0WEBPVP8 \0\0\0\0"
    yield "blank.webp", by_pillow(Image.new("RGB", (6000, 6000)), "WEBP", quality=1, method=0)
    yield "blank-lossless.webp", blank_webp()
    data = photos()["alpha.webp"]
    at = data.index(b"VP8X") + 12
    for size in (1, 2**24):
        canvas = (size - 1).to_bytes(3, "little") * 2
        yield f"canvas-of-{size}.webp", data[:at] + canvas + data[at + 6 :]
    lossless = photos()["lossless.webp"]
    yield "claims-16384x16384.webp", lossless[:21] + b"\xff\xff\xff\x0f" + lossless[25:]
    for size in (0, 2**32 - 1):
        yield f"length-{size}.webp", lossless[:4] + struct.pack("<I", size) + lossless[8:]


def pnms() -> Iterator[tuple[str, bytes]]:
    yield "comments-without-end.ppm", b"P5 " + b"#\r" * 3000 + b"x"
    yield "comments-in-comments.ppm", b"P6\n" + b"# #\r\n" * 3000 + b"1 1 255\n"
    yield "blanks-without-end.ppm", b"P6" + b" " * 4_000_000
    yield "digits-without-end.ppm", b"P6 " + b"1" * 4_000_000
    for kind in range(1, 7):
        for size in (b"0 0", b"1000000000 1", b"-1 5", b"4294967297 1", b"1e3 5", b"%d %d" % (WIDE, HIGH)):
            yield f"p{kind}-{size.decode().replace(' ', 'x')}.ppm", b"P%d %s 255\n\1\2\3" % (kind, size)
        for largest in (b"0", b"65536", b"-1", b"9" * 5000, b""):
            yield f"p{kind}-largest-{largest[:9].decode()}.ppm", b"P%d 1 1 %s\n\1\2\3\4\5\6" % (kind, largest)
    yield "blank-bits.ppm", b"P4 %d %d\n" % (WIDE, HIGH) + bytes(WIDE // 8 * HIGH)
    yield "blank-of-100.ppm", b"P5 %d %d 100\n" % (WIDE, HIGH) + bytes(WIDE * HIGH)
    yield "plain-of-40-megabytes.ppm", b"P2 4000 5000 9\n" + b"1 " * 20_000_000
    yield "plain-bits-of-40-megabytes.ppm", b"P1 8000 5000\n" + b"1" * 40_000_000
    yield "plain-without-blanks.ppm", b"P3 2 1 255\n" + b"1" * 1_000_000
    yield "plain-words.ppm", b"P3 1 1 255\none two three"
    yield "plain-negative.ppm", b"P2 2 1 255\n-1 2"
    yield "plain-above-the-largest.ppm", b"P2 2 1 9\n99999999999999999999 2"
    yield "plain-of-comments.ppm", b"P2 1 1 255\n" + b"#\n" * 1_000_000 + b"7"
    yield "many-pictures.ppm", b"P5 1 1 255\n" + bytes(10_000_000)


def bmps() -> Iterator[tuple[str, bytes]]:
    yield "start-only.bmp", b"BM"
    data = photos()["rgb.bmp"]
    for width, height in ((0, 0), (2**31 - 1, 1), (1, -(2**31)), (-1, -1), (WIDE, HIGH), (HUGE, 1)):
        yield f"claims-{width}x{height}.bmp", data[:18] + struct.pack("<ii", width, height) + data[26:]
    packed = photos()["run-lengths.bmp"]
    start = int.from_bytes(packed[10:14], "little")

    def runs(width: int, height: int, body: bytes, kind: int = 1) -> bytes:
        size = struct.pack("<iiHHI", width, height, 1, 8 if kind == 1 else 4, kind)
        return packed[:18] + size + packed[34:start] + body

    yield "rows-filled-byte-by-byte.bmp", runs(HUGE // 2, 2, b"\1\1\0\0" * 2)
    yield "runs-of-nibbles.bmp", runs(WIDE, HIGH, (b"\xff\x12" * 58 + b"\xd2\x12\0\0") * HIGH, 2)
    yield "runs-beyond-the-row.bmp", runs(1, 2, b"\xff\x12" * 2_000_000)
    yield "steps.bmp", runs(WIDE, HIGH, b"\0\2\xff\xff" * 1000)
    for offset in (0, 2**32 - 1):
        yield f"pixels-at-{offset}.bmp", data[:10] + struct.pack("<I", offset) + data[14:]


def others() -> Iterator[tuple[str, bytes]]:
    files = photos()
    for name in ("rgb.jpg", "rgb.png", "pillow.tif", "rgb.bmp"):
        for other in ("rgb.jpg", "rgb.png", "pillow.tif", "lossy.webp"):
            yield f"{name}-before-{other}", files[name] + files[other]
    yield "archive-behind.png", files["rgb.png"] + b"PK\x05\x06" + bytes(18)
    yield "script.bmp", b"BM=1/*" + bytes(60) + b"*/;alert(1)"
    yield "text.jpg", b"no photo at all\n" * 99
    yield "zeros.png", bytes(100_000)
    yield "html.jpg", b"<!DOCTYPE html><html><body>404</body></html>"
