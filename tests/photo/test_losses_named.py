"""What a file holds and a photo does not keep is named, even where the file is damaged; and nothing else is.

The files are made by exiftool, Pillow, pillow-heif and tifffile, or by hand after the specifications.
"""

import io
import struct

import numpy as np
import pytest
from PIL import Image

from relit.photo.photo import Metadata, Photo
from relit.photo.reading import read_image
from relit.photo.writing import not_kept, write_image
from tests.photo.other_tools import changed, exiftool
from tests.photo.photo_files import P3, chunk, exif_block, png, read, sample, saved, tiff, written

MAKE, ARTIST, PAGE_NAME, OWN = 271, 315, 285, 65000
PLAIN = sample(np.uint8, 32, 32)
UNREADABLE = "EXIF that cannot be read"


def exif(*texts, lost=()):
    """An EXIF block with texts by their tags, some of which lie far beyond its end."""
    tags = sorted({**dict(texts), **dict.fromkeys(lost)}.items())
    end = 8 + 2 + 12 * len(tags) + 4
    entries = values = b""
    for tag, text in tags:
        data = b"nowhere" if text is None else text
        at = 1 << 30 if text is None else end + len(values)
        entries += struct.pack("<HHII", tag, 2, len(data) + 1, at)
        values += data + b"\0"
    return b"II*\0" + struct.pack("<IH", 8, len(tags)) + entries + bytes(4) + values


def with_exif(block):
    return Photo(PLAIN, metadata=Metadata(exif=block))


def tags_of(data):
    return dict(Image.open(io.BytesIO(data)).getexif())


class TestExifInATiff:
    def test_what_both_have_is_kept_and_the_rest_named(self, tmp_path):
        Image.fromarray(PLAIN).save(tmp_path / "a.jpg")
        words = ("DocumentName=Contract", "PageName=Seven", "RatingPercent=80", "ProcessingSoftware=own")
        path = changed(tmp_path / "a.jpg", *(f"-IFD0:{word}" for word in words), "-EXIF:Artist=Ann")
        photo = read_image(path)
        assert not_kept("b.jpg", photo) == ()
        assert not_kept("b.tif", photo) == ("EXIF tags (ProcessingSoftware)",)
        write_image(tmp_path / "b.tif", photo)
        found = exiftool(tmp_path / "b.tif")
        for word in words[:3]:
            name, _, text = word.partition("=")
            assert str(found[f"IFD0:{name}"]) == text
        write_image(tmp_path / "c.jpg", read_image(tmp_path / "b.tif"))
        assert exiftool(tmp_path / "c.jpg")["IFD0:PageName"] == "Seven"

    def test_what_cannot_be_read_is_lost_alone(self):
        photo = with_exif(exif((MAKE, b"Maker"), (PAGE_NAME, b"Seven"), lost=(ARTIST, 34665)))
        assert not_kept("a.tif", photo) == ("EXIF tags (Artist, ExifOffset)",)
        kept = tags_of(written(photo, "TIFF"))
        assert (kept[MAKE], kept[PAGE_NAME], kept.get(ARTIST)) == ("Maker", "Seven", None)

    def test_a_tag_that_none_knows_has_a_number(self):
        numbers = {OWN + number: b"own" for number in range(6)}
        photo = with_exif(exif(*numbers.items()))
        assert not_kept("a.tif", photo) == ("EXIF tags (65000, 65001, 65002, 65003, 2 more)",)
        assert not_kept("a.png", photo) == ()


