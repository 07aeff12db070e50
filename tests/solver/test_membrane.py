"""The membrane against harmonic functions, and a dense solver."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from relit.solver.membrane import fill


@pytest.mark.parametrize("harmonic", [lambda x, y: x + 0 * y, lambda x, y: x * y, lambda x, y: x * x - y * y])
def test_a_hole_in_a_harmonic_plane_is_filled_with_that_plane(harmonic):
    y, x = np.mgrid[-1:1:40j, -1:1:50j]
    plane = harmonic(x, y)
    known = np.ones(plane.shape)
    known[10:28, 12:40] = 0
    filled = fill(np.where(known > 0, plane, 7.0), known, cell=1)
    assert np.abs(filled - plane).max() < 0.04 * np.ptp(plane)
    np.testing.assert_allclose(filled[known > 0], plane[known > 0], atol=1e-6)


def test_beyond_what_is_known_it_settles_down():
    """Outside a disc, the extension stays within the disc's values (the maximum principle), and forgets."""
    y, x = np.mgrid[-1:1:90j, -1:1:90j]
    inside = np.hypot(x, y) < 0.3
    filled = fill(np.where(inside, np.sin(9 * x), 50.0), inside, cell=2)
    assert np.abs(filled).max() <= 1.001
    assert np.ptp(filled[0]) < 0.6 * np.ptp(filled[inside])


@given(seed=st.integers(0, 2**32 - 1), cell=st.integers(1, 4), count=st.integers(1, 3))
def test_a_constant_stays_constant(seed, cell, count):
    rng = np.random.default_rng(seed)
    known = (rng.random((23, 31)) < 0.3).astype(np.float32)
    known[4, 5] = 1
    planes = np.where(known[..., None] > 0, np.arange(1.0, count + 1), -99)
    filled = fill(planes, known, cell=cell)
    np.testing.assert_allclose(filled, np.broadcast_to(np.arange(1.0, count + 1), filled.shape), rtol=1e-3)


def test_it_minimises_the_membranes_energy():
    """Against a dense solver of the same quadratic form: known pixels held, the rest free."""
    rng = np.random.default_rng(0)
    plane, known = rng.random((9, 8)), (rng.random((9, 8)) < 0.5).astype(float)
    number = np.arange(72).reshape(9, 8)
    rows = [(a, b) for a, b in zip(number[:, :-1].ravel(), number[:, 1:].ravel(), strict=True)]
    rows += [(a, b) for a, b in zip(number[:-1].ravel(), number[1:].ravel(), strict=True)]
    design = np.zeros((len(rows) + 72, 72))
    for row, (a, b) in enumerate(rows):
        design[row, a], design[row, b] = 1, -1
    design[len(rows) :] = np.diag(np.sqrt(10 * known.ravel()))
    right = np.concatenate([np.zeros(len(rows)), np.sqrt(10 * known.ravel()) * plane.ravel()])
    dense = np.linalg.lstsq(design, right, rcond=None)[0].reshape(9, 8)
    filled = fill(plane, known, cell=1)
    np.testing.assert_allclose(filled[known == 0], dense[known == 0], atol=1e-4)


def test_nothing_known_leaves_all_as_it_is():
    plane = np.random.default_rng(0).random((12, 12))
    np.testing.assert_allclose(fill(plane, np.zeros((12, 12)), cell=3), plane, rtol=1e-6)
