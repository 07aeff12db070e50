"""Small valid files by other libraries, and what can happen to them: the same cases for the same numbers."""

from __future__ import annotations

import functools
import io
import random
import struct
import zlib
from typing import TYPE_CHECKING, Any, NamedTuple

import imagecodecs
import numpy as np
import tifffile
from PIL import Image, PngImagePlugin

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator


class Case(NamedTuple):
    """A file to read: what it is called in a report, the extension it gets, and what is in it."""

    name: str
    extension: str
    data: bytes


def _pixels(channels: int = 3, dtype: Any = np.uint8) -> Any:
    values = np.random.default_rng(channels).random((20, 24, channels))
    values = (
        values.astype(dtype) if np.dtype(dtype).kind == "f" else (values * np.iinfo(dtype).max).astype(dtype)
    )
    return values[..., 0] if channels == 1 else values


def by_pillow(image: Any, name: str, **options: Any) -> bytes:
    """Return the file that Pillow writes."""
    file = io.BytesIO()
    (image if isinstance(image, Image.Image) else Image.fromarray(image)).save(file, name, **options)
    return file.getvalue()


def by_tifffile(samples: Any, **options: Any) -> bytes:
    """Return the TIFF that tifffile writes."""
    file = io.BytesIO()
    tifffile.imwrite(file, samples, metadata=None, **options)
    return file.getvalue()


def exif() -> bytes:
    """Return an EXIF block with directories in it, as Pillow writes it."""
    block = Image.Exif()
    block[0x010F], block[0x0112] = "Maker", 6
    block[0x8769] = {0x9003: "2020:01:02 03:04:05", 0x927C: b"private" * 9, 0xA005: {1: "R98"}}
    block[0x8825] = {1: "N", 2: (1.0, 2.0, 3.5)}
    return block.tobytes()


@functools.cache
def profile(space: str = "srgb") -> bytes:
    """Return an ICC profile of lcms."""
    return bytes(imagecodecs.cms_profile(space, **({"gamma": 1.8} if space == "gray" else {})))


#: A segment of a JPEG with IPTC and a URL, from Adobe's specification.
RESOURCES = (
    b"\xff\xed\0\x40Photoshop 3.0\0"
    b"8BIM\4\4\0\0\0\0\0\x10\x1c\2\x50\0\3Ann\x1c\2\x19\0\3sky8BIM\4\x0b\0\0\0\0\0\7a.host/\0"
)
XMP = b'<x:xmpmeta xmlns:x="adobe:ns:meta/"><a tiff:Orientation="6"/></x:xmpmeta>'