class TestTagsOfATiff:
    def test_its_own_are_named(self):
        own = [(OWN, 2, 0, "own", True), (PAGE_NAME, 2, 0, "Seven", True), (42112, 2, 0, "<GDAL/>", True)]
        photo = read(tiff(PLAIN, photometric="rgb", extratags=own))
        assert not_kept("a.tif", photo) == ("TIFF tags (42112, 65000)",)
        assert tags_of(written(photo, "JPEG"))[PAGE_NAME] == "Seven"

    def test_geotiff_that_is_odd_is(self):
        odd = [(33550, 12, 3, (1.0, 2.0, 0.0), True), (34735, 4, 8, (1, 1, 0, 1, 1024, 0, 1, 1), True)]
        photo = read(tiff(PLAIN, photometric="rgb", extratags=odd))
        assert photo.metadata.geo == ()
        assert not_kept("a.tif", photo) == ("TIFF tags (33550, 34735)",)

    @pytest.mark.parametrize(
        "options",
        [
            {"photometric": "rgb", "compression": "deflate", "predictor": True, "tile": (16, 16)},
            {"photometric": "rgb", "planarconfig": "contig", "resolution": (300, 300)},
            {"photometric": "rgb", "compression": "jpeg", "software": "x", "datetime": True},
            {"photometric": "rgb", "description": "x", "iccprofile": P3, "rowsperstrip": 3},
        ],
    )
    def test_none_of_what_tells_of_the_pixels(self, options):
        assert not_kept("a.tif", read(tiff(PLAIN, **options))) == ()
        assert not_kept("a.tif", read(saved(PLAIN, "TIFF", compression="tiff_lzw", dpi=(9, 9)))) == ()


class TestDamagedExif:
    """Whatever is read from: what was there is named, and what was not is not."""

    BAD = (
        *(b"XX*\0\x08\0\0\0\0\0", b"II*\0\xff\xff\0\0", b"II*\0\x08\0\0\0\xff\x7f" + bytes(40)),
        *(b"MM\0*\0\0\0\x08\0\x02" + bytes(12), b"II", b"Ex"),
    )

    @pytest.mark.parametrize("block", BAD)
    def test_it_is_named(self, block):
        segment = b"\xff\xe1" + struct.pack(">H", 8 + len(block)) + b"Exif\0\0" + block
        jpeg = saved(PLAIN, "JPEG")
        for data in (jpeg[:2] + segment + jpeg[2:], png(PLAIN, before=chunk(b"eXIf", block))):
            photo = read(data)
            assert photo.metadata.exif is None
            for name in ("a.jpg", "a.png", "a.tif"):
                assert not_kept(name, photo) == (UNREADABLE,)
        assert not_kept("a.tif", with_exif(block)) == (UNREADABLE,)
        assert read(written(with_exif(block), "TIFF")).metadata.exif is None

    def test_none_is_not(self):
        for data in (
            saved(PLAIN, "JPEG"),
            saved(PLAIN, "JPEG", exif=b"Exif\0\0"),
            saved(PLAIN, "WEBP"),
            png(PLAIN, before=chunk(b"eXIf", exif_block(6))),
        ):
            assert read(data).metadata.left_out == ()


class TestFurtherPictures:
    def test_of_an_mpo(self):
        other = Image.fromarray(PLAIN[::-1])
        photo = read(saved(PLAIN, "MPO", save_all=True, append_images=[other]))
        assert not_kept("a.jpg", photo) == ("further pictures",)
        np.testing.assert_array_equal(photo.pixels, read(saved(PLAIN, "JPEG")).pixels)
        assert not_kept("a.jpg", read(written(photo, "JPEG"))) == ()

    @pytest.mark.parametrize("progressive", [False, True])
    def test_what_else_is_behind(self, progressive):
        data = saved(PLAIN, "JPEG", progressive=progressive, exif=b"Exif\0\0" + exif_block(1))
        for rest, named in (
            (b"", ()),
            (bytes(999), ()),
            (b"\xff" * 9 + b"\r\n", ()),
            (bytes(16) + b"ftypmp42 a video", ("data behind the picture",)),
            (bytes(16) + saved(PLAIN, "JPEG"), ("further pictures",)),
        ):
            assert read(data + rest).metadata.left_out == named

    def test_of_a_heic(self):
        heif = pytest.importorskip("pillow_heif")
        for others, named in (((), ()), ((PLAIN,), ("further pictures",))):
            file, buffer = heif.from_pillow(Image.fromarray(PLAIN)), io.BytesIO()
            for other in others:
                file.add_from_pillow(Image.fromarray(other))
            file.save(buffer)
            assert read(buffer.getvalue()).metadata.left_out == named


def test_a_profile_that_cannot_be_used():
    for profile in (b"no profile", P3[:200]):
        photo = read(saved(PLAIN, "JPEG", icc_profile=profile))
        assert photo.profile is None
        assert not_kept("a.png", photo) == ("a colour profile that cannot be used",)
    assert not_kept("a.png", read(saved(PLAIN, "JPEG", icc_profile=P3))) == ()
