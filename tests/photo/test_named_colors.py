"""Colours that a PNG names by numbers, in cICP, or in gAMA and cHRM, are those of its pixels."""

from __future__ import annotations

import io
import struct
import zlib

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image, ImageCms

from relit.errors import ImageError
from relit.photo.photo import Photo
from relit.photo.profile import grey_with_gamma, rgb_profile
from tests.photo.other_tools import convert
from tests.photo.photo_files import (
    ADOBE_RGB,
    P3,
    P3_TO_XYZ,
    SRGB_TO_XYZ,
    chunk,
    png,
    read,
    sample,
    srgb_curve,
    to_xyz,
    written,
)

SRGB = (0.64, 0.33, 0.30, 0.60, 0.15, 0.06, 0.3127, 0.3290)
DISPLAY_P3 = (0.680, 0.320, 0.265, 0.690, 0.150, 0.060, 0.3127, 0.3290)
ADOBE = (0.64, 0.33, 0.21, 0.71, 0.15, 0.06, 0.3127, 0.3290)
BT2020 = (0.708, 0.292, 0.170, 0.797, 0.131, 0.046, 0.3127, 0.3290)


def cicp(primaries, transfer, matrix=0, full=1):
    return chunk(b"cICP", bytes([primaries, transfer, matrix, full]))


def gama(gamma):
    return chunk(b"gAMA", struct.pack(">I", round(100_000 / gamma)))


def chrm(primaries):
    numbers = [round(100_000 * x) for x in (*primaries[6:], *primaries[:6])]
    return chunk(b"cHRM", struct.pack(">8I", *numbers))


def iccp(profile):
    return chunk(b"iCCP", b"x\0\0" + zlib.compress(profile))


def points(primaries):
    return [*zip(primaries[:6:2], primaries[1:6:2], strict=True)]


def in_srgb(samples, to_xyz_, curve):
    """What the samples are in sRGB, by matrices of the CIE's formulas: relative colorimetric."""
    linear = curve(samples / 255)
    light = (linear @ (np.linalg.inv(SRGB_TO_XYZ) @ to_xyz_).T).clip(0, 1)
    return srgb_curve(light) * 255


def srgb_light(values):
    return np.where(values <= 0.04045, values / 12.92, ((values + 0.055) / 1.055) ** 2.4)


