"""The name of a file says whether a transfer goes into it as a photo or in layers."""

import io
import sys
import zipfile

import numpy as np
import pytest
from PIL import Image

from relit.errors import ImageError, OutputError
from relit.photo.atomic_files import NamedBytes
from relit.photo.photo import Photo
from relit.photo.reading import read_image
from relit.photo.samples import sample
from relit.photo.writing import write_image
from relit.relighting import transfer
from relit.result_files import LAYERED, check_results_destination, write_results


@pytest.fixture(scope="module")
def photo():
    return read_image(sample("target"))


@pytest.fixture(scope="module")
def result(photo):
    return transfer(photo, light="loop")


@pytest.mark.parametrize("name", ["a.png", "a.JPG", "a.exr", "a.layers.tif"])
def test_a_photo_is_what_write_image_makes_of_it(tmp_path, photo, result, name):
    alone, among = tmp_path / name, tmp_path / f"again.{name}"
    write_image(alone, result.image, like=photo)
    write_results(among, [result], like=photo)
    assert alone.read_bytes() == among.read_bytes()


@pytest.mark.parametrize("name", ["a.ora", "A.PSD", "a.layers.exr", "a.Layers.EXR"])
def test_a_file_in_layers_appears_whole_and_is_not_replaced(tmp_path, photo, result, name):
    path = tmp_path / name
    check_results_destination(path, like=photo)
    write_results(path, [result], like=photo)
    held = path.read_bytes()
    for refuse in (check_results_destination, lambda path, like: write_results(path, [result], like=like)):
        with pytest.raises(OutputError, match="exists already"):
            refuse(path, like=photo)
    write_results(path, [result], like=photo, overwrite=True)
    assert path.read_bytes() == held
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("name", LAYERED)
def test_a_stream_with_a_name_gets_the_bytes_of_the_file(tmp_path, photo, result, name):
    stream = NamedBytes(f"a{name}")
    write_results(stream, [result], like=photo)
    write_results(tmp_path / f"a{name}", [result], like=photo)
    assert (tmp_path / f"a{name}").read_bytes() == stream.getvalue()


def test_others_see_the_relit_photo(photo, result):
    files = {name: NamedBytes(f"a{name}") for name in (".ora", ".psd")}
    for file in files.values():
        write_results(file, [result], like=photo)
    with zipfile.ZipFile(files[".ora"]) as packed, Image.open(packed.open("mergedimage.png")) as merged:
        np.testing.assert_array_equal(np.asarray(merged), result.image)
    with Image.open(io.BytesIO(files[".psd"].getvalue())) as merged:
        np.testing.assert_array_equal(np.asarray(merged), result.image)


def test_a_photo_longer_than_psd_takes_is_refused_first():
    long = Photo(np.zeros((8, 30_001), np.uint8))
    with pytest.raises(ImageError, match=r"a\.psd: 30001x8 px is too large for PSD, .* write \.ora"):
        check_results_destination(NamedBytes("a.psd"), like=long)
    check_results_destination(NamedBytes("a.ora"), like=long)


def test_without_the_extra_the_error_says_how_to_get_it(photo, monkeypatch):
    monkeypatch.setitem(sys.modules, "OpenEXR", None)
    with pytest.raises(OutputError, match=r"a\.layers\.exr: .* pip install 'relit\[exr\]'"):
        check_results_destination(NamedBytes("a.layers.exr"), like=photo)


def test_another_ending_is_refused_as_for_photos(photo):
    with pytest.raises(OutputError, match=r"a\.xcf: no format to write goes by '\.xcf'"):
        check_results_destination("a.xcf", like=photo)


def test_layers_are_of_a_transfer_alone(photo):
    with pytest.raises(OutputError, match=r"a\.ora: no format to write goes by '\.ora'"):
        write_image("a.ora", photo)
