"""The samples are what their README says, and do what the README of the project says."""

import hashlib
import re

import numpy as np
import pytest
from PIL import Image
from skimage import data

from relit.errors import OptionError, OutputError
from relit.face.detect import detect_faces
from relit.photo.reading import read_image
from relit.photo.samples import SAMPLES, copy_samples, sample


def test_checksums_are_those_that_the_readme_tells():
    text = sample("target").with_name("README.md").read_text("utf-8")
    told = dict(re.findall(r"^    ([0-9a-f]{64})  (\S+)$", text, re.M))
    assert {name: sum_ for sum_, name in told.items()} == {
        name: hashlib.sha256(sample(key).read_bytes()).hexdigest() for key, name in SAMPLES.items()
    }


def test_samples_come_from_where_they_say():
    np.testing.assert_array_equal(read_image(sample("target")).pixels, data.astronaut())
    grey = np.asarray(Image.fromarray(data.astronaut()).convert("L"))
    np.testing.assert_array_equal(read_image(sample("grey_target")).pixels, grey)


@pytest.mark.parametrize("name", list(SAMPLES))
def test_each_shows_one_face(name):
    assert len(detect_faces(read_image(sample(name)).pixels)) == 1


def test_unknown_names_are_refused():
    with pytest.raises(OptionError, match="expected one of target, reference, grey_target, got 'lena'"):
        sample("lena")


def test_copies_are_equal_and_nothing_is_replaced_unasked(tmp_path):
    copies = copy_samples(tmp_path / "photos")
    for name, copy in zip(SAMPLES, copies, strict=False):
        assert copy.read_bytes() == sample(name).read_bytes()
    copies[2].write_bytes(b"mine")
    copies[0].unlink()
    with pytest.raises(OutputError, match=r"exists already"):
        copy_samples(tmp_path / "photos")
    assert not copies[0].exists()
    assert copies[2].read_bytes() == b"mine"
    copy_samples(tmp_path / "photos", overwrite=True)
    assert copies[2].read_bytes() == sample("grey_target").read_bytes()


def test_a_folder_that_cannot_be_made_is_told(tmp_path):
    with pytest.raises(OutputError, match="cannot be made"):
        copy_samples(tmp_path / "no" / "photos")
    (tmp_path / "file").touch()
    with pytest.raises(OutputError, match="cannot be made"):
        copy_samples(tmp_path / "file")