def photos() -> dict[str, bytes]:
    """Return a file of each format and variant."""
    grey, rgb, rgba = (_pixels(channels) for channels in (1, 3, 4))
    palette = Image.fromarray(rgb).quantize(16)
    notes = {"exif": exif(), "icc_profile": profile(), "dpi": (300, 300)}
    text = PngImagePlugin.PngInfo()
    text.add_itxt("XML:com.adobe.xmp", XMP.decode(), zip=True)
    text.add_text("Comment", "light " * 40, zip=True)
    text.add_text("Raw profile type iptc", f"\niptc\n 8\n{RESOURCES[30:38].hex()}\n")
    tiffs = {
        "deflate": by_tifffile(
            rgb, photometric="rgb", compression="zlib", predictor=True, iccprofile=profile()
        ),
        "lzw": by_tifffile(grey, photometric="minisblack", compression="lzw", rowsperstrip=3),
        "tiles": by_tifffile(rgba, photometric="rgb", tile=(16, 16), extrasamples=["unassalpha"]),
        "associated": by_tifffile(_pixels(4, np.uint16), photometric="rgb", extrasamples=["assocalpha"]),
        "float": by_tifffile(_pixels(3, np.float32), photometric="rgb", compression="zlib", predictor=3),
        "half": by_tifffile(_pixels(1, np.float16), photometric="minisblack"),
        "double": by_tifffile(_pixels(3, np.float64), photometric="rgb"),
        "planes": by_tifffile(np.moveaxis(rgb, -1, 0), photometric="rgb", planarconfig="separate"),
        "big": by_tifffile(_pixels(3, np.uint16), photometric="rgb", bigtiff=True, byteorder=">"),
        "motorola": by_tifffile(_pixels(1, np.uint16), photometric="miniswhite", byteorder=">"),
        "jpeg": by_tifffile(rgb, photometric="ycbcr", compression="jpeg", tile=(16, 16)),
        "packbits": by_tifffile(grey, photometric="minisblack", compression="packbits"),
        "palette": by_pillow(palette, "TIFF", compression="tiff_lzw"),
        "bits": by_pillow(Image.fromarray(grey > 99), "TIFF", compression="group4"),
        "pillow": by_pillow(rgb, "TIFF", **notes),
        "places": by_tifffile(
            rgb,
            photometric="rgb",
            extratags=[
                (33550, 12, 3, (1.0, 1.0, 0.0), True),
                (34735, 3, 8, (1, 1, 0, 1, 1024, 0, 1, 1), True),
                (33723, 7, 16, RESOURCES[30:46], True),
                (34377, 7, len(RESOURCES) - 18, RESOURCES[18:], True),
            ],
        ),
    }
    pngs = {
        "rgb": by_pillow(rgb, "PNG", pnginfo=text, **notes),
        "rgba": by_pillow(rgba, "PNG", **notes),
        "grey-alpha": by_pillow(Image.fromarray(rgba).convert("LA"), "PNG"),
        "palette": by_pillow(palette, "PNG", transparency=3),
        "bits": by_pillow(Image.fromarray(grey > 99), "PNG"),
        "16": bytes(imagecodecs.png_encode(_pixels(3, np.uint16))),
        "grey-16": by_pillow(_pixels(1, np.uint16), "PNG"),
        "interlaced": interlaced(grey),
    }
    jpegs = {
        "rgb": by_pillow(rgb, "JPEG", xmp=XMP, comment=b"light", extra=RESOURCES, **notes),
        "progressive": by_pillow(rgb, "JPEG", progressive=True, optimize=True),
        "grey": by_pillow(grey, "JPEG", icc_profile=profile("gray")),
        "restarts": by_pillow(rgb, "JPEG", restart_marker_blocks=2, subsampling=2),
        "cmyk": by_pillow(Image.fromarray(rgb).convert("CMYK"), "JPEG"),
    }
    webps = {
        "lossy": by_pillow(rgb, "WEBP", quality=80, xmp=XMP, exif=exif(), icc_profile=profile()),
        "lossless": by_pillow(rgb, "WEBP", lossless=True),
        "alpha": by_pillow(rgba, "WEBP", quality=80),
        "lossless-alpha": by_pillow(rgba, "WEBP", lossless=True, exact=True),
    }
    wide = _pixels(3, np.uint16)
    pnms = {
        "p1": b"P1\n# bits\n24 20\n" + b"\n".join(b" ".join(b"%d" % (v > 99) for v in row) for row in grey),
        "p2": b"P2 24 20 255\n" + b"\n".join(b" ".join(b"%d" % v for v in row) for row in grey),
        "p3": b"P3\n24 20\n1023\n" + b" ".join(b"%d" % (v >> 6) for v in wide.ravel()),
        "p4": by_pillow(Image.fromarray(grey > 99), "PPM"),
        "p5": by_pillow(grey, "PPM"),
        "p6": by_pillow(rgb, "PPM"),
        "p6-16": b"P6 24 20 65535\n" + wide.astype(">u2").tobytes(),
        "p5-10": b"P5\n24 20\n# ten bits\n1023\n" + (wide[..., 0] >> 6).astype(">u2").tobytes(),
    }
    bmps = {
        "rgb": by_pillow(rgb, "BMP", dpi=(300, 300)),
        "grey": by_pillow(grey, "BMP"),
        "bits": by_pillow(Image.fromarray(grey > 99), "BMP"),
        "palette": by_pillow(palette, "BMP"),
        "run-lengths": run_length_bmp(),
    }
    formats = {"tif": tiffs, "png": pngs, "jpg": jpegs, "webp": webps, "ppm": pnms, "bmp": bmps}
    return {
        f"{name}.{extension}": data for extension, files in formats.items() for name, data in files.items()
    }


