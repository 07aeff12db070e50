"""Metadata that cameras and editors write is kept or named, from every format into every other.

The files are made and looked at by exiftool, ImageMagick, Pillow and tifffile.
"""

from __future__ import annotations

import io
import zlib

import numpy as np
import pytest
import tifffile
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image, PngImagePlugin

from relit.photo.codecs import photoshop
from relit.photo.codecs.metadata import with_texts
from relit.photo.photo import Metadata, Photo, Text
from relit.photo.reading import read_image
from relit.photo.writing import not_kept, write_image
from tests.photo.other_tools import changed, convert, exiftool
from tests.photo.photo_files import XMP, chunk, exif_block, full_exif, png, read, sample, saved, tiff, written

IPTC = (
    b"\x1c\x02\x00\x00\x02\x00\x04"
    + b"\x1c\x02\x50\x00\x03Ann"
    + b"\x1c\x02\x19\x00\x01a\x1c\x02\x19\x00\x01b"
)
URL = photoshop.resource(1035, b"https://example.org")
GEO = (
    (33550, (1.0, 2.0, 0.0)),
    (33922, (0.0, 0.0, 0.0, 500000.0, 4e6, 0.0)),
    (34735, (1, 1, 0, 1, 1024, 0, 1, 1)),
    (34737, b"WGS 84|"),
)
TEXTS = (Text("Author", "Zoë"), Text("Title", "Τίτλος"), Text("Source", "lens", "en", "source"))
#: A kind of metadata → what holds it, and what it is called where it does not fit.
KINDS = {
    "EXIF": Metadata(exif=full_exif()),
    "XMP": Metadata(xmp=XMP),
    "the resolution": Metadata(dpi=(300.0, 300.0)),
    "IPTC": Metadata(iptc=IPTC),
    "Photoshop's resources": Metadata(photoshop=URL),
    "GeoTIFF": Metadata(geo=GEO),
    "text (Author, Title, Source)": Metadata(text=TEXTS),
    "text (Comment)": Metadata(comments=("Grüße".encode(),)),
}
FORMATS = ("JPEG", "PNG", "TIFF", "WEBP", "BMP", "PPM", "EXR")
#: Of docs/formats.md, by hand: what each format has a place for.
KEEPS = {
    "JPEG": {"EXIF", "XMP", "the resolution", "IPTC", "Photoshop's resources", "text (Comment)"},
    "PNG": {
        *("EXIF", "XMP", "the resolution", "IPTC", "Photoshop's resources"),
        *("text (Author, Title, Source)", "text (Comment)"),
    },
    "TIFF": {"EXIF", "XMP", "the resolution", "IPTC", "Photoshop's resources", "GeoTIFF"},
    "WEBP": {"EXIF", "XMP"},
    "BMP": {"the resolution"},
    "PPM": set(),
    "EXR": set(),
}


