"""Pixels as vectors, against NumPy's own arithmetic."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import array_shapes, arrays

from relit.photo.channels import clipped, moved, repeated, squared_length, transformed, within
from relit.photo.ranks import median, quantile

FLOATS = st.sampled_from([np.float32, np.float64])


@st.composite
def pixels(draw):
    """Vectors of one to four numbers, of one axis or several."""
    shape = draw(array_shapes(min_dims=1, max_dims=3, max_side=6)), draw(st.integers(1, 4))
    return draw(arrays(draw(FLOATS), (*shape[0], shape[1]), elements=st.floats(-100, 100, width=32)))


@given(vectors=pixels(), more=st.booleans(), rows=st.integers(1, 4), seed=st.integers(0, 99))
def test_vectors_are_transformed_as_by_matmul(vectors, more, rows, seed):
    count = vectors.shape[-1]
    matrix = np.random.default_rng(seed).normal(size=(rows, count + more))
    truth = vectors @ matrix[:, :count].T + (matrix[:, count] if more else 0)
    made = transformed(vectors, matrix)
    assert made.dtype == vectors.dtype
    np.testing.assert_allclose(made, truth, rtol=1e-5, atol=1e-4)
    by = matrix[0, :1].repeat(count)
    np.testing.assert_allclose(moved(vectors, by), vectors + by, rtol=1e-5, atol=1e-5)
    np.testing.assert_allclose(squared_length(vectors), np.linalg.norm(vectors, axis=-1) ** 2, rtol=1e-5)


def test_of_no_pixels_there_are_none():
    none = np.zeros((0, 3), np.float32)
    assert transformed(none, np.eye(3)[:2]).shape == (0, 2)
    assert squared_length(none).shape == (0,)


@pytest.mark.parametrize("count", [1, 3, 4])
def test_planes_are_picked_repeated_and_clipped_as_by_numpy(count):
    rng = np.random.default_rng(count)
    planes, mask = rng.normal(size=(5, 7, count)).astype(np.float32), rng.random((5, 7)) > 0.5
    np.testing.assert_array_equal(within(planes, mask), planes[mask])
    np.testing.assert_array_equal(within(planes[..., 0], mask), planes[..., 0][mask])
    np.testing.assert_array_equal(repeated(planes[..., 0], count), np.stack([planes[..., 0]] * count, axis=2))
    low, high = -rng.random(count).astype(np.float32), rng.random(count).astype(np.float32)
    np.testing.assert_array_equal(clipped(planes, low, high), np.clip(planes, low, high))


@given(
    values=FLOATS.flatmap(
        lambda kind: arrays(
            kind, array_shapes(min_dims=1, max_dims=2, max_side=20), elements=st.floats(-9, 9, width=32)
        )
    ),
    share=st.floats(0, 1),
)
def test_ranks_are_numpys(values, share):
    np.testing.assert_allclose(quantile(values, share), np.quantile(values, share, axis=0), atol=1e-5)
    np.testing.assert_allclose(median(values), np.median(values, axis=0), atol=1e-5)
    assert median(values).dtype == values.dtype
