"""Non-negative least squares against SciPy's."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import nnls

from relit.light.nonnegative import nonnegative


@given(count=st.integers(1, 40), seed=st.integers(0, 10_000))
def test_it_is_scipys_from_every_start(count, seed):
    random = np.random.default_rng(seed)
    matrix, wanted = random.normal(size=(2 * count + 1, count)), random.normal(size=2 * count + 1)
    truth, _ = nnls(matrix, wanted)
    square, right = matrix.T @ matrix, matrix.T @ wanted
    for start in (None, truth, np.ones(count), np.zeros(count), random.normal(size=count)):
        np.testing.assert_allclose(nonnegative(square, right, start), truth, atol=1e-6)


@pytest.mark.parametrize("right", [[0.0, 0.0], [-1.0, -2.0]])
def test_where_nothing_helps_there_is_nothing(right):
    assert nonnegative(np.eye(2), np.array(right), np.ones(2)).tolist() == [0, 0]


@given(seed=st.integers(0, 10_000))
def test_no_change_of_what_is_found_is_better(seed):
    """The conditions of Karush, Kuhn and Tucker, where two lamps do the same."""
    random = np.random.default_rng(seed)
    matrix = random.random((30, 10))
    matrix[:, 5:] = matrix[:, :5]
    square, right = matrix.T @ matrix + 1e-6 * np.eye(10), matrix.T @ random.random(30)
    found = nonnegative(square, right)
    gradient = right - square @ found
    assert found.min() >= 0
    assert gradient.max() < 1e-8
    assert abs(gradient @ found) < 1e-8