class TestMatrix:
    @pytest.mark.parametrize("kind", KINDS)
    @pytest.mark.parametrize("file_format", FORMATS)
    def test_kept_or_named(self, file_format, kind):
        photo = Photo(sample(np.uint8), metadata=KINDS[kind])
        named = not_kept(io.BytesIO(), photo, format=file_format)
        if file_format == "EXR":
            pytest.importorskip("OpenEXR")
        again = read(written(photo, file_format)).metadata
        if kind in KEEPS[file_format]:
            assert named == ()
            if kind == "the resolution":
                assert again.dpi == pytest.approx((300, 300), rel=1e-3)
            elif kind == "EXIF":
                assert b"Maker" in again.exif
            elif kind == "text (Comment)" and file_format == "PNG":
                assert again.text == (Text("Comment", "Grüße"),)
            else:
                assert again == photo.metadata
        elif kind.startswith("text") and file_format in ("JPEG", "TIFF", "WEBP"):
            # EXIF tells what it has a tag for.
            told = {"text (Comment)": (), "text (Author, Title, Source)": ("text (Title, Source)",)}[kind]
            assert named == told
            exif = Image.Exif()
            exif.load(again.exif)
            value = exif[315] if told else exif[270]
            assert value.encode("latin-1").decode() == ("Zoë" if told else "Grüße")
        else:
            assert named == (kind,)
            assert again == Metadata()

    @pytest.mark.parametrize("target", ["JPEG", "PNG", "TIFF"])
    @pytest.mark.parametrize("source", ["JPEG", "PNG", "TIFF"])
    def test_from_one_to_another_and_back(self, source, target):
        metadata = Metadata(full_exif(), XMP, iptc=IPTC, photoshop=URL)
        first = read(written(Photo(sample(np.uint8), metadata=metadata), source))
        second = read(written(first, target))
        assert not_kept(io.BytesIO(), second, format=source) == ()
        back = read(written(second, source)).metadata
        assert (back.xmp, back.iptc, back.photoshop) == (XMP, IPTC, URL)
        assert back.exif == first.metadata.exif

    def test_what_a_reader_leaves_is_named(self):
        block = b"http://ns.adobe.com/xmp/extension/\0" + bytes(80)
        segment = b"\xff\xe1" + (2 + len(block)).to_bytes(2) + block
        data = saved(sample(np.uint8), "JPEG")
        photo = read(data[:2] + segment + data[2:])
        assert not_kept("a.jpg", photo) == ("extended XMP",)
        layers = tiff(sample(np.uint8), photometric="rgb", extratags=[(37724, 7, 9, b"Adobe Pho", True)])
        assert "Photoshop's layers" in not_kept("a.tif", read(layers))

    def test_no_thumbnail_of_the_old_light(self):
        thumbnail = photoshop.resource(1036, b"the old light")
        data = saved(sample(np.uint8), "JPEG")
        segment = photoshop.to_segments(thumbnail + URL + photoshop.resource(1033, b"the old light"))
        photo = read(data[:2] + segment + data[2:])
        assert photo.metadata.photoshop == URL
        assert b"the old light" not in written(photo, "JPEG")

    def test_no_thumbnail_of_the_old_light_in_xmp(self, tmp_path):
        (tmp_path / "a.jpg").write_bytes(saved(sample(np.uint8), "JPEG"))
        (tmp_path / "old").write_bytes(b"the old light")
        thumbnail = f"-XMP-xmp:ThumbnailImage<={tmp_path / 'old'}"
        path = changed(tmp_path / "a.jpg", thumbnail, "-XMP-dc:Creator=Ann", "-XMP-xmp:Rating=5")
        assert "XMP-xmp:ThumbnailImage" in exiftool(path)
        write_image(tmp_path / "b.png", read_image(path))
        found = exiftool(tmp_path / "b.png", "-warning", "-error", "-XMP:all")
        assert "XMP-xmp:ThumbnailImage" not in found
        assert (found["XMP-dc:Creator"], found["XMP-xmp:Rating"]) == ("Ann", 5)
        assert not {name for name in found if name.endswith((":Error", ":Warning"))}

    def test_resources_of_more_than_a_segment(self):
        large = Metadata(iptc=IPTC, photoshop=photoshop.resource(1060 + 10, bytes(200_001)) + URL)
        data = written(Photo(sample(np.uint8), metadata=large), "JPEG")
        assert data.count(b"Photoshop 3.0\0") == 4
        assert read(data).metadata == large

    @pytest.mark.parametrize("orientation", [3, 6])
    def test_places_in_a_photo_that_is_turned(self, orientation):
        path = photoshop.resource(2000, bytes(26))
        metadata = Metadata(exif_block(orientation), photoshop=path + URL, geo=GEO)
        photo = Photo(sample(np.uint8), metadata=metadata)
        data = tiff_with_orientation(written(photo, "TIFF"), orientation)
        found = read(data)
        assert found.metadata.geo == ()
        assert found.metadata.photoshop == URL
        assert not_kept("a.tif", found) == ("GeoTIFF", "paths and guides")

    def test_exif_of_more_than_a_segment_is_named(self):
        photo = Photo(sample(np.uint8), metadata=Metadata(full_exif() + bytes(65536), XMP + b" " * 65536))
        assert not_kept("a.jpg", photo) == (
            "EXIF of more than 65527 bytes",
            "XMP of more than 65504 bytes",
        )
        assert not_kept("a.png", photo) == ()

    def test_4_4_0_is_named(self):
        imagecodecs = pytest.importorskip("imagecodecs")
        data = imagecodecs.jpeg8_encode(sample(np.uint8, 32, 32), level=85, subsampling="440")
        assert not_kept("a.jpg", read(data)) == ("4:4:0 subsampling of colours (4:4:4 instead)",)
        assert not_kept("a.png", read(data)) == ()
        data = saved(sample(np.uint8, 32, 32), "JPEG", subsampling="4:2:2")
        assert not_kept("a.jpg", read(data)) == ()


