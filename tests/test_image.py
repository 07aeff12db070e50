"""Photos in and out: read what others wrote, have others read what we wrote, and refuse the rest clearly."""

from __future__ import annotations

import io
import os
import struct
import subprocess
import sys
import threading
import time
import warnings
import zlib
from dataclasses import replace
from pathlib import Path

import imagecodecs
import numpy as np
import pytest
import tifffile
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from PIL import ExifTags, Image, ImageOps, JpegImagePlugin

from relit import image
from relit._photo import codecs
from relit._photo.pillow import quiet_pillow
from relit.errors import ImageError, OutputError
from relit.image import Metadata, Photo, check_destination, read_image, write_image

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


def to_xyz(*primaries):
    """The matrix from linear RGB with these (x, y) primaries and a D65 white to XYZ, adapted to D50."""
    columns = np.array([[x / y, 1, (1 - x - y) / y] for x, y in (*primaries, (0.3127, 0.3290))]).T
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


class TestReading:
    """Files that other libraries, or nobody but the specification, wrote."""

    @pytest.mark.parametrize("channels", [1, 3])
    def test_jpeg(self, channels):
        data = imagecodecs.jpeg8_encode(sample(np.uint8, channels=channels), level=90)
        photo = read(data)
        assert_photo(photo, imagecodecs.jpeg8_decode(data))
        assert photo.format == "JPEG"

    @pytest.mark.parametrize("channels", CHANNELS)
    @pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
    @pytest.mark.parametrize("interlace", [0, 1])
    def test_png(self, dtype, channels, interlace):
        samples = sample(dtype, channels=channels)
        photo = read(png(samples, interlace=interlace))
        assert_photo(photo, samples)
        assert photo.format == "PNG"

    @pytest.mark.parametrize("depth", [1, 2, 4])
    def test_png_of_few_bits(self, depth):
        samples = sample(np.uint8)[..., 0] >> (8 - depth)
        assert_photo(read(png(samples, depth=depth)), samples * np.uint8(255 // (2**depth - 1)))

    @pytest.mark.parametrize("depth", [1, 2, 4, 8])
    @pytest.mark.parametrize("transparent", [False, True])
    def test_png_palette(self, depth, transparent):
        index = sample(np.uint8)[..., 0] >> (8 - depth)
        palette = sample(np.uint8, 2**depth, 1, 4, seed=1)[:, 0]
        before = chunk(b"PLTE", palette[:, :3].tobytes())
        if transparent:
            before += chunk(b"tRNS", palette[:, 3].tobytes())
        photo = read(png(index, depth=depth, colour=3, before=before))
        assert_photo(photo, palette[index][..., : 4 if transparent else 3])

    @pytest.mark.parametrize(
        ("depth", "dtype"), [(1, np.uint8), (2, np.uint8), (8, np.uint8), (16, np.uint16)]
    )
    def test_png_transparent_grey_becomes_alpha(self, depth, dtype):
        full = np.iinfo(dtype).max
        scale = dtype(full // (2**depth - 1))
        samples = sample(dtype)[..., 0] >> (8 * np.dtype(dtype).itemsize - depth)
        before = chunk(b"tRNS", struct.pack(">H", samples[0, 0]))
        alpha = np.where(samples == samples[0, 0], 0, full).astype(dtype)
        assert_photo(read(png(samples, depth=depth, before=before)), np.dstack([samples * scale, alpha]))

    @pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
    def test_png_transparent_colour_becomes_alpha(self, dtype):
        samples = sample(dtype)
        before = chunk(b"tRNS", struct.pack(">3H", *samples[0, 0]))
        alpha = np.full(samples.shape[:2], np.iinfo(dtype).max, dtype)
        alpha[0, 0] = 0
        assert_photo(read(png(samples, before=before)), np.dstack([samples, alpha]))

    @pytest.mark.parametrize("channels", CHANNELS)
    @pytest.mark.parametrize("dtype", DEPTHS)
    @pytest.mark.parametrize(
        "options",
        [
            {},
            {"compression": "zlib", "predictor": True},
            {"compression": "lzw", "predictor": True},
            {"compression": "zstd", "rowsperstrip": 3},
            {"compression": "lzma", "tile": (16, 16)},
            {"planarconfig": "separate"},
            {"planarconfig": "separate", "compression": "zlib"},
            {"byteorder": ">"},
            {"bigtiff": True},
        ],
        ids=str,
    )
    def test_tiff(self, dtype, channels, options):
        samples = sample(dtype, channels=channels)
        options = dict(options)
        stored = samples
        if channels == 1:
            options.pop("planarconfig", None)
        elif "planarconfig" in options:
            stored = np.ascontiguousarray(np.moveaxis(samples, -1, 0))
        if channels in (2, 4):
            options["extrasamples"] = ["unassalpha"]
        data = tiff(stored, photometric="rgb" if channels >= 3 else "minisblack", **options)
        photo = read(data)
        assert_photo(photo, samples)
        assert photo.format == "TIFF"

    @pytest.mark.parametrize("dtype", DEPTHS)
    def test_tiff_with_associated_alpha_is_divided(self, dtype):
        full = 1 if dtype is np.float32 else np.iinfo(dtype).max
        samples = sample(dtype, channels=4)
        samples[0, 0, 3] = 0
        alpha = samples[..., 3:] / full
        stored = samples.copy()
        stored[..., :3] = samples[..., :3] * alpha if full == 1 else np.rint(samples[..., :3] * alpha)
        photo = read(tiff(stored, photometric="rgb", extrasamples=["assocalpha"]))
        np.testing.assert_array_equal(photo.alpha, samples[..., 3])
        opaque = samples[..., 3] > 0.2 * full
        error = (photo.pixels / full - samples[..., :3] / full)[opaque]
        assert np.abs(error).max() < (1e-6 if full == 1 else 3 / full)
        assert (photo.pixels[0, 0] == 0).all()

    def test_tiff_of_one_bit_both_ways_round(self):
        ink = sample(np.uint8)[..., 0] > 127
        for photometric, white in (("minisblack", ink), ("miniswhite", ~ink)):
            assert_photo(read(tiff(ink, photometric=photometric)), white * np.uint8(255))

    def test_tiff_white_at_zero(self):
        for dtype in (np.uint8, np.uint16):
            samples = sample(dtype, channels=1)
            assert_photo(read(tiff(samples, photometric="miniswhite")), np.iinfo(dtype).max - samples)

    def test_tiff_of_twelve_bits_is_spread_over_sixteen(self):
        packed = bytes.fromhex("000001800fff")  # 0, 1, 2048, 4095
        data = tiff(np.frombuffer(packed, np.uint8)[None], photometric="minisblack")
        data = tiff_with(data, {256: 4, 258: 12})
        np.testing.assert_array_equal(read(data).pixels, [[0, 16, 32776, 65535]])

    def test_tiff_palette(self):
        index = sample(np.uint8, channels=1)
        colours = sample(np.uint8, 256, 1, 3, seed=1)[:, 0]
        data = tiff(index, photometric="palette", colormap=colours.T.astype(np.uint16) * 257)
        assert_photo(read(data), colours[index])

    def test_tiff_jpeg(self):
        smooth = np.add.outer(np.arange(32), np.arange(48))[..., None] * np.array([1, 2, 3])
        data = tiff(
            smooth.astype(np.uint8),
            photometric="ycbcr",
            compression="jpeg",
            compressionargs={"level": 95, "outcolorspace": "ycbcr"},
            subsampling=(1, 1),
        )
        with Image.open(io.BytesIO(data)) as opened:
            assert opened.tag_v2[262] == 6  # YCbCr
            expected = np.asarray(opened.convert("RGB")).astype(int)
        assert np.abs(read(data).pixels - expected).max() <= 2

    @pytest.mark.parametrize("dtype", [np.float16, np.float64])
    def test_tiff_of_other_floats_becomes_float32(self, dtype):
        samples = sample(dtype)
        photo = read(tiff(samples, photometric="rgb"))
        assert photo.pixels.dtype == np.float32
        np.testing.assert_array_equal(photo.pixels, samples.astype(np.float32))

    def test_tiff_with_a_preview_behind_the_photo(self):
        samples = sample(np.uint8)
        file = io.BytesIO()
        with tifffile.TiffWriter(file) as writer:
            writer.write(samples, photometric="rgb", metadata=None)
            writer.write(samples[::2, ::2], photometric="rgb", subfiletype=1, metadata=None)
        assert_photo(read(file.getvalue()), samples)

    @pytest.mark.parametrize("channels", [3, 4])
    def test_webp(self, channels):
        samples = sample(np.uint8, channels=channels)
        photo = read(imagecodecs.webp_encode(samples, lossless=True))
        opaque = samples if channels == 3 else samples[..., 3] > 0  # colours under transparency are free
        np.testing.assert_array_equal(photo.pixels[opaque > 0], samples[..., :3][opaque > 0])
        assert photo.format == "WEBP"
        if channels == 4:
            np.testing.assert_array_equal(photo.alpha, samples[..., 3])

    @pytest.mark.parametrize("channels", [1, 3])
    @pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
    def test_binary_pnm(self, dtype, channels):
        samples = sample(dtype, channels=channels)
        header = f"P{5 if channels == 1 else 6}\n# made by hand\n7 11\n{np.iinfo(dtype).max}\n".encode()
        photo = read(header + samples.astype(samples.dtype.newbyteorder(">")).tobytes())
        assert_photo(photo, samples)
        assert photo.format == ("PGM" if channels == 1 else "PPM")

    def test_plain_pnm(self):
        assert_photo(read(b"P2 2 2 255\n0 1\n# half\n254 255\n"), np.array([[0, 1], [254, 255]], np.uint8))
        assert_photo(read(b"P3 1 1 65535 1 2 65535"), np.array([[[1, 2, 65535]]], np.uint16))
        assert_photo(read(b"P1 3 1\n1 0 1\n"), np.array([[0, 255, 0]], np.uint8))
        assert_photo(read(b"P4 9 1\n\x80\x80"), np.array([[0] + [255] * 7 + [0]], np.uint8))

    @pytest.mark.parametrize("maximum", [1, 100, 254, 256, 1023, 65534])
    def test_pnm_of_any_maximum_is_spread_over_the_range(self, maximum):
        values = np.linspace(0, maximum, 9).astype(int)
        full = 255 if maximum < 256 else 65535
        photo = read(b"P2 9 1 %d\n" % maximum + b" ".join(b"%d" % value for value in values))
        assert photo.pixels.dtype == (np.uint8 if maximum < 256 else np.uint16)
        np.testing.assert_array_equal(photo.pixels[0], np.floor(values * full / maximum + 0.5))

    def test_pnm_beyond_its_own_maximum_is_white(self):
        assert_photo(read(b"P2 3 1 100\n50 100 200"), np.array([[128, 255, 255]], np.uint8))

    def test_of_several_pnm_images_the_first(self):
        assert_photo(read(b"P5 1 1 255\n\x07" + b"\x08"), np.array([[7]], np.uint8))

    @pytest.mark.parametrize("channels", [1, 3, 4])
    def test_bmp(self, channels):
        samples = sample(np.uint8, channels=channels)
        photo = read(imagecodecs.bmp_encode(samples))
        assert_photo(photo, samples)
        assert photo.format == "BMP"

    def test_bmp_of_one_bit_and_palette(self):
        ink = sample(np.uint8)[..., 0] > 127
        assert_photo(read(saved(ink, "BMP")), ink * np.uint8(255))
        palette = Image.fromarray(sample(np.uint8)).quantize(7)
        assert_photo(read(saved(palette, "BMP")), np.asarray(palette.convert("RGB")))

    def test_of_a_jpeg_with_pictures_behind_it_the_first(self):
        first, second = (Image.fromarray(sample(np.uint8, 32, 32, seed=seed)) for seed in (0, 1))
        data = saved(first, "MPO", save_all=True, append_images=[second])
        with Image.open(io.BytesIO(data)) as opened:
            assert (opened.format, opened.n_frames) == ("MPO", 2)
            expected = np.asarray(opened)
        photo = read(data)
        assert_photo(photo, expected)
        assert photo.format == "JPEG"

    def test_the_name_does_not_decide(self, tmp_path):
        path = tmp_path / "photo.jpg"
        path.write_bytes(png(sample(np.uint8)))
        assert read_image(path).format == "PNG"
        assert_photo(read_image(str(path)), sample(np.uint8))

    def test_arrays_are_new_and_in_order(self):
        for data in (
            png(sample(np.uint16, channels=4)),
            saved(sample(np.uint8), "JPEG"),
            tiff(sample(np.uint8)),
        ):
            photo = read(data)
            assert photo.pixels.flags.writeable
            assert photo.pixels.flags.c_contiguous
            assert photo.pixels.dtype.isnative

    def test_a_stream_is_read_from_where_it_stands(self):
        file = io.BytesIO(b"header" + png(sample(np.uint8)))
        file.seek(6)
        assert_photo(read_image(file), sample(np.uint8))
        assert not file.closed

    @pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="needs named pipes")
    def test_a_pipe(self, tmp_path):
        path = tmp_path / "pipe"
        os.mkfifo(path)
        writer = threading.Thread(target=path.write_bytes, args=(tiff(sample(np.uint8)),))
        writer.start()
        assert_photo(read_image(path), sample(np.uint8))
        writer.join()


class TestWriting:
    """What we write, read by others."""

    @pytest.mark.parametrize("channels", CHANNELS)
    @pytest.mark.parametrize("dtype", DEPTHS)
    @pytest.mark.parametrize(
        "decoder", [tifffile.imread, lambda file: imagecodecs.tiff_decode(file.getvalue())]
    )
    def test_tiff(self, dtype, channels, decoder):
        samples = sample(dtype, 900, 300, channels)  # several strips
        data = written(Photo(*split(samples)), "TIFF")
        np.testing.assert_array_equal(decoder(io.BytesIO(data)), samples)
        with tifffile.TiffFile(io.BytesIO(data)) as file:
            page = file.pages[0]
            assert page.compression == tifffile.COMPRESSION.ADOBE_DEFLATE
            assert page.extrasamples == ((tifffile.EXTRASAMPLE.UNASSALPHA,) if channels in (2, 4) else ())
            assert len(page.dataoffsets) > 1

    @pytest.mark.parametrize("channels", CHANNELS)
    def test_tiff_of_8_bits_read_by_pillow(self, channels):
        samples = sample(np.uint8, channels=channels)
        with Image.open(io.BytesIO(written(Photo(*split(samples)), "TIFF"))) as opened:
            np.testing.assert_array_equal(np.asarray(opened), samples)

    @pytest.mark.parametrize("channels", CHANNELS)
    def test_png_of_8_bits(self, channels):
        samples = sample(np.uint8, channels=channels)
        with Image.open(io.BytesIO(written(Photo(*split(samples)), "PNG"))) as opened:
            np.testing.assert_array_equal(np.asarray(opened), samples)

    @pytest.mark.parametrize("channels", CHANNELS)
    def test_png_of_16_bits(self, channels):
        samples = sample(np.uint16, channels=channels)
        data = written(Photo(*split(samples), metadata=Metadata(full_exif(), XMP, (72, 72))), "PNG")
        np.testing.assert_array_equal(imagecodecs.png_decode(data), samples)
        assert data[24] == 16

    @pytest.mark.parametrize("channels", [1, 3])
    @pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
    def test_pnm(self, dtype, channels):
        samples = sample(dtype, channels=channels)
        data = written(samples, "PPM")
        assert data[:2] == (b"P5" if channels == 1 else b"P6")
        body = np.frombuffer(data[-samples.nbytes :], samples.dtype.newbyteorder(">"))
        np.testing.assert_array_equal(body.reshape(samples.shape), samples)
        with Image.open(io.BytesIO(data)) as opened:
            assert opened.size == (7, 11)
            assert (
                np.abs(
                    np.asarray(opened).astype(float) / np.asarray(opened).max() - samples / samples.max()
                ).max()
                < 0.01
            )

    @pytest.mark.parametrize("channels", [1, 3])
    def test_bmp(self, channels):
        samples = sample(np.uint8, channels=channels)
        np.testing.assert_array_equal(imagecodecs.bmp_decode(written(samples, "BMP")), samples)

    @pytest.mark.parametrize("channels", [1, 3])
    def test_jpeg(self, channels):
        samples = np.kron(
            sample(np.uint8, 4, 6, channels), np.ones((8, 8, 1)[: 2 + (channels > 1)], np.uint8)
        )
        data = written(samples, "JPEG")
        with Image.open(io.BytesIO(data)) as opened:
            assert opened.mode == ("L" if channels == 1 else "RGB")
            assert np.abs(np.asarray(opened).astype(int) - samples).max() <= 4
            if channels == 3:
                assert JpegImagePlugin.get_sampling(opened) == 0  # 4:4:4
            reference = saved(samples, "JPEG", quality=95)
            with Image.open(io.BytesIO(reference)) as other:
                assert opened.quantization == other.quantization

    @pytest.mark.parametrize("channels", CHANNELS)
    def test_webp(self, channels):
        smooth = (
            np.add.outer(np.arange(64.0), np.arange(48.0))[..., None] * np.array([0.5, 1, 1.5, 2])[:channels]
        )
        samples = smooth.astype(np.uint8) if channels > 1 else smooth[..., 0].astype(np.uint8)
        pixels, alpha = split(samples)
        with Image.open(io.BytesIO(written(Photo(pixels, alpha), "WEBP"))) as opened:
            decoded = np.asarray(opened)
        assert decoded.shape[2] == (3 if alpha is None else 4)
        colours = np.dstack([pixels] * 3) if pixels.ndim == 2 else pixels
        assert np.abs(decoded[..., :3].astype(int) - colours).mean() < 2
        if alpha is not None:
            np.testing.assert_array_equal(decoded[..., 3], alpha)

    def test_webp_keeps_the_colours_under_transparency(self):
        pixels = np.repeat(np.add.outer(np.arange(64), np.arange(64))[..., None], 3, axis=2).astype(np.uint8)
        data = written(Photo(pixels, np.zeros((64, 64), np.uint8)), "WEBP")
        with Image.open(io.BytesIO(data)) as opened:
            assert np.abs(np.asarray(opened)[..., :3].astype(int) - pixels).max() <= 4

    def test_16_bits_are_rounded_to_8(self):
        values = np.arange(65536, dtype=np.uint16).reshape(256, 256)
        pixels = imagecodecs.bmp_decode(written(values, "BMP"))
        np.testing.assert_array_equal(pixels, np.rint(values / 257))

    @pytest.mark.parametrize("dtype", [np.float32, np.float64])
    @pytest.mark.parametrize(("file_format", "full"), [("PNG", 65535), ("PPM", 65535), ("BMP", 255)])
    def test_floats_are_rounded(self, dtype, file_format, full):
        values = np.array([[0, 0.4 / full, 0.6 / full, 0.5, 1 - 0.4 / full, 1]], dtype)
        photo = read(written(values, file_format))
        assert photo.pixels.dtype == (np.uint16 if full == 65535 else np.uint8)
        np.testing.assert_array_equal(photo.pixels, [[0, 0, 1, round(full / 2), full, full]])

    def test_alpha_comes_to_the_depth_of_the_pixels(self):
        alpha = np.array([[0, 1, 255]], np.uint8)
        photo = read(written(Photo(np.zeros((1, 3), np.uint16), alpha), "PNG"))
        np.testing.assert_array_equal(photo.alpha, [[0, 257, 65535]])
        photo = read(written(Photo(np.zeros((1, 3)), alpha), "TIFF"))
        np.testing.assert_allclose(photo.alpha, alpha / 255, rtol=1e-6)

    def test_the_array_is_left_alone(self):
        pixels = sample(np.uint16)
        before = pixels.copy()
        for file_format in ("TIFF", "PNG", "JPEG", "PPM"):
            written(pixels, file_format)
        np.testing.assert_array_equal(pixels, before)


@given(
    channels=st.sampled_from(CHANNELS),
    file_format=st.sampled_from(["PNG", "TIFF", "PPM", "BMP"]),
    dtype=st.sampled_from(DEPTHS),
    data=st.data(),
)
@settings(deadline=None, max_examples=150)
def test_lossless_formats_give_back_every_bit(channels, file_format, dtype, data):
    known = codecs.FORMATS[file_format]
    if np.dtype(dtype).itemsize > np.dtype(known.deepest).itemsize:
        dtype = known.deepest
    shape = data.draw(
        st.tuples(st.integers(1, 9), st.integers(1, 9), st.just(channels if known.alpha else 3))
    )
    unit = st.floats(0, 1, width=32) if np.dtype(dtype).kind == "f" else None
    samples = data.draw(hnp.arrays(dtype, shape, elements=unit))
    samples = samples[..., 0] if shape[2] == 1 else samples
    assert_photo(read(written(Photo(*split(samples)), file_format)), samples)


# What is stored for an upright photo, from the definition of the eight orientations: where the 0th row and
# the 0th column of the file are to be shown.
STORED = {
    1: lambda upright: upright,  # top, left
    2: np.fliplr,  # top, right
    3: lambda upright: np.rot90(upright, 2),  # bottom, right
    4: np.flipud,  # bottom, left
    5: lambda upright: np.swapaxes(upright, 0, 1),  # left, top
    6: lambda upright: np.rot90(upright, 1),  # right, top
    7: lambda upright: np.rot90(np.swapaxes(upright, 0, 1), 2),  # right, bottom
    8: lambda upright: np.rot90(upright, -1),  # left, bottom
}


class TestOrientation:
    @pytest.mark.parametrize("orientation", range(1, 9))
    @pytest.mark.parametrize("file_format", ["PNG", "TIFF", "WEBP", "JPEG"])
    def test_the_photo_is_upright_and_says_so(self, file_format, orientation):
        upright = np.kron(sample(np.uint8, 2, 3, 3), np.ones((8, 8, 1), np.uint8))
        stored = np.ascontiguousarray(STORED[orientation](upright))
        exif = Image.Exif()
        exif[0x0112] = orientation
        options = {"WEBP": {"lossless": True}, "JPEG": {"quality": 95, "subsampling": 0}}.get(file_format, {})
        data = saved(stored, file_format, exif=exif.tobytes(), dpi=(100, 50), **options)
        photo = read(data)
        assert photo.pixels.shape == upright.shape
        assert np.abs(photo.pixels.astype(int) - upright).max() <= (4 if file_format == "JPEG" else 0)
        with Image.open(io.BytesIO(data)) as opened:
            np.testing.assert_array_equal(photo.pixels, np.asarray(ImageOps.exif_transpose(opened)))
        if file_format != "WEBP":
            assert photo.metadata.dpi == pytest.approx((50, 100) if orientation > 4 else (100, 50), rel=1e-3)
        again = written(photo, file_format)
        with Image.open(io.BytesIO(again)) as opened:
            assert opened.getexif().get(0x0112, 1) == 1

    def test_alpha_turns_with_the_pixels(self):
        samples = sample(np.uint16, channels=4)
        data = png(np.ascontiguousarray(np.rot90(samples)), before=chunk(b"eXIf", exif_block(6)))
        assert_photo(read(data), samples)

    def test_png_says_it_after_the_pixels(self):
        data = png(np.rot90(sample(np.uint16)).copy(), after=chunk(b"eXIf", exif_block(6)))
        assert_photo(read(data), sample(np.uint16))

    @pytest.mark.parametrize("order", "<>")
    @pytest.mark.parametrize("kind", [3, 4])
    def test_any_byte_order_and_integer(self, order, kind):
        data = png(np.rot90(sample(np.uint8)).copy(), before=chunk(b"eXIf", exif_block(6, order, kind)))
        photo = read(data)
        assert_photo(photo, sample(np.uint8))
        exif = Image.Exif()
        exif.load(photo.metadata.exif)
        assert (exif[0x0112], exif[0x010F]) == (1, "Abc")

    @pytest.mark.parametrize("options", [{}, {"software": False}, {"bigtiff": True}], ids=str)
    def test_tiff_with_other_tags_and_without(self, options):
        stored = np.rot90(sample(np.uint16)).copy()
        data = tiff(stored, photometric="rgb", extratags=[(274, 3, 1, 6, True)], **options)
        assert_photo(read(data), sample(np.uint16))

    def test_the_old_thumbnail_is_gone(self):
        exif = Image.Exif()
        exif.load(exif_block(1))
        assert exif.get_ifd(ExifTags.IFD.IFD1)  # it was there
        exif = Image.Exif()
        exif.load(read(png(sample(np.uint8), before=chunk(b"eXIf", exif_block(1)))).metadata.exif)
        assert not exif.get_ifd(ExifTags.IFD.IFD1)

    @pytest.mark.parametrize("form", [b'tiff:Orientation="%d"', b"<tiff:Orientation>%d</tiff:Orientation>"])
    def test_xmp_follows_where_the_photo_was_turned(self, form):
        text = chunk(b"iTXt", b"XML:com.adobe.xmp\0\0\0\0\0" + form % 6)
        turned = read(png(sample(np.uint8), before=text + chunk(b"eXIf", exif_block(6))))
        assert turned.metadata.xmp == form % 1
        # Alone, it turns nothing, as in browsers, and so has to stay.
        alone = read(png(sample(np.uint8), before=text))
        assert_photo(alone, sample(np.uint8))
        assert alone.metadata.xmp == form % 6

    def test_a_block_that_ends_with_the_directory(self):
        data = png(np.rot90(sample(np.uint8)).copy(), before=chunk(b"eXIf", exif_block(6)[:34]))
        assert_photo(read(data), sample(np.uint8))

    @pytest.mark.parametrize("value", [0, 9, 65535])
    def test_an_unknown_orientation_is_upright(self, value):
        assert_photo(read(png(sample(np.uint8), before=chunk(b"eXIf", exif_block(value)))), sample(np.uint8))


def expected_srgb(values, matrix=P3_TO_XYZ, gamma=2.2):
    """Display P3 (or so) to sRGB by the book, clipped to the gamut."""
    gamma = round(gamma * 256) / 256
    linear = values**gamma @ (np.linalg.inv(SRGB_TO_XYZ) @ matrix).T
    return np.clip(srgb_curve(np.clip(linear, 0, None)), 0, 1)


class TestProfiles:
    @pytest.mark.parametrize(
        ("dtype", "tolerance"), [(np.uint8, 1.01 / 255), (np.uint16, 5e-4), (np.float32, 5e-4)]
    )
    def test_to_srgb_is_the_matrix_formula(self, dtype, tolerance):
        photo = Photo(sample(dtype, 40, 50), profile=P3)
        full = 1 if dtype is np.float32 else np.iinfo(dtype).max
        converted = photo.to_profile(None)
        assert converted.profile is None
        assert converted.pixels.dtype == dtype
        expected = expected_srgb(photo.pixels / full)
        assert np.abs(expected - photo.pixels / full).max() > 0.05
        assert np.abs(converted.pixels / full - expected).max() < tolerance

    @pytest.mark.parametrize("dtype", DEPTHS)
    def test_there_and_back(self, dtype):
        full = 1 if dtype is np.float32 else np.iinfo(dtype).max
        photo = Photo(sample(dtype, 40, 50), alpha=sample(dtype, 40, 50, 1), metadata=Metadata(dpi=(1, 2)))
        there = photo.to_profile(P3)
        assert there.profile == P3
        assert there.alpha is photo.alpha
        assert there.metadata is photo.metadata
        back = there.to_profile(None)
        assert np.abs(back.pixels / full - photo.pixels / full).max() < (6 / 255 if full == 255 else 4e-4)

    def test_the_same_profile_changes_nothing(self):
        for photo in (Photo(sample(np.uint8)), Photo(sample(np.uint8), profile=P3)):
            assert photo.to_profile(photo.profile) is photo

    @pytest.mark.parametrize(
        ("dtype", "tolerance"), [(np.uint8, 0.51 / 255), (np.uint16, 1e-4), (np.float32, 1e-4)]
    )
    def test_grey_stays_grey_in_srgb(self, dtype, tolerance):
        full = 1 if dtype is np.float32 else np.iinfo(dtype).max
        photo = Photo(sample(dtype, 40, 50, 1), profile=GREY_18)
        converted = photo.to_profile(None)
        assert converted.pixels.shape == (40, 50)
        assert converted.pixels.dtype == dtype
        assert converted.profile is None
        expected = srgb_curve((photo.pixels / full) ** (round(1.8 * 256) / 256))
        assert np.abs(converted.pixels / full - expected).max() < tolerance

    @pytest.mark.parametrize("profile", [None, GREY_18])
    def test_grey_into_an_rgb_profile(self, profile):
        photo = Photo(sample(np.uint16, 40, 50, 1), profile=profile)
        converted = photo.to_profile(P3)
        assert converted.pixels.shape == (40, 50, 3)
        assert np.ptp(converted.pixels.astype(int), axis=2).max() < 40
        back, direct = converted.to_profile(None).pixels[..., 1], photo.to_profile(None).pixels
        assert np.abs(back.astype(int) - direct).max() < 40

    def test_grey_into_a_grey_profile(self):
        photo = Photo(sample(np.uint16, 40, 50, 1))
        there = photo.to_profile(GREY_18)
        assert there.pixels.shape == (40, 50)
        expected = photo.to_profile(GREY_18).pixels / 65535
        linear = np.where(
            photo.pixels / 65535 <= 0.04045,
            photo.pixels / 65535 / 12.92,
            ((photo.pixels / 65535 + 0.055) / 1.055) ** 2.4,
        )
        assert np.abs(expected ** (round(1.8 * 256) / 256) - linear).max() < 2e-4

    def test_colours_do_not_go_into_a_grey_profile(self):
        with pytest.raises(ImageError, match="grey profile; give an RGB profile"):
            Photo(sample(np.uint8)).to_profile(GREY_18)

    @pytest.mark.parametrize("profile", [b"", b"junk" * 50, P3[:200], bytes(imagecodecs.cms_profile("xyz"))])
    def test_a_useless_profile_is_refused(self, profile):
        with pytest.raises(ImageError, match="ICC profile cannot be used"):
            Photo(sample(np.uint8)).to_profile(profile)
        with pytest.raises(ImageError, match="ICC profile cannot be used"):
            Photo(sample(np.uint8), profile=profile).to_profile(None)

    @pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
    @pytest.mark.parametrize("file_format", ["PNG", "TIFF", "JPEG", "WEBP"])
    def test_the_very_bytes_come_back(self, file_format, dtype):
        data = written(Photo(sample(dtype), profile=P3), file_format)
        with Image.open(io.BytesIO(data)) as opened:
            assert opened.info["icc_profile"] == P3
        assert read(data).profile == P3

    @pytest.mark.parametrize("file_format", ["PNG", "TIFF", "JPEG"])
    def test_grey_profiles_too(self, file_format):
        assert (
            read(written(Photo(sample(np.uint8, channels=1), profile=GREY_18), file_format)).profile
            == GREY_18
        )

    @pytest.mark.parametrize("file_format", ["PNG", "TIFF", "JPEG", "WEBP"])
    def test_from_pillow(self, file_format):
        assert read(saved(sample(np.uint8), file_format, icc_profile=P3)).profile == P3

    @pytest.mark.parametrize(
        ("channels", "profile"), [(3, GREY_18), (1, P3), (3, b"junk" * 50), (3, P3[:200])]
    )
    @pytest.mark.parametrize("file_format", ["PNG", "TIFF", "JPEG"])
    def test_one_that_does_not_fit_is_left_out(self, file_format, channels, profile):
        photo = read(saved(sample(np.uint8, channels=channels), file_format, icc_profile=profile))
        assert photo.profile is None
        assert photo.pixels.shape == sample(np.uint8, channels=channels).shape

    def test_damaged_compression_of_one_is_left_out(self):
        for content in (b"x\0\0junk", b"x\0\0" + zlib.compress(P3)[:-20], b"x"):
            assert_photo(read(png(sample(np.uint8), before=chunk(b"iCCP", content))), sample(np.uint8))

    def test_a_profile_bomb_is_left_out(self):
        content = b"x\0\0" + zlib.compress(bytes(1 << 25), 9)
        assert read(png(sample(np.uint8), before=chunk(b"iCCP", content))).profile is None

    def test_a_coloured_photo_takes_over_no_grey_profile(self):
        grey = Photo(sample(np.uint8, channels=1), profile=GREY_18)
        colour = Photo(sample(np.uint8), profile=P3)
        for like, pixels in ((grey, colour.pixels), (colour, grey.pixels)):
            with Image.open(io.BytesIO(written(pixels, "PNG", like=like))) as opened:
                assert "icc_profile" not in opened.info

    @pytest.mark.parametrize("file_format", ["BMP", "PPM"])
    def test_a_format_without_profiles_gets_srgb(self, file_format):
        photo = Photo(sample(np.uint8), profile=P3)
        np.testing.assert_array_equal(read(written(photo, file_format)).pixels, photo.to_profile(None).pixels)

    def test_webp_is_never_grey_so_it_gets_srgb(self):
        smooth = np.tile(np.arange(0, 250, 5, dtype=np.uint8), (50, 1))
        photo = Photo(smooth, profile=GREY_18)
        data = written(photo, "WEBP")
        with Image.open(io.BytesIO(data)) as opened:
            assert "icc_profile" not in opened.info
        assert np.abs(read(data).pixels[..., 1].astype(int) - photo.to_profile(None).pixels).mean() < 2


class TestMetadata:
    @pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
    @pytest.mark.parametrize("file_format", ["PNG", "TIFF", "JPEG", "WEBP"])
    def test_all_of_it_is_kept(self, file_format, dtype):
        photo = Photo(sample(dtype), metadata=Metadata(full_exif(), XMP, (300.0, 200.0)))
        data = written(photo, file_format)
        date, note, north = "2020:01:02 03:04:05", b"private" * 9, (1.0, 2.0, 3.5)
        artist = "Jos\xe9".encode().decode("latin-1")
        assert pillow_exif(data) == ("Maker", artist, 1, date, note, north, "R98")
        with Image.open(io.BytesIO(data)) as opened:
            assert opened.info["xmp"] == XMP
            if file_format != "WEBP":
                assert opened.info["dpi"] == pytest.approx((300, 200), rel=1e-3)
        again = read(data).metadata
        assert again.xmp == XMP
        if file_format != "WEBP":
            assert again.dpi == pytest.approx((300, 200), rel=1e-3)
        # and from there into every other container
        for other in ("PNG", "TIFF", "JPEG", "WEBP"):
            assert pillow_exif(written(read(data), other)) == pillow_exif(data)

    @pytest.mark.parametrize("file_format", ["PNG", "TIFF", "JPEG", "WEBP"])
    def test_from_pillow(self, file_format):
        options = {"xmp": XMP} if file_format in ("JPEG", "WEBP") else {}
        data = saved(sample(np.uint8), file_format, exif=b"Exif\0\0" + full_exif(), dpi=(300, 200), **options)
        metadata = read(data).metadata
        exif = Image.Exif()
        exif.load(metadata.exif)
        assert exif[0x010F] == "Maker"
        assert exif.get_ifd(0x8825)[2] == (1.0, 2.0, 3.5)
        assert metadata.xmp == options.get("xmp")
        if file_format != "WEBP":
            assert metadata.dpi == pytest.approx((300, 200), rel=1e-3)

    @pytest.mark.parametrize("file_format", ["PNG", "WEBP", "JPEG"])
    def test_makers_notes_stay_where_they_are(self, file_format):
        block = exif_block(1)
        block = block[:34] + bytes(4) + block[38:] + b"an offset in here would break"
        metadata = read(written(Photo(sample(np.uint8), metadata=Metadata(block)), file_format)).metadata
        assert metadata.exif == block

    def test_compressed_xmp_in_png(self):
        text = b"XML:com.adobe.xmp\0\1\0en\0keyword\0" + zlib.compress(XMP)
        assert read(png(sample(np.uint8), before=chunk(b"iTXt", text))).metadata.xmp == XMP

    def test_compressed_xmp_that_is_cut_short_or_a_bomb_is_left_out(self):
        for content in (zlib.compress(XMP)[:-9], zlib.compress(bytes(1 << 25)), b"junk"):
            text = b"XML:com.adobe.xmp\0\1\0\0\0" + content
            assert read(png(sample(np.uint8), before=chunk(b"iTXt", text))).metadata.xmp is None

    def test_xmp_in_tiff(self):
        data = tiff(sample(np.uint8), photometric="rgb", extratags=[(700, 1, len(XMP), XMP, True)])
        assert read(data).metadata.xmp == XMP

    def test_other_text_in_png_is_not_xmp(self):
        assert (
            read(png(sample(np.uint8), before=chunk(b"iTXt", b"Title\0\0\0\0\0hello"))).metadata.xmp is None
        )

    def test_a_pixel_ratio_in_png_is_no_resolution(self):
        assert (
            read(
                png(sample(np.uint8), before=chunk(b"pHYs", struct.pack(">IIB", 3000, 3000, 0)))
            ).metadata.dpi
            is None
        )

    def test_tiff_resolution_in_centimetres(self):
        data = tiff(sample(np.uint8), photometric="rgb", resolution=(100, 50), resolutionunit="centimeter")
        assert read(data).metadata.dpi == pytest.approx((254, 127))
        assert read(tiff(sample(np.uint8), photometric="rgb")).metadata.dpi is None
        assert read(tiff(sample(np.uint8), photometric="rgb", software=False)).metadata == Metadata()

    def test_bmp_keeps_the_resolution(self):
        data = written(Photo(sample(np.uint8), metadata=Metadata(dpi=(300, 200))), "BMP")
        assert read(data).metadata.dpi == pytest.approx((300, 200), rel=1e-3)

    @pytest.mark.parametrize("value", [(0, 1), (0, 0), (1, 0), (1, 2), (65536, 1), (4294967295, 1)])
    @pytest.mark.parametrize("tag", [282, 283])
    def test_an_impossible_resolution_is_left_out(self, tag, value):
        data = tiff(sample(np.uint8), photometric="rgb", resolution=(300, 300), resolutionunit="inch")
        assert read(data).metadata.dpi == (300, 300)
        assert read(tiff_with(data, {tag: value})).metadata.dpi is None

    def test_what_exceeds_a_jpeg_segment_is_left_out(self):
        large = full_exif() + bytes(65536)
        data = written(Photo(sample(np.uint8), metadata=Metadata(large, XMP + b" " * 65536)), "JPEG")
        assert read(data).metadata == Metadata()
        fits = exif_block(1).ljust(65527, b"\0")
        data = written(Photo(sample(np.uint8), metadata=Metadata(fits, XMP.ljust(65504))), "JPEG")
        assert len(read(data).metadata.exif) == 65527
        assert len(read(data).metadata.xmp) == 65504

    @pytest.mark.parametrize("file_format", ["PNG", "WEBP", "JPEG"])
    @given(
        block=st.one_of(
            st.binary(max_size=60), st.binary(max_size=60).map(lambda end: exif_block(6)[:8] + end)
        )
    )
    @settings(deadline=None, max_examples=40)
    def test_bogus_exif_is_survived(self, file_format, block):
        stored = sample(np.uint8)
        if file_format == "PNG":
            data = png(stored, before=chunk(b"eXIf", block))
        else:
            data = saved(stored, file_format, exif=b"Exif\0\0" + block)
            data = data.replace(b"JFIF\0", b"JFIX\0", 1)  # so that Pillow looks for the resolution in EXIF
        photo = read(data)
        assert sorted(photo.pixels.shape) == sorted(stored.shape)
        written(photo, "TIFF")

    def test_exif_that_cannot_be_parsed_is_left_out(self):
        assert (
            read(png(sample(np.uint8), before=chunk(b"eXIf", b"II*\0\xff\xff\xff\xff"))).metadata.exif is None
        )
        assert read(png(sample(np.uint8), before=chunk(b"eXIf", b"no EXIF"))).metadata.exif is None

    def test_exif_that_no_tiff_can_take_is_left_out(self):
        block = bytearray(exif_block(1))
        block[12:22] = struct.pack("<HII", 5, 1, 8)  # the maker's name, as a fraction
        data = written(Photo(sample(np.uint8), metadata=Metadata(bytes(block))), "TIFF")
        assert_photo(read(data), sample(np.uint8))

    def test_a_tiff_with_a_bogus_exif_directory(self):
        data = bytearray(written(Photo(sample(np.uint8), metadata=Metadata(full_exif())), "TIFF"))
        with tifffile.TiffFile(io.BytesIO(data)) as file:
            offset = file.pages[0].tags[34665].valueoffset
        data[offset : offset + 4] = b"\xff\xff\xff\x7f"
        assert_photo(read(bytes(data)), sample(np.uint8))


def header_only(file_format, width, height):
    """A file that claims a size, and ends before its pixels."""
    if file_format == "PNG":
        return (
            png(np.zeros((1, 1), np.uint8))[:16]
            + struct.pack(">II", width, height)
            + b"\x08\0\0\0\0"
            + bytes(4)
        )
    if file_format == "BMP":
        return saved(np.zeros((1, 1), np.uint8), "BMP").replace(
            struct.pack("<II", 1, 1), struct.pack("<II", width, height), 1
        )
    if file_format == "PPM":
        return b"P6 %d %d 255\n" % (width, height)
    if file_format == "TIFF":
        return tiff_with(
            tiff(np.zeros((1, 1), np.uint8), photometric="minisblack"), {256: width, 257: height}
        )
    if file_format == "JPEG":
        data = saved(np.zeros((1, 1), np.uint8), "JPEG")
        frame = data.index(b"\xff\xc0") + 5
        return data[:frame] + struct.pack(">HH", height, width) + data[frame + 4 :]
    data = saved(np.zeros((1, 1, 3), np.uint8), "WEBP", lossless=True)  # 14 bits each, less 1
    return data[:21] + struct.pack("<I", width - 1 | (height - 1) << 14) + data[25:]


class TestBombs:
    @pytest.mark.parametrize("file_format", ["PNG", "BMP", "PPM", "TIFF", "JPEG", "WEBP"])
    def test_the_claim_is_refused_before_decoding(self, file_format):
        start = time.perf_counter()
        width, height = (16000, 16000) if file_format == "WEBP" else (60000, 50000)
        with pytest.raises(ImageError, match=f"claims {width}x{height} px, .* 200000000 .*raise max_pixels"):
            read(header_only(file_format, width, height))
        assert time.perf_counter() - start < 5

    def test_the_cap_is_exact_and_can_be_raised(self):
        data = png(sample(np.uint8))
        with pytest.raises(ImageError, match="claims 7x11 px, more than the 76 px"):
            read(data, max_pixels=76)
        assert_photo(read(data, max_pixels=77), sample(np.uint8))

    @pytest.mark.parametrize("file_format", ["PNG", "BMP", "TIFF", "JPEG", "WEBP"])
    def test_pillow_has_no_say_and_keeps_its_own(self, file_format, monkeypatch):
        monkeypatch.setattr(Image, "MAX_IMAGE_PIXELS", 10)
        data = written(sample(np.uint8), file_format)
        assert read(data).pixels.shape == (11, 7, 3)
        with pytest.raises(ImageError):
            read(data[:60])
        assert Image.MAX_IMAGE_PIXELS == 10

    def test_one_thread_at_a_time_changes_what_all_share(self):
        reader = threading.Thread(target=read, args=(saved(sample(np.uint8), "JPEG"),))
        with quiet_pillow():
            reader.start()
            reader.join(0.1)
            assert reader.is_alive()
        reader.join()

    def test_many_threads_leave_pillow_and_the_warnings_as_they_were(self):
        before, limit = list(warnings.filters), Image.MAX_IMAGE_PIXELS
        data = saved(sample(np.uint8), "JPEG", exif=b"Exif\0\0" + full_exif())
        threads = [threading.Thread(target=lambda: [read(data) for _ in range(20)]) for _ in range(8)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        assert list(warnings.filters) == before
        assert limit == Image.MAX_IMAGE_PIXELS


def multi_page_tiff():
    file = io.BytesIO()
    tifffile.imwrite(file, np.zeros((2, 8, 8), np.uint8), photometric="minisblack")
    return file.getvalue()


FRAMES = [Image.fromarray(sample(np.uint8, seed=seed)) for seed in (0, 1)]
REFUSED = {
    "empty": (b"", "is empty"),
    "text": (b"Dear reader,\nthis is no photo.\n", "found a text file"),
    "binary": (bytes(range(64)), "found an unknown file"),
    "GIF": (saved(sample(np.uint8, channels=1), "GIF"), "found a GIF file; convert it to JPEG, PNG"),
    "HEIC": (b"\0\0\0\x18ftypheic\0\0\0\0", "found a HEIC file"),
    "AVIF": (b"\0\0\0\x18ftypavif\0\0\0\0", "found an AVIF file"),
    "video": (b"\0\0\0\x18ftypisom\0\0\0\0", "found a video file"),
    "PDF": (b"%PDF-1.7\n", "found a PDF file"),
    "CMYK JPEG": (saved(Image.new("CMYK", (8, 8)), "JPEG"), "holds CMYK colours; convert it to RGB"),
    "CMYK TIFF": (saved(Image.new("CMYK", (8, 8)), "TIFF"), "holds SEPARATED colours; convert it to RGB"),
    "Lab TIFF": (saved(Image.new("LAB", (8, 8)), "TIFF"), "holds CIELAB colours"),
    "animated WebP": (
        saved(FRAMES[0], "WEBP", save_all=True, append_images=FRAMES[1:]),
        "animated; save one",
    ),
    "animated PNG": (saved(FRAMES[0], "PNG", save_all=True, append_images=FRAMES[1:]), "animated; save one"),
    "pages": (multi_page_tiff(), "holds several pages; save one"),
    "camera raw": (
        tiff(sample(np.uint8), photometric="rgb", subfiletype=1),
        "camera raw files do; develop it",
    ),
    "five channels": (
        tiff(sample(np.uint8, channels=5), photometric="rgb"),
        "more than grey or RGB and alpha",
    ),
    "volume": (
        tiff(np.zeros((16, 16, 16), np.uint8), photometric="minisblack", volumetric=True, tile=(16, 16, 16)),
        "more than",
    ),
    "32 bits": (tiff(sample(np.uint32), photometric="rgb"), "holds uint32 values; save it with 8 or 16"),
    "signed": (tiff(np.zeros((8, 8), np.int16), photometric="minisblack"), "holds int16 values"),
    "large floats": (
        tiff(np.full((8, 8), 2.5, np.float32), photometric="minisblack"),
        "from 2.5 to 2.5; bring",
    ),
    "not a number": (tiff(np.full((8, 8), np.nan, np.float32), photometric="minisblack"), "from nan to nan"),
    "no pixels": (b"P5 0 5 255\n", "claims 0x5 px, which is no photo"),
    "no range": (b"P5 1 1 0\n\0", "states 0 as its largest value"),
    "wide range": (b"P5 1 1 70000\n\0\0\0\0", "states 70000 as its largest value"),
    "BM and no more": (b"BM is how this text starts", "the BMP data is damaged or cut short"),
}


class TestRefusals:
    @pytest.mark.parametrize("name", REFUSED)
    def test_one_line_says_what_is_wrong(self, name, tmp_path, capfd):
        data, message = REFUSED[name]
        path = tmp_path / "photo.jpg"
        path.write_bytes(data)
        with pytest.raises(ImageError, match=message) as caught:
            read_image(path)
        assert str(caught.value).startswith(f"{path}: ")
        assert "\n" not in str(caught.value)
        assert capfd.readouterr() == ("", "")

    @pytest.mark.parametrize("file_format", ["PNG", "TIFF", "JPEG", "WEBP", "PPM", "BMP"])
    @pytest.mark.parametrize("left", [0.3, 0.6, 0.9])
    def test_cut_short(self, file_format, left):
        data = written(sample(np.uint8, 50, 50), file_format)
        with pytest.raises(
            ImageError, match=f"the {file_format} data is damaged or cut short; get the file again"
        ):
            read(data[: int(left * len(data))])

    @pytest.mark.parametrize("left", [0.3, 0.6, 0.9])
    @pytest.mark.parametrize("file_format", ["PNG", "TIFF", "PPM"])
    def test_cut_short_at_16_bits(self, file_format, left):
        data = written(sample(np.uint16, 50, 50), file_format)
        with pytest.raises(ImageError, match="cut short"):
            read(data[: int(left * len(data))])

    @pytest.mark.parametrize(
        "options", [{}, {"compression": "lzw"}, {"compression": "zlib", "tile": (16, 16)}]
    )
    def test_a_tiff_of_others_cut_short(self, options):
        data = tiff(sample(np.uint16, 50, 50), photometric="rgb", **options)
        with pytest.raises(ImageError, match="cut short"):
            read(data[: len(data) - 200])

    def test_places_that_cannot_be_read(self, tmp_path):
        with pytest.raises(ImageError, match=r"absent\.png: there is no such file; check the name"):
            read_image(tmp_path / "absent.png")
        with pytest.raises(ImageError, match="is a folder; give the name of one photo"):
            read_image(tmp_path)
        with pytest.raises(ImageError, match="cannot be read"):
            read_image("a\0b.png")
        with pytest.raises(ImageError, match="cannot be read"):
            read_image(io.StringIO("text"))
        closed = io.BytesIO()
        closed.close()
        with pytest.raises(ImageError, match="cannot be read"):
            read_image(closed)

    def test_memory_is_not_called_damage(self, monkeypatch):
        def exhausted(*_arguments):
            raise MemoryError

        known = codecs.FORMATS["PNG"]
        monkeypatch.setitem(codecs.FORMATS, "PNG", replace(known, decode=exhausted))
        with pytest.raises(ImageError, match="takes more memory than there is"):
            read(png(sample(np.uint8)))

    @pytest.mark.parametrize("file_format", ["PNG", "TIFF", "JPEG", "WEBP", "PPM", "BMP"])
    def test_damage_anywhere_is_an_image_error_or_a_photo(self, file_format, capfd):
        photo = Photo(sample(np.uint8), metadata=Metadata(full_exif(), XMP, (72, 72)), profile=P3)
        data = written(photo, file_format)
        random = np.random.default_rng(0)
        refused = 0
        for _ in range(150):
            damaged = bytearray(data)
            for place in random.integers(0, len(data), 4):
                damaged[place] = random.integers(256)
            try:
                found = read(bytes(damaged), max_pixels=100_000)
            except ImageError:
                refused += 1
            else:
                assert found.pixels.ndim in (2, 3)
        assert refused > 0
        assert capfd.readouterr() == ("", "")


class TestDestinations:
    @pytest.mark.parametrize(
        ("name", "file_format"),
        [
            ("a.jpg", "JPEG"),
            ("a.JPEG", "JPEG"),
            ("a.png", "PNG"),
            ("a.tif", "TIFF"),
            ("a.Tiff", "TIFF"),
            ("a.webp", "WEBP"),
            ("a.ppm", "PPM"),
            ("a.pnm", "PPM"),
            ("a.bmp", "BMP"),
        ],
    )
    def test_the_extension_decides(self, name, file_format, tmp_path):
        write_image(tmp_path / name, sample(np.uint8))
        assert read_image(tmp_path / name).format == file_format

    def test_the_format_argument_goes_before_the_extension(self, tmp_path):
        write_image(tmp_path / "a.jpg", sample(np.uint8), format="png")
        assert read_image(tmp_path / "a.jpg").format == "PNG"
        write_image(str(tmp_path / "photo"), sample(np.uint8), format="TIF")
        assert read_image(tmp_path / "photo").format == "TIFF"

    @pytest.mark.parametrize("name", ["a.gif", "a", "a.png.txt"])
    def test_an_unknown_extension_lists_those_that_work(self, name, tmp_path):
        with pytest.raises(
            OutputError, match=r"(no format to write goes by|no extension) .*\.jpg, .*\.png, .*\.tif"
        ):
            write_image(tmp_path / name, sample(np.uint8))
        assert not list(tmp_path.iterdir())

    def test_an_unknown_format(self):
        with pytest.raises(OutputError, match="no format to write goes by 'gif'"):
            written(sample(np.uint8), "gif")

    def test_streams_take_the_format_of_like_else_png(self, tmp_path):
        like = Photo(sample(np.uint8), format="WEBP")
        for image_, options, expected in [
            (sample(np.uint8), {}, "PNG"),
            (sample(np.uint8), {"like": like}, "WEBP"),
            (like, {}, "WEBP"),
            (like, {"format": "BMP"}, "BMP"),
        ]:
            file = io.BytesIO()
            write_image(file, image_, **options)
            assert read(file.getvalue()).format == expected
            assert not file.closed
        with (tmp_path / "a.tif").open("wb") as file:
            write_image(file, sample(np.uint8))
        assert read_image(tmp_path / "a.tif").format == "TIFF"

    def test_the_standard_streams(self, monkeypatch):
        given_in, given_out = io.BytesIO(png(sample(np.uint16))), io.BytesIO()
        monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(given_in))
        photo = read_image("-")
        assert_photo(photo, sample(np.uint16))
        monkeypatch.setattr(sys, "stdout", io.TextIOWrapper(io.BufferedRandom(given_out)))
        write_image("-", photo.pixels)
        assert_photo(read(given_out.getvalue()), sample(np.uint16))
        given_out.seek(0)
        given_out.truncate()
        write_image(Path("-"), photo.pixels, format="tiff")
        assert read(given_out.getvalue()).format == "TIFF"

    def test_alpha_is_never_dropped(self, tmp_path):
        photo = Photo(sample(np.uint8), alpha=sample(np.uint8, channels=1))
        for name in ("a.jpg", "a.bmp", "a.ppm"):
            with pytest.raises(ImageError, match=r"cannot hold the photo's alpha; write PNG, TIFF or WebP"):
                write_image(tmp_path / name, photo)
            with pytest.raises(ImageError, match="cannot hold the photo's alpha"):
                write_image(tmp_path / name, photo.pixels, like=photo)
            with pytest.raises(ImageError, match="cannot hold the photo's alpha"):
                check_destination(tmp_path / name, like=photo)
        assert not list(tmp_path.iterdir())

    def test_colours_do_not_go_into_a_pgm(self, tmp_path):
        with pytest.raises(ImageError, match="PGM cannot hold colours; write PPM"):
            write_image(tmp_path / "a.pgm", sample(np.uint8))
        write_image(tmp_path / "a.pgm", sample(np.uint8, channels=1))
        assert_photo(read_image(tmp_path / "a.pgm"), sample(np.uint8, channels=1))

    @pytest.mark.parametrize(("name", "side"), [("a.webp", 16384), ("a.jpg", 65501)])
    def test_a_side_that_is_too_long(self, name, side, tmp_path):
        with pytest.raises(ImageError, match=f"{side}x1 px is too large"):
            write_image(tmp_path / name, np.zeros((1, side), np.uint8))
        write_image(tmp_path / name, np.zeros((1, side - 1), np.uint8))
        assert read_image(tmp_path / name).pixels.shape[1] == side - 1

    def test_like_gives_alpha_profile_and_metadata(self):
        like = Photo(
            sample(np.uint8), sample(np.uint8, channels=1), P3, Metadata(full_exif(), XMP, (72.0, 72.0))
        )
        photo = read(written(sample(np.uint16, seed=1), "TIFF", like=like))
        np.testing.assert_array_equal(photo.pixels, sample(np.uint16, seed=1))
        np.testing.assert_array_equal(photo.alpha, like.alpha * np.uint16(257))
        assert (photo.profile, photo.metadata.xmp, photo.metadata.dpi) == (P3, XMP, (72, 72))
        assert written(Photo(sample(np.uint8)), "PNG") == written(sample(np.uint8), "PNG")

    @pytest.mark.parametrize(
        ("pixels", "options", "message"),
        [
            ([[1, 2]], {}, "image: expected a NumPy array, got list"),
            (np.zeros((4, 4), bool), {}, "float64, got bool"),
            (np.zeros((4, 4), np.int32), {}, "float64, got int32"),
            (np.zeros((4, 4, 4), np.uint8), {}, r"expected shape \(H, W\) or \(H, W, 3\), got \(4, 4, 4\)"),
            (np.zeros(4, np.uint8), {}, r"got \(4,\)"),
            (np.zeros((0, 4), np.uint8), {}, r"got \(0, 4\)"),
            (np.full((4, 4), 1.5), {}, r"in \[0, 1\], got values from 1.5 to 1.5"),
            (np.full((4, 4), -0.5), {}, r"in \[0, 1\], got values from -0.5"),
            (np.full((4, 4), np.nan), {}, r"in \[0, 1\], got values from nan"),
            (Photo(np.zeros((4, 4))), {"like": Photo(np.zeros((4, 4)))}, "like: goes with an array"),
            (
                np.zeros((4, 4)),
                {"like": Photo(np.zeros((5, 4)), np.zeros((5, 4)))},
                r"alpha: .*\(4, 4\).*\(5, 4\)",
            ),
            (Photo(np.zeros((4, 4)), np.zeros((4, 4), int)), {}, "alpha: expected uint8"),
        ],
    )
    def test_arrays_that_are_no_photo(self, pixels, options, message, tmp_path):
        with pytest.raises(ImageError, match=message):
            write_image(tmp_path / "a.png", pixels, **options)
        assert not list(tmp_path.iterdir())

    def test_streams_that_cannot_be_written(self):
        with pytest.raises(OutputError, match="binary file: cannot be written"):
            write_image(io.StringIO(), sample(np.uint8))
        closed = io.BytesIO()
        closed.close()
        with pytest.raises(OutputError, match="cannot be written"):
            write_image(closed, sample(np.uint8))

    @pytest.mark.parametrize(
        "act", [check_destination, lambda place, **o: write_image(place, sample(np.uint8), **o)]
    )
    def test_places_that_are_refused(self, act, tmp_path):
        taken = tmp_path / "taken.png"
        taken.write_bytes(b"old")
        (tmp_path / "folder.png").mkdir()
        with pytest.raises(OutputError, match=r"taken\.png: exists already; use --force or overwrite=True"):
            act(taken)
        assert taken.read_bytes() == b"old"
        with pytest.raises(OutputError, match="is not a file"):
            act(tmp_path / "folder.png", overwrite=True)
        with pytest.raises(OutputError, match=r"there is no folder .*absent; create it"):
            act(tmp_path / "absent" / "a.png")
        act(taken, overwrite=True)
        act(tmp_path / "new.png")
        act(io.BytesIO())

    def test_a_name_that_is_too_long(self, tmp_path):
        with pytest.raises(OutputError, match="cannot be written"):
            write_image(tmp_path / ("n" * 300 + ".png"), sample(np.uint8))

    def test_checking_writes_nothing(self, tmp_path):
        check_destination(tmp_path / "a.png", like=Photo(sample(np.uint8)))
        assert not list(tmp_path.iterdir())

    @pytest.mark.parametrize("failure", [KeyboardInterrupt(), OSError(28, "No space left on device")])
    @pytest.mark.parametrize("stage", ["encode", "fsync", "replace"])
    def test_a_failure_leaves_the_old_file_and_no_other(self, stage, failure, tmp_path, monkeypatch):
        def fail(*_arguments, **_options):
            raise failure

        path = tmp_path / "a.png"
        path.write_bytes(b"old")
        if stage == "encode":
            monkeypatch.setitem(image.FORMATS, "PNG", replace(image.FORMATS["PNG"], encode=fail))
        else:
            monkeypatch.setattr(os, stage, fail)
        with pytest.raises((KeyboardInterrupt, OSError)):
            write_image(path, sample(np.uint8), overwrite=True)
        assert path.read_bytes() == b"old"
        assert list(tmp_path.iterdir()) == [path]


def test_odd_files_print_nothing(tmp_path):
    odd = bytearray(tiff(sample(np.uint8), photometric="rgb", extratags=[(315, 2, 0, "someone", True)]))
    with tifffile.TiffFile(io.BytesIO(odd)) as file:
        offset = file.pages[0].tags[315].offset
    odd[offset + 2] = 99  # no data type
    (tmp_path / "odd.tif").write_bytes(odd)
    (tmp_path / "odd.png").write_bytes(png(sample(np.uint8), before=chunk(b"iCCP", b"x\0\0junk")))
    code = "import sys; from relit.image import read_image; [read_image(name) for name in sys.argv[1:]]"
    command = [sys.executable, "-c", code, tmp_path / "odd.tif", tmp_path / "odd.png"]
    done = subprocess.run(command, capture_output=True, check=True)
    assert (done.stdout, done.stderr) == (b"", b"")


def test_the_heavy_libraries_wait_until_they_are_needed():
    code = "import sys, relit.image; print(*{'imagecodecs', 'tifffile'} & set(sys.modules))"
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert found.strip() == ""
