"""Photos that we wrote, read by other libraries."""

from __future__ import annotations

import io

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
from tests.photo.photo_files import (
    CHANNELS,
    DEPTHS,
    XMP,
    assert_photo,
    full_exif,
    read,
    sample,
    saved,
    split,
    written,
)


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
