"""Filters in double precision against SciPy's."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import ndimage

from relit.photo.doubles import gaussian, window_mean

SHAPES = [(23, 31), (1, 4), (12, 9, 3)]


def noise(shape):
    return np.random.default_rng(0).normal(size=shape)


@pytest.mark.parametrize("shape", SHAPES)
@given(sigma=st.floats(0, 60))
def test_a_double_gaussian_is_scipys(shape, sigma):
    truth = ndimage.gaussian_filter(noise(shape), (sigma, sigma, 0)[: len(shape)])
    np.testing.assert_allclose(gaussian(noise(shape), sigma), truth, atol=1e-13)


@pytest.mark.parametrize("shape", SHAPES)
@given(half=st.integers(0, 30))
def test_means_of_windows_are_scipys(shape, half):
    size = (2 * half + 1,) * 2 + (1,) * (len(shape) - 2)
    for repeated, mode in ((False, "reflect"), (True, "nearest")):
        truth = ndimage.uniform_filter(noise(shape), size, mode=mode)
        np.testing.assert_allclose(window_mean(noise(shape), size[0], repeated=repeated), truth, atol=1e-13)
