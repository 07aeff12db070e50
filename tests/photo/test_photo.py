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
from PIL import ExifTags, Image, ImageOps

from relit.errors import ImageError, OutputError
from relit.photo.codecs import formats as codecs
from relit.photo.codecs.pillow import quiet_pillow
from relit.photo.photo import Metadata, Photo
from relit.photo.reading import read_image
from relit.photo.writing import check_destination, write_image
from tests.photo.photo_files import (
    DEPTHS,
    GREY_18,
    P3,
    P3_TO_XYZ,
    SRGB_TO_XYZ,
    XMP,
    assert_photo,
    chunk,
    exif_block,
    full_exif,
    pillow_exif,
    png,
    read,
    sample,
    saved,
    srgb_curve,
    tiff,
    tiff_with,
    written,
)

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
    "HEIC sequence": (b"\0\0\0\x18ftyphevc\0\0\0\0", "found an animated HEIC file"),
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
        "camera raw files do, but is none that LibRaw knows",
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
            monkeypatch.setitem(codecs.FORMATS, "PNG", replace(codecs.FORMATS["PNG"], encode=fail))
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
    code = (
        "import sys; from relit.photo.reading import read_image; [read_image(name) for name in sys.argv[1:]]"
    )
    command = [sys.executable, "-c", code, tmp_path / "odd.tif", tmp_path / "odd.png"]
    done = subprocess.run(command, capture_output=True, check=True)
    assert (done.stdout, done.stderr) == (b"", b"")


def test_the_heavy_libraries_wait_until_they_are_needed():
    code = "import sys, relit.photo.writing; print(*{'imagecodecs', 'tifffile'} & set(sys.modules))"
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert found.strip() == ""
