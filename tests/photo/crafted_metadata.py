"""Photos whose metadata is made to harm: EXIF in circles, profiles with wild numbers."""

from __future__ import annotations

import struct
import zlib
from typing import TYPE_CHECKING

import numpy as np
from hostile_corpus import by_pillow, by_tifffile, exif, photos, png, png_chunks, profile
from PIL import Image, ImageCms

if TYPE_CHECKING:
    from collections.abc import Iterator


def metadata() -> Iterator[tuple[str, bytes]]:
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
