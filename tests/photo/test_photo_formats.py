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
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from PIL import Image, JpegImagePlugin

from relit.photo.codecs import formats as codecs
from relit.photo.photo import Metadata, Photo
from relit.photo.reading import read_image
from tests.photo.photo_files import (
    CHANNELS,
    DEPTHS,
    XMP,
    assert_photo,
    chunk,
    full_exif,
    png,
    read,
    sample,
    saved,
    split,
    tiff,
    tiff_with,
    written,
)


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
