"""Photos for the tests, made by other libraries or by hand, and what others find in ours."""

from __future__ import annotations

import io
import struct
import zlib

import numpy as np
import tifffile
from PIL import Image

from relit.photo.reading import read_image
from relit.photo.writing import write_image

DEPTHS = [np.uint8, np.uint16, np.float32]
CHANNELS = [1, 2, 3, 4]
XMP = b'<x:xmpmeta xmlns:x="adobe:ns:meta/"><a tiff:Orientation="6"/></x:xmpmeta>'


def sample(dtype, height=11, width=7, channels=3, seed=0):
    """Random samples, all channels: no symmetry, so that nothing can be swapped or turned unnoticed."""
    values = np.random.default_rng(seed).random((height, width, channels))
    values = (
        values.astype(dtype) if np.dtype(dtype).kind == "f" else (values * np.iinfo(dtype).max).astype(dtype)
    )
    return values[..., 0] if channels == 1 else values


def split(samples):
    """Pixels and alpha of samples with 1 to 4 channels."""
    channels = 1 if samples.ndim == 2 else samples.shape[2]
    alpha = samples[..., -1] if channels in (2, 4) else None
    return {1: lambda: samples, 2: lambda: samples[..., 0]}.get(channels, lambda: samples[..., :3])(), alpha


def read(data, **options):
    return read_image(io.BytesIO(data), **options)


def written(photo, file_format, **options):
    file = io.BytesIO()
    write_image(file, photo, format=file_format, **options)
    return file.getvalue()


def saved(array, file_format, **options):
    """What Pillow writes."""
    file = io.BytesIO()
    (array if isinstance(array, Image.Image) else Image.fromarray(array)).save(file, file_format, **options)
    return file.getvalue()


def tiff(samples, **options):
    """What tifffile writes."""
    file = io.BytesIO()
    tifffile.imwrite(file, samples, metadata=None, **options)
    return file.getvalue()


def tiff_with(data, tags):
    """The TIFF with other values for some tags."""
    file = io.BytesIO(data)
    with tifffile.TiffFile(file, mode="r+") as opened:
        for tag, value in tags.items():
            opened.pages[0].tags[tag].overwrite(value)
    return file.getvalue()


def assert_photo(photo, samples):
    pixels, alpha = split(samples)
    assert photo.pixels.dtype == samples.dtype
    np.testing.assert_array_equal(photo.pixels, pixels)
    assert (photo.alpha is None) == (alpha is None)
    if alpha is not None:
        assert photo.alpha.dtype == samples.dtype
        np.testing.assert_array_equal(photo.alpha, alpha)


# PNG by hand, from the specification: what Pillow cannot write.


def chunk(kind, content):
    return struct.pack(">I", len(content)) + kind + content + struct.pack(">I", zlib.crc32(kind + content))


def png(samples, *, depth=None, colour=None, before=b"", after=b"", interlace=0):
    """A PNG of integer samples (H, W) or (H, W, C), packed to `depth` bits."""
    channels = 1 if samples.ndim == 2 else samples.shape[2]
    height, width = samples.shape[:2]
    depth = depth or 8 * samples.itemsize
    colour = {1: 0, 2: 4, 3: 2, 4: 6}[channels] if colour is None else colour

    def rows(part):
        if depth < 8:
            bits = np.unpackbits(part[..., None].astype(np.uint8), axis=-1)[..., 8 - depth :]
            packed = np.packbits(bits.reshape(len(part), -1), axis=1)
        else:
            packed = (
                part.reshape(len(part), -1).astype(f">u{depth // 8}").view(np.uint8).reshape(len(part), -1)
            )
        return b"".join(b"\0" + row.tobytes() for row in packed)

    passes = [samples]
    if interlace:  # Adam7: first row, first column, row step, column step
        steps = [
            (0, 0, 8, 8),
            (0, 4, 8, 8),
            (4, 0, 8, 4),
            (0, 2, 4, 4),
            (2, 0, 4, 2),
            (0, 1, 2, 2),
            (1, 0, 2, 1),
        ]
        passes = [samples[y::dy, x::dx] for y, x, dy, dx in steps]
    raw = b"".join(rows(part) for part in passes if part.size)
    header = struct.pack(">IIBBBBB", width, height, depth, colour, 0, 0, interlace)
    return (
        b"\x89PNG\r\n\x1a\n"
        + chunk(b"IHDR", header)
        + before
        + chunk(b"IDAT", zlib.compress(raw))
        + after
        + chunk(b"IEND", b"")
    )


# ICC profiles by hand: three primaries (or none, for grey), and a pure power curve.

BRADFORD = np.array([[0.8951, 0.2664, -0.1614], [-0.7502, 1.7135, 0.0367], [0.0389, -0.0685, 1.0296]])
D50 = np.array([0.9642, 1.0, 0.8249])


