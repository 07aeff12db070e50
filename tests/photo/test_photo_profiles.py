"""Colour profiles are followed, kept, and left out where they do not fit."""

from __future__ import annotations

import io
import zlib

import imagecodecs
import numpy as np
import pytest
from PIL import Image

from relit.errors import ImageError
from relit.photo.photo import Metadata, Photo
from tests.photo.photo_files import (
    DEPTHS,
    GREY_18,
    P3,
    P3_TO_XYZ,
    SRGB_TO_XYZ,
    assert_photo,
    chunk,
    png,
    read,
    sample,
    saved,
    srgb_curve,
    written,
)


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
