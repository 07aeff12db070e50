"""Images of every kind as small pictures."""

import io

import numpy as np
import pytest
from PIL import Image, ImageCms

from relit import read_image, sample
from relit.display.small import small
from relit.errors import ImageError
from relit.photo.photo import Photo

GREY = np.arange(96, dtype=np.uint8).reshape(8, 12)
COLOUR = np.dstack([GREY, GREY + 50, 200 - GREY])
ALPHA = 255 - GREY


@pytest.mark.parametrize("depth", [np.uint8, np.uint16, np.float32, np.float64])
@pytest.mark.parametrize(
    ("samples", "mode"),
    [(GREY, "L"), (COLOUR, "RGB"), (np.dstack([GREY, ALPHA]), "LA"), (np.dstack([COLOUR, ALPHA]), "RGBA")],
)
def test_arrays_keep_their_colours_and_alpha(samples, mode, depth):
    scale = {np.uint8: 1, np.uint16: 257}.get(depth, 1 / 255)
    picture = small((samples.astype(np.float64) * scale).astype(depth), 100)
    assert picture.mode == mode
    np.testing.assert_array_equal(np.asarray(picture), samples)


def test_pictures_and_photos_with_alpha():
    both = np.dstack([COLOUR, ALPHA])
    for image in (Image.fromarray(both), Photo(COLOUR, ALPHA)):
        np.testing.assert_array_equal(np.asarray(small(image, 100)), both)


def test_another_profile_goes_to_srgb():
    photo = read_image(sample("target"))
    assert photo.profile is not None
    srgb = ImageCms.createProfile("sRGB")
    with Image.open(sample("target")) as file:
        there = ImageCms.ImageCmsProfile(io.BytesIO(file.info["icc_profile"]))
        known = np.asarray(ImageCms.profileToProfile(file.convert("RGB"), there, srgb), int)
    assert np.abs(np.asarray(small(photo, 4000), int) - known).max() <= 2


def test_none_is_enlarged_and_none_too_long():
    assert small(GREY, 100).size == (12, 8)
    assert small(np.zeros((300, 200)), 150).size == (100, 150)


def test_what_is_no_image_is_refused():
    with pytest.raises(ImageError, match=r"^image: expected an array"):
        small(3, 100)