def tiff_with_orientation(data, orientation):
    file = io.BytesIO(data)
    with tifffile.TiffFile(file, mode="r+") as opened:
        opened.pages[0].tags[274].overwrite(orientation)
    return file.getvalue()


class TestByOthers:
    """exiftool and ImageMagick write, we read and write, exiftool looks."""

    WORDS = (
        *("-IPTC:By-line=Ann", "-IPTC:Keywords=a", "-IPTC:Keywords=b", "-IPTC:Caption-Abstract=Ein Bild"),
        *("-Photoshop:URL=https://example.org", "-Photoshop:CopyrightFlag#=1"),
        *("-XMP-dc:Creator=Ann", "-EXIF:Artist=Ann", "-EXIF:UserComment=hello"),
    )
    TOLD = (
        *("IPTC:By-line", "IPTC:Keywords", "IPTC:Caption-Abstract", "Photoshop:URL"),
        *("Photoshop:CopyrightFlag", "XMP-dc:Creator", "IFD0:Artist", "ExifIFD:UserComment"),
    )

    @pytest.mark.parametrize("target", ["jpg", "png", "tif", "psd"])
    @pytest.mark.parametrize("source", ["jpg", "tif"])
    def test_all_that_exiftool_writes(self, source, target, tmp_path):
        Image.fromarray(sample(np.uint8, 32, 32)).save(tmp_path / f"a.{source}")
        path = changed(tmp_path / f"a.{source}", *self.WORDS)
        photo, output = read_image(path), tmp_path / f"b.{target}"
        if target == "psd":
            from relit.photo.codecs.psd import encode_psd
            from relit.photo.layers import Layers

            output.write_bytes(encode_psd(Layers(photo, ())))
        else:
            write_image(output, photo)
        before, after = exiftool(path), exiftool(output)
        assert {name: after.get(name) for name in self.TOLD} == {name: before[name] for name in self.TOLD}
        assert not {name for name in after if name.endswith((":Error", ":Warning"))}

    def test_camera_raw(self, tmp_path):
        pytest.importorskip("rawpy")
        from tests.photo.test_photo_extras import dng, scene

        (tmp_path / "a.dng").write_bytes(dng(scene()))
        path = changed(tmp_path / "a.dng", "-IPTC:By-line=Ann", "-XMP-dc:Creator=Ann", "-EXIF:Artist=Ann")
        write_image(tmp_path / "b.jpg", read_image(path))
        found = exiftool(tmp_path / "b.jpg")
        assert {found["IPTC:By-line"], found["XMP-dc:Creator"], found["IFD0:Artist"]} == {"Ann"}

    def test_texts_of_a_png(self, tmp_path):
        Image.fromarray(sample(np.uint8)).save(tmp_path / "a.png")
        words = ["Author=Zoë", "Copyright=me", "Title=Τίτλος", "Comment=" + "c" * 3000, "Disclaimer=none"]
        path = changed(tmp_path / "a.png", *(f"-PNG:{word}" for word in words))
        write_image(tmp_path / "b.png", read_image(path))
        before, after = exiftool(path), exiftool(tmp_path / "b.png")
        for word in words:
            name, _, text = word.partition("=")
            assert before[f"PNG:{name}"] == after[f"PNG:{name}"] == text
        assert Image.open(tmp_path / "b.png").text["Title"] == "Τίτλος"

    def test_comments_of_a_jpeg(self, tmp_path):
        (tmp_path / "a.jpg").write_bytes(saved(sample(np.uint8), "JPEG", comment=b"hello"))
        photo = read_image(tmp_path / "a.jpg")
        for name in ("b.jpg", "b.png", "b.tif"):
            write_image(tmp_path / name, photo)
        assert exiftool(tmp_path / "b.jpg")["File:Comment"] == "hello"
        assert exiftool(tmp_path / "b.png")["PNG:Comment"] == "hello"
        assert exiftool(tmp_path / "b.tif")["IFD0:ImageDescription"] == "hello"
        (tmp_path / "c.jpg").write_bytes(written(read_image(tmp_path / "b.png"), "JPEG"))
        with Image.open(tmp_path / "c.jpg") as opened:
            assert opened.info["comment"] == b"hello"

    def test_geotiff(self, tmp_path):
        tags = [(33550, 12, 3, GEO[0][1], True), (33922, 12, 6, GEO[1][1], True)]
        tags += [(34735, 3, 8, GEO[2][1], True), (34737, 2, 0, "WGS 84|", True)]
        (tmp_path / "a.tif").write_bytes(tiff(sample(np.uint8), photometric="rgb", extratags=tags))
        write_image(tmp_path / "b.tif", read_image(tmp_path / "a.tif"))
        with tifffile.TiffFile(tmp_path / "a.tif") as a, tifffile.TiffFile(tmp_path / "b.tif") as b:
            assert a.geotiff_metadata == b.geotiff_metadata
            assert a.geotiff_metadata["ModelPixelScale"] == [1, 2, 0]

    def test_the_exif_of_imagemagick(self, tmp_path):
        data = saved(sample(np.uint8, 20, 30), "JPEG", exif=b"Exif\0\0" + exif_block(6))
        (tmp_path / "a.jpg").write_bytes(data)
        convert(tmp_path / "a.jpg", tmp_path / "a.png")  # behind the pixels
        assert read_image(tmp_path / "a.png").pixels.shape == (30, 20, 3)

    def test_the_iptc_in_a_raw_profile_of_imagemagick(self, tmp_path):
        (tmp_path / "a.jpg").write_bytes(
            written(Photo(sample(np.uint8), metadata=Metadata(iptc=IPTC)), "JPEG")
        )
        convert(tmp_path / "a.jpg", tmp_path / "a.png")
        assert b"Raw profile type" in (tmp_path / "a.png").read_bytes()
        assert read_image(tmp_path / "a.png").metadata.iptc == IPTC
        convert(tmp_path / "a.jpg", tmp_path / "a.tif")
        assert read_image(tmp_path / "a.tif").metadata.iptc == IPTC

    def test_imagemagick_reads_ours(self, tmp_path):
        for kind, more in (("jpg", URL), ("png", URL), ("tif", None)):
            photo = Photo(sample(np.uint8), metadata=Metadata(iptc=IPTC, photoshop=more))
            write_image(tmp_path / f"a.{kind}", photo)
            convert(tmp_path / f"a.{kind}", tmp_path / f"{kind}.jpg")
            assert exiftool(tmp_path / f"{kind}.jpg")["IPTC:By-line"] == "Ann"


