"""Curves by OpenCV against NumPy's."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.special import ndtr

from relit.photo.curves import exp, log, power, soft_step


@given(
    values=arrays(np.float64, st.tuples(st.integers(1, 6), st.integers(1, 6)), elements=st.floats(-80, 80)),
    exponent=st.floats(0.1, 4),
)
def test_curves_are_numpys(values, exponent):
    np.testing.assert_allclose(exp(values), np.exp(values), rtol=1e-12)
    np.testing.assert_allclose(log(np.exp(values)), np.log(np.exp(values)), rtol=1e-12, atol=1e-14)
    above = np.abs(values)
    np.testing.assert_allclose(power(above, exponent), above**exponent, rtol=1e-9, atol=1e-300)


@pytest.mark.parametrize("shape", [(), (5,), (4, 5), (4, 5, 1), (4, 5, 3), (2, 3, 4, 5), (0, 3)])
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_shape_and_kind_stay(shape, dtype):
    values = np.random.default_rng(0).uniform(0.1, 2, shape).astype(dtype)
    for function, truth in ((log, np.log), (exp, np.exp), (lambda v: power(v, 2.4), lambda v: v**2.4)):
        made = function(values)
        assert made.shape == shape
        assert made.dtype == dtype
        np.testing.assert_allclose(made, truth(values), rtol=1e-5, atol=1e-6)


def test_a_soft_step_is_scipys():
    values = np.linspace(-9, 9, 100_001)
    np.testing.assert_allclose(soft_step(values), ndtr(values), atol=1e-7)
