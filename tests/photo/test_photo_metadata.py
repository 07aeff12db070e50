"""EXIF, XMP and resolution are kept, from any container into any other."""

from __future__ import annotations

import io
import struct
import zlib

import numpy as np
import pytest
import tifffile
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image

from relit.photo.photo import Metadata, Photo
from tests.photo.photo_files import (
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
    tiff,
    tiff_with,
    written,
)


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