def raw_profile(kind, data, length=None):
    """A profile as text, as ImageMagick's coders/png.c has it."""
    told = f"\n{kind}\n{len(data) if length is None else length:8}\n{data.hex()}\n"
    return chunk(b"zTXt", f"Raw profile type {kind}".encode() + b"\0\0" + zlib.compress(told.encode()))


class TestRawProfiles:
    def test_exiftool_agrees(self, tmp_path):
        data = png(sample(np.uint8), before=raw_profile("exif", b"Exif\0\0" + exif_block(6)))
        (tmp_path / "a.png").write_bytes(data)
        assert exiftool(tmp_path / "a.png", "-n")["IFD0:Orientation"] == 6
        write_image(tmp_path / "b.png", read_image(tmp_path / "a.png"))
        assert exiftool(tmp_path / "b.png", "-n")["IFD0:Orientation"] == 1
        assert b"eXIf" in (tmp_path / "b.png").read_bytes()
        assert b"Raw" not in (tmp_path / "b.png").read_bytes()

    @pytest.mark.parametrize("kind", ["exif", "APP1"])
    def test_exif(self, kind):
        photo = read(png(sample(np.uint8), before=raw_profile(kind, b"Exif\0\0" + exif_block(6))))
        assert photo.pixels.shape == (7, 11, 3)
        assert photo.metadata.exif[:34] == exif_block(1)[:34]

    def test_xmp_and_a_colour_profile(self):
        from tests.photo.photo_files import P3

        before = raw_profile("APP1", b"http://ns.adobe.com/xap/1.0/\0" + XMP) + raw_profile("icm", P3)
        photo = read(png(sample(np.uint8), before=before))
        assert (photo.metadata.xmp, photo.profile) == (XMP, P3)
        assert read(png(sample(np.uint8), before=raw_profile("xmp", XMP))).metadata.xmp == XMP

    def test_a_chunk_of_its_own_counts_more(self):
        before = raw_profile("exif", b"Exif\0\0" + exif_block(6)) + chunk(b"eXIf", exif_block(1))
        assert read(png(sample(np.uint8), before=before)).pixels.shape == (11, 7, 3)

    @pytest.mark.parametrize("length", [0, -1, 10**9, 10**30])
    def test_a_wrong_length(self, length):
        before = raw_profile("exif", b"Exif\0\0" + exif_block(6), length)
        assert read(png(sample(np.uint8), before=before)).metadata == Metadata()


