"""Reduced views against scikit-image's block means."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from skimage.measure import block_reduce

from relit.face.landmarks import Landmarks
from relit.face.views import view_of, window_round
from relit.photo.resampling import reduced

FACE = [[12, 14], [30, 13], [20, 30]]


@pytest.mark.parametrize("shape", [(24, 36), (24, 36, 3)])
@pytest.mark.parametrize("factor", [2, 3, 4])
@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.float32, np.float64])
def test_a_reduced_image_holds_the_means_of_blocks(shape, factor, dtype):
    values = np.random.default_rng(0).random(shape)
    full = 1 if np.dtype(dtype).kind == "f" else np.iinfo(dtype).max
    image = (values * full).astype(dtype)
    blocks = (factor, factor, 1)[: len(shape)]
    means = block_reduce(image / full, blocks, np.mean)
    small = reduced(image, factor)
    assert small.dtype == (np.float32 if np.dtype(dtype).kind == "f" else np.uint16)
    scale = 1 if small.dtype == np.float32 else 65535
    np.testing.assert_allclose(small / scale, means, atol=0.51 / 65535)


def test_at_factor_one_nothing_is_copied():
    image = np.zeros((9, 9), np.uint8)
    assert reduced(image, 1) is image


@given(st.integers(1, 40), st.integers(1, 40), st.integers(1, 7))
def test_blocks_at_the_end_repeat_the_last_pixel(height, width, factor):
    image = np.random.default_rng(height + 100 * width).random((height, width)).astype(np.float32)
    more = [(0, -size % factor) for size in image.shape]
    expected = block_reduce(np.pad(image, more, mode="edge"), (factor, factor), np.mean)
    np.testing.assert_allclose(reduced(image, factor), expected, rtol=1e-5)


@pytest.mark.parametrize("factor", [1, 2, 5])
def test_landmarks_stay_on_what_they_mark(factor):
    image = np.zeros((60, 70), np.float32)
    image[20:30, 35:45] = 1  # centre at 39.5, 24.5
    face = Landmarks([[39.5, 24.5], [10, 50], [60, 50]])
    view = view_of(image, face, (slice(5, 55), slice(10, 70)), factor)
    y, x = np.indices(view.pixels.shape)
    middle = [(axis * view.pixels).sum() / view.pixels.sum() for axis in (x, y)]
    np.testing.assert_allclose(view.landmarks.xy[0], middle, atol=1e-5)
    assert view.landmarks.interocular_distance == pytest.approx(face.interocular_distance / factor)


@given(st.floats(0, 300), st.integers(1, 9))
def test_a_window_holds_the_points_and_starts_at_a_block(margin, factor):
    points = np.array([[40.0, 30.0], [90.0, 80.0]])
    rows, columns = window_round(points, margin, (120, 100, 3), factor)
    assert rows.start % factor == columns.start % factor == 0
    assert 0 <= rows.start <= max(30 - margin, 0)
    assert min(80 + margin, 119) < rows.stop <= 120
    assert 0 <= columns.start <= max(40 - margin, 0)
    assert min(90 + margin, 99) < columns.stop <= 100
