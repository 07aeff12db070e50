"""Held membranes against SciPy's factors of their matrix."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.sparse import diags_array, eye_array, kron
from scipy.sparse.linalg import spsolve

from relit.solver.multigrid import held_membrane


def solved(hold, right):
    chains = []
    for size in hold.shape:
        ends = np.full(size, 2.0)
        ends[0] -= 1
        ends[-1] -= 1
        ones = -np.ones(size - 1)
        chains.append(diags_array([ends, ones, ones], offsets=[0, 1, -1], shape=(size, size)))
    down, across = chains
    pulls = kron(down, eye_array(hold.shape[1])) + kron(eye_array(hold.shape[0]), across)
    matrix = (pulls + diags_array(hold.ravel())).tocsc()
    return np.reshape(spsolve(matrix, right.ravel()), hold.shape)


@settings(max_examples=40)
@given(
    shape=st.tuples(st.integers(1, 70), st.integers(1, 70)),
    seed=st.integers(0, 2**32 - 1),
    rest=st.sampled_from([1e-6, 1e-3, 1.0]),
)
def test_it_is_scipys(shape, seed, rest):
    rng = np.random.default_rng(seed)
    hold = 10 * rng.random(shape) * (rng.random(shape) < 0.1) + rest
    right = (hold - rest) * rng.normal(size=shape)
    np.testing.assert_allclose(held_membrane(hold, right), solved(hold, right), atol=1e-6)


@pytest.mark.parametrize("shape", [(150, 180), (5, 400)])
def test_one_held_corner_is_felt_at_the_other_end(shape):
    hold, right = np.full(shape, 1e-6), np.zeros(shape)
    hold[:3, :3] = 10
    right[:3, :3] = 10
    np.testing.assert_allclose(held_membrane(hold, right), solved(hold, right), atol=1e-6)


def test_nothing_pulls_at_nothing():
    assert not held_membrane(np.ones((9, 9)), np.zeros((9, 9))).any()
