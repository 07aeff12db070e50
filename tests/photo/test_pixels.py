"""Pixel arrays: dtypes, ranges, and what is refused."""

import numpy as np
import pytest
from skimage.util import img_as_float64, img_as_ubyte, img_as_uint

from relit.errors import ImageError
from relit.photo.pixels import check_pixels, from_unit, to_unit


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
def test_every_integer_value_makes_the_round_trip(dtype):
    values = np.arange(np.iinfo(dtype).max + 1, dtype=dtype).reshape(16, -1)
    np.testing.assert_array_equal(from_unit(to_unit(values), dtype), values)
    np.testing.assert_allclose(to_unit(values), img_as_float64(values), atol=1e-7)


def test_depths_convert_as_in_scikit_image():
    values = np.linspace(0, 1, 1001).reshape(7, -1)
    np.testing.assert_array_equal(from_unit(values, np.uint8), img_as_ubyte(values))
    np.testing.assert_array_equal(from_unit(values, np.uint16), img_as_uint(values))


def test_values_outside_the_range_are_clipped():
    np.testing.assert_array_equal(from_unit(np.array([[-1.0, 2.0]]), np.uint8), [[0, 255]])
    np.testing.assert_array_equal(from_unit(np.array([[-1.0, 2.0]]), np.float32), [[0, 1]])


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.float32, np.float64])
@pytest.mark.parametrize("shape", [(8, 9), (8, 9, 3)])
def test_photos_pass(dtype, shape):
    image = np.zeros(shape, dtype)
    assert check_pixels(image, "target") is image


@pytest.mark.parametrize(
    ("image", "message"),
    [
        ([[1, 2]], "target: expected a NumPy array, got list"),
        (np.zeros((9, 9), np.int32), "target: expected uint8, uint16, float32 or float64, got int32"),
        (np.zeros((9, 9, 4), np.uint8), "keep alpha aside"),
        (np.zeros((9, 9, 5), np.uint8), r"got \(9, 9, 5\)$"),
        (np.zeros(9, np.uint8), r"expected shape \(H, W\)"),
        (np.zeros((1, 1), np.uint8), "1x1 px cannot hold a face"),
        (np.full((9, 9), np.nan), r"finite and in \[0, 1\]"),
        (np.full((9, 9), 1.01), r"finite and in \[0, 1\]"),
        (np.full((9, 9), -0.01), r"finite and in \[0, 1\]"),
    ],
)
def test_anything_else_is_refused(image, message):
    with pytest.raises(ImageError, match=message):
        check_pixels(image, "target")
