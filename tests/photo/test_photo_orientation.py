"""Photos come upright, whichever of the eight ways they were stored."""

from __future__ import annotations

import io

import numpy as np
import pytest
from PIL import ExifTags, Image, ImageOps

from tests.photo.photo_files import (
    assert_photo,
    chunk,
    exif_block,
    png,
    read,
    sample,
    saved,
    tiff,
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
