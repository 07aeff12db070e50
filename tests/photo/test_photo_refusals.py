"""Photos that are refused: damaged, too large, or of a kind that is not read."""

from __future__ import annotations

import io
import struct
import subprocess
import sys
import threading
import time
import warnings
from dataclasses import replace

import numpy as np
import pytest
import tifffile
from PIL import Image

from relit.errors import ImageError
from relit.photo.codecs import formats as codecs
from relit.photo.codecs.pillow import quiet_pillow
from relit.photo.photo import Metadata, Photo
from relit.photo.reading import read_image
from tests.photo.photo_files import (
    P3,
    XMP,
    assert_photo,
    chunk,
    full_exif,
    png,
    read,
    sample,
    saved,
    tiff,
    tiff_with,
    written,
)


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
        start = time.process_time()
        width, height = (16000, 16000) if file_format == "WEBP" else (60000, 50000)
        with pytest.raises(ImageError, match=f"claims {width}x{height} px, .* 200000000 .*raise max_pixels"):
            read(header_only(file_format, width, height))
        assert time.process_time() - start < 5

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
    "OpenRaster": (
        b"PK\x03\x04" + bytes(26) + b"mimetypeimage/openrasterPK\x03\x04",
        "found an OpenRaster file; convert it to JPEG, PNG",
    ),
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