KEYWORDS = st.text(st.characters(min_codepoint=33, max_codepoint=126), min_size=1, max_size=79)
WORDS = st.text(st.characters(exclude_categories=["Cs"], exclude_characters="\0"), max_size=200)


@given(
    texts=st.lists(st.builds(Text, KEYWORDS, WORDS, st.sampled_from(["", "en", "fr-FR"]), WORDS), max_size=4)
)
def test_any_text_of_a_png_comes_back(texts):
    texts = tuple(text for text in texts if not text.keyword.startswith(("Raw profile", "XML:")))
    data = written(Photo(np.zeros((4, 4), np.uint8), metadata=Metadata(text=texts)), "PNG")
    assert read(data).metadata.text == texts
    with Image.open(io.BytesIO(data)) as opened:
        opened.load()
        assert opened.text == {text.keyword: text.text for text in texts}


APART = (1028, 1033, 1036, 1039, 1058, 1059, 1060)  # IPTC, and what is left out


@given(st.lists(st.tuples(st.integers(0, 65535), st.binary(max_size=60)), max_size=6), st.binary(max_size=30))
def test_resources_come_back(resources, junk):
    kept = [(number, data) for number, data in resources if number not in APART]
    block = b"".join(photoshop.resource(number, data) for number, data in kept)
    assert photoshop.split(photoshop.joined(IPTC, block)) == (IPTC, block or None)
    photoshop.split(block + junk)
    photoshop.split(b"8BIM" + junk)


@given(st.binary(max_size=80), st.integers(0, 3))
def test_zeros_that_fill_up_are_no_iptc(junk, zeros):
    assert photoshop.iptc_of(IPTC + bytes(zeros)) == IPTC
    long = b"\x1c\x02\x78\x80\x04\0\0\x01\0" + bytes(256)
    assert photoshop.iptc_of(long + bytes(zeros)) == long
    assert junk.startswith(photoshop.iptc_of(junk) or b"")
    marked = photoshop.iptc_of(b"\x1c" + junk)
    if marked is not None:
        assert (b"\x1c" + junk).startswith(marked)
        assert photoshop.iptc_of(marked) == marked


@given(
    st.dictionaries(st.sampled_from([270, 305, 315, 33432]), st.binary(min_size=1, max_size=20), min_size=1),
    st.sampled_from([None, full_exif(), exif_block(1, ">"), exif_block(1, "<")]),
)
def test_texts_are_added_to_exif(texts, block):
    texts = {tag: value.replace(b"\0", b".") for tag, value in texts.items()}
    before = Image.Exif()
    before.load(block or b"")
    made, told = with_texts(block, texts, None)
    assert told == texts.keys() - before.keys()
    after = Image.Exif()
    after.load(made)
    for tag in told:
        assert after[tag].encode("latin-1") == texts[tag]
    assert {tag: after[tag] for tag in before} == dict(before)
    if block:
        assert made[8 : len(block)] == block[8:], "makers' notes hold offsets"


@given(st.binary(max_size=120))
def test_texts_for_exif_that_is_odd(junk):
    for block in (junk, b"II*\0" + junk, b"MM\0*\0\0\0\x08" + junk):
        made, told = with_texts(block, {315: b"Ann"}, None)
        assert made == (block or made) or told == {315}


def test_pillow_reads_the_texts():
    info = PngImagePlugin.PngInfo()
    info.add_text("Author", "Zo\xeb")
    info.add_itxt("Title", "Τίτλος", "el", "Τίτλος")
    info.add_text("Comment", "light " * 400, zip=True)
    photo = read(saved(sample(np.uint8), "PNG", pnginfo=info))
    assert photo.metadata.text == (
        Text("Author", "Zoë"),
        Text("Title", "Τίτλος", "el", "Τίτλος"),
        Text("Comment", "light " * 400),
    )
