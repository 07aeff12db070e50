"""Blurs on coarser grids, against SciPy's on the whole one."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.ndimage import gaussian_filter

from relit.photo.resampling import blurred


def edges(shape):
    """Planes with steps, a ramp and a spot, from 0 to 1."""
    y, x = np.indices(shape[:2])
    step = ((x // 45 + y // 60) % 2).astype(np.float32)
    planes = np.stack([step, x / x.max(), np.hypot(x - 70, y - 90) < 12], axis=2).astype(np.float32)
    return planes[..., 0] if len(shape) == 2 else planes


@pytest.mark.parametrize("shape", [(180, 212), (181, 215, 3)])
@given(sigma=st.floats(0, 24))
def test_a_blur_is_that_of_the_whole_grid(shape, sigma):
    planes = edges(shape)
    made, truth = blurred(planes, sigma), gaussian_filter(planes, (sigma, sigma, 0)[: planes.ndim])
    assert made.shape == planes.shape
    assert made.dtype == np.float32
    inside = (slice(72, -72), slice(72, -72))  # at the frame, one mirrors pixels and the other cells
    np.testing.assert_allclose(made[inside], truth[inside], atol=0.01)


def test_a_small_blur_is_scipys():
    planes = np.random.default_rng(0).random((40, 50, 3)).astype(np.float32)
    for sigma in (0.0, 0.7, 5.9):
        truth = gaussian_filter(planes, (sigma, sigma, 0))
        np.testing.assert_allclose(blurred(planes, sigma), truth, atol=1e-6)


def test_what_is_even_stays_so():
    np.testing.assert_allclose(blurred(np.full((37, 53), 0.3, np.float32), 17.0), 0.3, atol=1e-6)