def landmark_files() -> dict[str, bytes]:
    """Return a file of each landmark format and variant."""
    rows = np.random.default_rng(0).uniform(1, 99, (6, 2)).round(2).tolist()
    mesh = np.random.default_rng(1).uniform(1, 99, (68, 2)).round(2).tolist()
    marks = ", ".join(f"[{y}, {x}]" for x, y in mesh)
    numbered = [f"{axis}_{i}" for axis in "xy" for i in range(6)]
    values = ", ".join(str(row[axis]) for axis in (0, 1) for row in rows)
    parts = "".join(f"<part name='{i:02}' x='{x}' y='{y}'/>" for i, (x, y) in enumerate(rows))
    box = f"<box top='1' left='2' width='3' height='4'>{parts}</box>"
    labelled = ", ".join(f'{{"point": [{y}, {x}]}}' for x, y in rows)
    lines = "".join(f"{x} {y}\n" for x, y in rows)
    texts = {
        "plain.pts": f"version: 1\nn_points: 6\n{{\n{lines}}}\n",
        "plain.tem": f"6\n{lines}1\n0\n3\n0 1 2\n",
        "table.csv": "x,y\n" + "".join(f"{x},{y}\n" for x, y in rows),
        "bare.csv": "".join(f"{x},{y},1\n" for x, y in rows),
        "openface.csv": f"frame, confidence, success, {', '.join(numbered)}\n1, 0.9, 1, {values}\n",
        "version_1.json": f'{{"version": 1, "groups": [{{"label": "all", "landmarks": [{labelled}]}}]}}',
        "version_2.json": '{"version": 2, "labels": [{"label": "chin", "mask": [0, 1]}],'
        f'"landmarks": {{"points": [{marks}]}}}}',
        "version_3.ljson": f'{{"version": 3, "groups": {{"ibug68": {{"landmarks": {{"points": [{marks}]}},'
        f'"depth": {[0.5] * 68}, "confidence": 0.5}}}}}}',
        "dlib.xml": "<?xml version='1.0' encoding='UTF-8'?>\n<dataset><images>"
        f"<image file='a.jpg'>{box}</image></images></dataset>",
    }
    return {name: text.encode() for name, text in texts.items()}


def interlaced(grey: Any) -> bytes:
    """Return an Adam7 PNG, from the specification."""
    steps = [(0, 0, 8, 8), (0, 4, 8, 8), (4, 0, 8, 4), (0, 2, 4, 4), (2, 0, 4, 2), (0, 1, 2, 2), (1, 0, 2, 1)]
    raw = b"".join(b"\0" + row.tobytes() for y, x, dy, dx in steps for row in grey[y::dy, x::dx])
    header = struct.pack(">IIBBBBB", grey.shape[1], grey.shape[0], 8, 0, 0, 0, 1)
    return png((b"IHDR", header), (b"IDAT", zlib.compress(raw)), (b"IEND", b""))


def run_length_bmp() -> bytes:
    """Return a BMP of 24x20 palette pixels in run lengths, from the specification."""
    body = b"\x0a\x01\x0e\x02\0\0" * 19 + b"\0\x03\x01\x02\x03\0" + b"\x15\x01\0\0" + b"\0\1"
    palette = bytes(value for index in range(256) for value in (index, index, index, 0))
    header = struct.pack("<IiiHHIIiiII", 40, 24, 20, 1, 8, 1, len(body), 2835, 2835, 256, 0)
    start = 14 + len(header) + len(palette)
    return b"BM" + struct.pack("<IHHI", start + len(body), 0, 0, start) + header + palette + body


def png(*chunks: tuple[bytes, bytes]) -> bytes:
    """Return a PNG of these chunks, with checksums that are right."""
    return b"\x89PNG\r\n\x1a\n" + b"".join(
        struct.pack(">I", len(content)) + kind + content + struct.pack(">I", zlib.crc32(kind + content))
        for kind, content in chunks
    )


def png_chunks(data: bytes) -> list[tuple[bytes, bytes]]:
    """Return the chunks of a PNG that is whole."""
    chunks, start = [], 8
    while start < len(data):
        length, kind = struct.unpack_from(">I4s", data, start)
        chunks.append((kind, data[start + 8 : start + 8 + length]))
        start += 12 + length
    return chunks


# --- what can happen to a file


def _truncated(data: bytes, rng: random.Random, _other: bytes) -> bytes:
    return data[: rng.choice((rng.randrange(min(len(data), 64)), rng.randrange(len(data)), len(data) - 1))]


def _flipped(data: bytes, rng: random.Random, _other: bytes) -> bytes:
    damaged = bytearray(data)
    for _ in range(rng.choice((1, 1, 2, 4, 16))):
        damaged[_place(data, rng)] ^= 1 << rng.randrange(8)
    return bytes(damaged)


def _blanked(data: bytes, rng: random.Random, _other: bytes) -> bytes:
    start, length = _place(data, rng), rng.choice((1, 2, 4, 8, 64))
    run = rng.choice((b"\0", b"\xff")) * length
    return data[:start] + run[: len(data) - start] + data[start + length :]