def to_xyz(*primaries, white=(0.3127, 0.3290)):
    """The matrix from linear RGB with these (x, y) primaries and white, by default D65, to XYZ at D50."""
    columns = np.array([[x / y, 1, (1 - x - y) / y] for x, y in (*primaries, white)]).T
    white, columns = columns[:, 3], columns[:, :3]
    matrix = columns * np.linalg.solve(columns, white)
    return np.linalg.inv(BRADFORD) @ np.diag((BRADFORD @ D50) / (BRADFORD @ white)) @ BRADFORD @ matrix


P3_TO_XYZ = to_xyz((0.680, 0.320), (0.265, 0.690), (0.150, 0.060))
SRGB_TO_XYZ = to_xyz((0.64, 0.33), (0.30, 0.60), (0.15, 0.06))


def icc(matrix=None, gamma=2.2):
    def fixed(values):
        return struct.pack(f">{len(values)}i", *(round(value * 65536) for value in values))

    curve = b"curv" + bytes(4) + struct.pack(">IH", 1, round(gamma * 256)) + bytes(2)
    tags = {b"wtpt": b"XYZ " + bytes(4) + fixed([0.9505, 1, 1.0891])}
    if matrix is None:
        tags[b"kTRC"] = curve
    else:
        for name, column in zip(b"rgb", matrix.T, strict=True):
            tags[bytes([name]) + b"XYZ"] = b"XYZ " + bytes(4) + fixed(column)
            tags[bytes([name]) + b"TRC"] = curve
    tags[b"desc"] = b"desc" + bytes(4) + struct.pack(">I", 5) + b"test\0" + bytes(78) + b"\0"
    tags[b"cprt"] = b"text" + bytes(4) + b"none\0\0\0\0"
    start = 128 + 4 + 12 * len(tags)
    table, body = struct.pack(">I", len(tags)), b""
    for name, content in tags.items():
        table += struct.pack(">4sII", name, start + len(body), len(content))
        body += content
    space = b"GRAY" if matrix is None else b"RGB "
    header = struct.pack(
        ">I4sI4s4s4s12x4s", start + len(body), b"test", 0x02400000, b"mntr", space, b"XYZ ", b"acsp"
    )
    return header.ljust(68, b"\0") + fixed(D50) + bytes(48) + table + body


P3 = icc(P3_TO_XYZ)
ADOBE_RGB = icc(to_xyz((0.64, 0.33), (0.21, 0.71), (0.15, 0.06)), gamma=563 / 256)
PROPHOTO = icc(
    to_xyz((0.7347, 0.2653), (0.1596, 0.8404), (0.0366, 0.0001), white=(0.3457, 0.3585)), gamma=1.8
)
GREY_18 = icc(gamma=1.8)


def srgb_curve(linear):
    return np.where(
        linear <= 0.0031308, 12.92 * linear, 1.055 * np.maximum(linear, 1e-9) ** (1 / 2.4) - 0.055
    )


# EXIF by hand: IFD0 with an orientation, and a thumbnail's IFD1.


def exif_block(orientation=1, order="<", kind=3):
    make = struct.pack(order + "HHI4s", 0x010F, 2, 4, b"Abc\0")
    value = struct.pack(order + ("H2x" if kind == 3 else "I"), orientation)
    entries = make + struct.pack(order + "HHI", 0x0112, kind, 1) + value
    thumbnail = struct.pack(order + "HHHIHxxI", 1, 0x0103, 3, 1, 6, 0)
    head = b"II*\0" if order == "<" else b"MM\0*"
    first = struct.pack(order + "IH", 8, 2) + entries
    return head + first + struct.pack(order + "I", 8 + 2 + 24 + 4) + thumbnail


def full_exif():
    exif = Image.Exif()
    exif[0x010F], exif[0x013B] = "Maker", "Jos\xe9".encode()
    exif[0x0112] = 1
    exif[0x8769] = {
        0x9003: "2020:01:02 03:04:05",
        0x829A: 1 / 250,
        0x927C: b"private" * 9,
        0xA005: {1: "R98"},
    }
    exif[0x8825] = {1: "N", 2: (1.0, 2.0, 3.5)}
    return exif.tobytes().removeprefix(b"Exif\0\0")


def pillow_exif(data):
    """What Pillow finds in a written file: camera, artist, orientation, date, note, latitude, interop."""
    with Image.open(io.BytesIO(data)) as opened:
        exif = opened.getexif()
        shot, place = exif.get_ifd(0x8769), exif.get_ifd(0x8825)
        interop = exif.get_ifd(0xA005)
        return exif[0x010F], exif[0x013B], exif[0x0112], shot[0x9003], shot[0x927C], place[2], interop[1]
