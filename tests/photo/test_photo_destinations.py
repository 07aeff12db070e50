"""Where photos are written to, in which format, and what a failure leaves."""

from __future__ import annotations

import io
import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from relit.errors import ImageError, OutputError
from relit.photo.codecs import formats as codecs
from relit.photo.photo import Metadata, Photo
from relit.photo.reading import read_image
from relit.photo.writing import check_destination, write_image
from tests.photo.photo_files import (
    P3,
    XMP,
    assert_photo,
    full_exif,
    png,
    read,
    sample,
    written,
)


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

    def test_a_folder_is_none(self, tmp_path):
        with pytest.raises(OutputError, match="is a folder; give the name of a file in it"):
            write_image(tmp_path, sample(np.uint8))

    @pytest.mark.skipif(not Path("/dev/full").exists(), reason="no device that is always full")
    def test_a_full_disk_behind_a_stream_is_told_in_words(self):
        with Path("/dev/full").open("wb", buffering=0) as full, pytest.raises(OutputError) as error:
            write_image(full, sample(np.uint8))
        told = "/dev/full: cannot be written (No space left on device); choose another place"
        assert str(error.value) == told

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


def test_the_heavy_libraries_wait_until_they_are_needed():
    code = "import sys, relit.photo.writing; print(*{'imagecodecs', 'tifffile'} & set(sys.modules))"
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert found.strip() == ""
