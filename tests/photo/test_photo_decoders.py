"""The photo formats: read what others wrote, and have others read what we wrote."""

from __future__ import annotations

import io
import os
import struct
import threading

import imagecodecs
import numpy as np
import pytest
import tifffile
from PIL import Image

from relit.photo.reading import read_image
from tests.photo.photo_files import (
    CHANNELS,
    DEPTHS,
    assert_photo,
    chunk,
    png,
    read,
    sample,
    saved,
    tiff,
    tiff_with,
)


class TestReading:
    """Files that other libraries, or nobody but the specification, wrote."""

    @pytest.mark.parametrize("channels", [1, 3])
    @pytest.mark.parametrize(
        "how",
        [
            {"quality": 90},
            {"subsampling": "4:2:0"},
            {"subsampling": "4:2:2", "progressive": True},
            {"restart_marker_blocks": 2},
            {"keep_rgb": True},
        ],
    )
    def test_jpeg(self, channels, how):
        samples = sample(np.uint8, 61, 83, channels)
        data = saved(samples[..., 0] if channels == 1 else samples, "JPEG", **how)
        photo = read(data)
        with Image.open(io.BytesIO(data)) as image:
            assert_photo(photo, np.asarray(image))
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
