"""Images of every kind as photos, and back."""

import re

import numpy as np
import pytest
from PIL import Image

from relit.errors import ImageError
from relit.photo.foreign_images import opened, pixels_of
from relit.photo.photo import Photo
from relit.photo.reading import read_image
from relit.photo.writing import write_image

GREY = np.arange(96, dtype=np.uint8).reshape(8, 12)
COLOUR = np.dstack([GREY, GREY + 50, 200 - GREY])
ALPHA = 255 - GREY


@pytest.mark.parametrize("depth", [np.uint8, np.uint16, np.float32, np.float64])
@pytest.mark.parametrize(
    ("array", "pixels"),
    [
        (GREY, GREY),
        (COLOUR, COLOUR),
        (GREY[..., None], GREY),
        (np.dstack([GREY, ALPHA]), GREY),
        (np.dstack([COLOUR, ALPHA]), COLOUR),
    ],
)
def test_an_array_gives_its_colours_and_takes_them_back(array, pixels, depth):
    scale = 1 / 255 if depth in (np.float32, np.float64) else 1
    array, pixels = (array * scale).astype(depth), (pixels * scale).astype(depth)
    photo, back = opened(array, "image")
    np.testing.assert_array_equal(photo.pixels, pixels)
    assert photo.pixels.flags.c_contiguous
    made = back(photo.pixels)
    assert made.dtype == depth
    np.testing.assert_array_equal(made, array)


@pytest.mark.parametrize("planes", [1, 2])
def test_a_grey_array_becomes_coloured_with_its_alpha(planes):
    _, back = opened(np.dstack([GREY, ALPHA])[..., :planes], "image")
    np.testing.assert_array_equal(back(COLOUR), np.dstack([COLOUR, ALPHA])[..., : planes + 2])


@pytest.mark.parametrize("alpha", [False, True])
def test_a_grey_picture_becomes_coloured_and_loses_its_grey_profile(alpha):
    picture = Image.fromarray(np.dstack([GREY, ALPHA]) if alpha else GREY)
    picture.info = {"icc_profile": b"grey", "dpi": (72, 72)}
    _, back = opened(picture, "image")
    assert back(GREY).info == picture.info
    made = back(COLOUR)
    assert (made.mode, made.info) == ("RGBA" if alpha else "RGB", {"dpi": (72, 72)})
    np.testing.assert_array_equal(np.asarray(made)[..., :3], COLOUR)
    assert not alpha or np.array_equal(made.getchannel("A"), ALPHA)


def test_a_picture_of_16_bits_takes_no_colours():
    _, back = opened(Image.fromarray(GREY.astype(np.uint16)), "target")
    with pytest.raises(ImageError, match=r"^target: a PIL image has no 16-bit colours.*give a grey"):
        back(COLOUR.astype(np.uint16))


def test_a_path_and_a_photo_give_their_pixels(tmp_path):
    write_image(tmp_path / "a.png", Photo(COLOUR, ALPHA))
    for given in (tmp_path / "a.png", str(tmp_path / "a.png"), read_image(tmp_path / "a.png")):
        photo, back = opened(given, "image")
        np.testing.assert_array_equal(photo.alpha, ALPHA)
        assert back(photo.pixels) is photo.pixels
        np.testing.assert_array_equal(pixels_of(given, "image"), COLOUR)


def test_what_is_no_image_is_refused_by_name(tmp_path):
    for given, message in [
        (3, "target: expected an array, a Photo, a PIL image, a torch tensor or a path, got int"),
        (GREY[:7], "target: 12x7 px cannot hold a face"),
        (GREY + 1.5, r"target: floats must be finite and in [0, 1]"),
        (Image.new("CMYK", (9, 9)), "target: expected mode L, LA, RGB, RGBA, I;16, got CMYK"),
        (tmp_path / "none.png", f"{tmp_path / 'none.png'}: "),
    ]:
        with pytest.raises(ImageError, match=f"^{re.escape(message)}"):
            opened(given, "target")