def _counted(data: bytes, rng: random.Random, _other: bytes) -> bytes:
    """Replace an integer by one that is likely to be missed in a check."""
    order, (kind, bits) = rng.choice("<>"), rng.choice((("H", 16), ("I", 32), ("I", 32), ("Q", 64)))
    value = rng.choice((0, 1, 2, 255, 2**15, 2**31 - 1, 2**31, 2**32 - 1, 2**63 - 1, 2**64 - 1)) % 2**bits
    start = _place(data, rng)
    return data[:start] + struct.pack(order + kind, value) + data[start + bits // 8 :]


def _repeated(data: bytes, rng: random.Random, _other: bytes) -> bytes:
    start = _place(data, rng)
    piece = data[start : start + rng.choice((1, 4, 12, 64, 512))]
    return data[:start] + piece * rng.choice((2, 3, 50)) + data[start + len(piece) :]


def _shortened(data: bytes, rng: random.Random, _other: bytes) -> bytes:
    start = _place(data, rng)
    return data[:start] + data[start + rng.choice((1, 2, 4, 12, 64, 512)) :]


def _spliced(data: bytes, rng: random.Random, other: bytes) -> bytes:
    start, size = rng.randrange(len(other)), rng.choice((4, 32, 256, 4096))
    place = _place(data, rng)
    return data[:place] + other[start : start + size] + data[place + rng.choice((0, size)) :]


def _worded(data: bytes, rng: random.Random, _other: bytes) -> bytes:
    """Replace a number or a word of a text."""
    words = [
        b"0",
        b"-1",
        b"1e999",
        b"nan",
        b"-inf",
        b"9" * 400,
        b"1e-400",
        b"null",
        b"true",
        b"{}",
        b"[]",
        b'""',
    ]
    words += [
        b"\0",
        b"\r",
        b"\x85",
        b"\xe2\x80\xa8",
        b"\xff\xfe",
        "٣".encode(),
        b"1_0",
        b"0x1p3",
        b"#",
        b"//",
        b"'",
    ]
    damaged, start = bytearray(data), _place(data, rng)
    end = start + next((i for i, c in enumerate(data[start:]) if c in b" \t\n,:[]{}<>\"'"), 1)
    damaged[start : max(end, start + rng.randrange(2))] = rng.choice(words)
    return bytes(damaged)


def _rechunked(data: bytes, rng: random.Random, other: bytes) -> bytes:
    """Damage a chunk of a PNG and give it a right checksum, which random damage would hardly hit."""
    if not data.startswith(b"\x89PNG"):
        return _counted(data, rng, other)
    chunks = png_chunks(data)
    at = rng.randrange(len(chunks))
    kind, content = chunks[at]
    match rng.randrange(6):
        case 0:
            chunks.insert(rng.randrange(len(chunks) + 1), chunks[at])
        case 1:
            del chunks[at]
        case 2:
            chunks.insert(rng.randrange(len(chunks)), chunks.pop(at))
        case 3:
            names = (
                b"acTL",
                b"fcTL",
                b"fdAT",
                b"tRNS",
                b"PLTE",
                b"iCCP",
                b"eXIf",
                b"iTXt",
                b"zTXt",
                b"gAMA",
                b"IDAT",
            )
            chunks[at] = rng.choice(names), content
        case _ if content:
            damage = rng.choice((_flipped, _truncated, _counted, _repeated))
            if kind == b"IDAT" and rng.randrange(2):
                content = zlib.compress(damage(zlib.decompress(content), rng, other))
            else:
                content = damage(content, rng, other)
            chunks[at] = kind, content
    return png(*chunks)


def _place(data: bytes, rng: random.Random) -> int:
    """Return where to do damage: anywhere, but more often where headers and directories stand."""
    near = rng.randrange(min(len(data), 400))
    return rng.choice((rng.randrange(len(data)), near, len(data) - 1 - near, near // 8))


MUTATIONS: tuple[Callable[[bytes, random.Random, bytes], bytes], ...] = (
    _truncated,
    _flipped,
    _blanked,
    _counted,
    _repeated,
    _shortened,
    _spliced,
    _rechunked,
)
TEXT_MUTATIONS = (*(m for m in MUTATIONS if m is not _rechunked), _worded, _worded, _worded)


def mutants(numbers: Iterable[int]) -> Iterator[Case]:
    """Yield damaged files: the valid ones in turn, each case from its own number and nothing else."""
    files = photos() | landmark_files()
    names = sorted(files)
    texts = landmark_files().keys()
    for number in numbers:
        rng = random.Random(number)
        name = names[number % len(names)]
        data, done = files[name], []
        for _ in range(rng.choice((1, 1, 2, 3))):
            mutation = rng.choice(TEXT_MUTATIONS if name in texts else MUTATIONS)
            if mutation is _rechunked and done:  # only a PNG that is whole has chunks
                mutation = _counted
            if data:
                data = mutation(data, rng, files[rng.choice(names)])
                done.append(mutation.__name__)
        stem, _, extension = name.rpartition(".")
        yield Case(f"{number}-{stem}{''.join(done)}.{extension}", f".{extension}", data)