@pytest.fixture(scope="module")
def pixels():
    """Colours that every gamut here has: not far from grey, and not in the deepest shadows."""
    return (sample(np.uint8, 12, 10) // 3 + 90).astype(np.uint8)


CASES = {
    "cICP of Display P3": (cicp(12, 13), DISPLAY_P3, srgb_light),
    "cICP of BT.2020": (cicp(9, 1), BT2020, srgb_light),
    "cICP of BT.709, linear": (cicp(1, 8), SRGB, lambda v: v),
    "cICP, gamma 2.8": (cicp(5, 5), (*SRGB[:2], 0.29, 0.60, *SRGB[4:]), lambda v: v**2.8),
    "gAMA and cHRM of Adobe RGB": (gama(2.2) + chrm(ADOBE), ADOBE, lambda v: v**2.2),
    "gAMA alone": (gama(1.8), SRGB, lambda v: v**1.8),
    "gAMA of light": (gama(1.0) + chrm(SRGB), SRGB, lambda v: v),
    "cHRM alone": (chrm(DISPLAY_P3), DISPLAY_P3, srgb_light),
}


class TestHonoured:
    @pytest.mark.parametrize("name", CASES)
    def test_the_pixels_are_in_these_colours(self, name, pixels):
        before, primaries, curve = CASES[name]
        photo = read(png(pixels, before=before))
        np.testing.assert_array_equal(photo.pixels, pixels)
        expected = in_srgb(pixels, to_xyz(*points(primaries), white=primaries[6:]), curve)
        assert np.abs(expected - pixels).max() > 4
        assert np.abs(photo.to_profile(None).pixels - expected).max() < 1.5

    @pytest.mark.parametrize("name", CASES)
    @pytest.mark.parametrize("file_format", ["PNG", "TIFF", "JPEG"])
    def test_and_so_are_those_that_are_written(self, name, file_format, pixels):
        photo = read(png(pixels, before=CASES[name][0]))
        again = read(written(photo, file_format))
        assert again.profile == photo.profile
        assert photo.profile is not None
        if file_format != "JPEG":
            np.testing.assert_array_equal(again.pixels, pixels)
        # Pillow opens it, and its Little CMS takes it.
        with Image.open(io.BytesIO(written(photo, file_format))) as opened:
            profile = ImageCms.ImageCmsProfile(io.BytesIO(opened.info["icc_profile"]))
            ImageCms.profileToProfile(opened, profile, ImageCms.createProfile("sRGB"))

    def test_grey(self):
        samples = sample(np.uint8, channels=1)
        photo = read(png(samples, before=gama(1.0)))
        expected = srgb_curve(samples / 255) * 255
        assert np.abs(photo.to_profile(None).pixels - expected).max() < 1.5
        assert read(written(photo, "PNG")).profile == photo.profile
        assert read(png(samples, before=cicp(12, 13))).profile is None

    def test_the_same_file_gives_the_same_profile(self, pixels):
        data = png(pixels, before=gama(1.8))
        assert read(data).profile == read(data).profile


class TestTakenForSrgb:
    """PNG 3, 11.3.2.5: gAMA 45455 and cHRM of these numbers are how sRGB is told to older readers."""

    @pytest.mark.parametrize(
        "before",
        [
            gama(2.2),
            gama(2.2) + chrm(SRGB),
            chrm(SRGB),
            cicp(1, 13),
            cicp(1, 1),
            chunk(b"sRGB", b"\0") + gama(1.8),
            cicp(1, 13) + iccp(P3),
        ],
    )
    def test_it_is(self, before, pixels):
        photo = read(png(pixels, before=before))
        assert photo.profile is None
        data = written(photo, "PNG")
        assert b"sRGB\0" in data
        assert read(data).metadata == photo.metadata
        assert b"sRGB" not in written(read(png(pixels)), "PNG"), "nobody said so"
        assert read(written(photo, "TIFF")).profile is None

    def test_what_imagemagick_writes(self, tmp_path, pixels):
        (tmp_path / "a.png").write_bytes(png(pixels))
        convert(tmp_path / "a.png", tmp_path / "b.png")
        data = (tmp_path / "b.png").read_bytes()
        assert b"gAMA\0\0\xb1\x8f" in data
        assert read(data).profile is None


class TestOrder:
    """PNG 3, 4.3: cICP, iCCP, sRGB, gAMA and cHRM."""

    def test_the_first_counts(self, pixels):
        assert read(png(pixels, before=iccp(P3) + chunk(b"sRGB", b"\0") + gama(1.8))).profile == P3
        named = read(png(pixels, before=cicp(12, 13)))
        assert read(png(pixels, before=iccp(ADOBE_RGB) + cicp(12, 13))).profile == named.profile
        assert np.abs(named.to_profile(None).pixels - in_srgb(pixels, P3_TO_XYZ, srgb_light)).max() < 1.5

    @pytest.mark.parametrize(
        "broken", [b"", b"\0", bytes(5), bytes([255, 255, 0, 1]), bytes([1, 13, 5, 1]), bytes([2, 2, 0, 1])]
    )
    def test_one_that_names_nothing_counts_as_missing(self, broken, pixels):
        assert read(png(pixels, before=chunk(b"cICP", broken) + iccp(P3))).profile == P3

    def test_a_damaged_profile_counts_as_missing(self, pixels):
        broken = chunk(b"iCCP", b"x\0\0" + zlib.compress(P3)[:-9])
        assert read(png(pixels, before=broken + gama(1.8))).profile == rgb_profile(SRGB, 1 / 0.55556)


class TestRefused:
    @pytest.mark.parametrize(("transfer", "name"), [(16, "PQ"), (18, "HLG")])
    def test_high_dynamic_range(self, transfer, name, pixels):
        with pytest.raises(ImageError, match=rf"holds HDR colours \({name}\); export it with standard range"):
            read(png(pixels, before=cicp(9, transfer)))

    def test_narrow_range(self, pixels):
        with pytest.raises(ImageError, match="holds narrow-range colours, as videos do; export it"):
            read(png(pixels, before=cicp(1, 13, full=0)))


@given(st.one_of(st.binary(max_size=40), st.binary(min_size=32, max_size=32)), st.binary(max_size=5))
def test_any_numbers_are_survived(chromaticities, gamma):
    before = chunk(b"cHRM", chromaticities) + chunk(b"gAMA", gamma)
    photo = read(png(sample(np.uint8), before=before))
    assert read(written(photo, "PNG")).profile == photo.profile


@given(st.lists(st.floats(0, 1), min_size=8, max_size=8), st.sampled_from([None, 0.1, 1.0, 2.2, 10.0]))
def test_any_primaries_give_a_profile_or_none(primaries, gamma):
    profile = rgb_profile(primaries, gamma)
    assert profile is None or profile[16:20] == b"RGB "


def test_a_grey_profile_is_that_of_its_exponent():
    levels = np.arange(256, dtype=np.uint8)[None]
    found = Photo(levels, profile=grey_with_gamma(2.8)).to_profile(None).pixels
    assert np.abs(found - srgb_curve((levels / 255) ** 2.8) * 255).max() < 1
