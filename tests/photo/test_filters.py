"""Filters by OpenCV against SciPy's."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import ndimage

from relit.photo.filters import (
    at_places,
    close_to,
    closed,
    dilated,
    distance_from,
    eroded,
    gaussian,
    spline_at_places,
)


def noise(*shape, seed=0):
    return np.random.default_rng(seed).random(shape, dtype=np.float32)


@pytest.mark.parametrize("shape", [(40, 50), (31, 47, 1), (31, 47, 3), (9, 11, 6)])
@given(sigma=st.floats(0, 12))
def test_a_gaussian_is_scipys(shape, sigma):
    planes = noise(*shape)
    for edge, mode in (("mirrored", "reflect"), ("repeated", "nearest")):
        truth = ndimage.gaussian_filter(planes, (sigma, sigma, 0)[: planes.ndim], mode=mode)
        np.testing.assert_allclose(gaussian(planes, sigma, edge=edge), truth, atol=2e-6)


@given(sigma=st.floats(0.2, 12))
def test_a_gaussian_changes_no_photo_that_it_is_given(sigma):
    planes = noise(20, 30)
    before = planes.copy()
    gaussian(planes, sigma)
    np.testing.assert_array_equal(planes, before)


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.float64, np.bool_])
def test_planes_of_every_kind_are_filtered(dtype):
    planes = (noise(20, 30) > 0.5).astype(dtype)
    truth = ndimage.gaussian_filter(planes.astype(np.float32), 1.5)
    np.testing.assert_allclose(gaussian(planes, 1.5), truth, atol=1e-6)
    np.testing.assert_array_equal(dilated(planes, 5), ndimage.grey_dilation(planes.astype(float), (5, 5)))


@pytest.mark.parametrize("size", [1, 3, 7])
def test_windows_are_scipys(size):
    plane = noise(33, 20)
    np.testing.assert_array_equal(dilated(plane, size), ndimage.grey_dilation(plane, (size, size)))
    for least in (size, size + 1):
        np.testing.assert_array_equal(eroded(plane, least), ndimage.grey_erosion(plane, (least, least)))
    np.testing.assert_array_equal(closed(plane, size), ndimage.grey_closing(plane, (size, size)))


@given(share=st.floats(0.001, 0.999), seed=st.integers(0, 99))
def test_a_distance_is_the_least_of_all(share, seed):
    mask = noise(23, 31, seed=seed) < share
    if mask.any():
        np.testing.assert_allclose(distance_from(mask), ndimage.distance_transform_edt(~mask), rtol=1e-6)


@given(share=st.floats(0, 1), seed=st.integers(0, 99), reach=st.floats(0.1, 12))
def test_what_is_close_is_less_far_away(share, seed, reach):
    mask = noise(23, 31, seed=seed) < share**4  # mostly a few
    away = ndimage.distance_transform_edt(~mask) if mask.any() else np.full(mask.shape, np.inf)
    clear = np.abs(away - reach) > 1e-5  # of rounding
    np.testing.assert_array_equal(close_to(mask, reach)[clear], (away < reach)[clear])


def test_nothing_is_far_away():
    assert distance_from(np.zeros((3, 4), bool)).min() > 1e6


@pytest.mark.parametrize("shape", [(23, 31), (23, 31, 3), (3, 2)])
def test_places_between_pixels_are_scipys(shape):
    planes = noise(*shape)
    y, x = (np.random.default_rng(1).uniform(-20, size + 20, (40, 50)) for size in shape[:2])
    each = np.moveaxis(np.atleast_3d(planes), -1, 0)
    for found, order, near in ((at_places, 1, 1e-5), (spline_at_places, 3, 4e-6)):
        truth = [ndimage.map_coordinates(plane, [y, x], order=order, mode="nearest") for plane in each]
        made = np.atleast_3d(found(planes, x, y))
        np.testing.assert_allclose(np.moveaxis(made, -1, 0), truth, atol=near)


def test_a_spline_of_a_large_photo_is_scipys_as_16_bits_see_it():
    plane = noise(900, 4000)
    y, x = np.mgrid[:120, :150] * 0.93 + 0.3
    x, y = (3800 + x + 0.1 * y).astype(np.float32), (700 + y - 0.1 * x).astype(np.float32)
    truth = ndimage.map_coordinates(plane, [y, x], order=3, mode="nearest")
    np.testing.assert_allclose(spline_at_places(plane, x, y), truth, atol=0.3 / 65535)


def test_beyond_the_ends_it_is_black_if_wanted():
    plane = np.ones((4, 4), np.float32)
    places = np.array([[-5.0, 1.5, 9.0]])
    assert at_places(plane, places, np.full((1, 3), 1.0), edge="black").tolist() == [[0, 1, 0]]
