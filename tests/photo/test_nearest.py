"""The nearest pixels of masks: none is nearer by SciPy's distances."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.ndimage import distance_transform_edt

from relit.photo.nearest import nearest_in


def check(mask):
    places = nearest_in(mask)
    assert mask.ravel()[places].all()
    y, x = np.indices(mask.shape)
    away = np.hypot(places // mask.shape[1] - y, places % mask.shape[1] - x)
    np.testing.assert_allclose(away, distance_transform_edt(~mask), atol=1e-9)


@given(
    shape=st.tuples(st.integers(1, 40), st.integers(1, 40)),
    seed=st.integers(0, 2**32 - 1),
    share=st.floats(0, 1),
)
def test_none_is_nearer_of_scattered_pixels(shape, seed, share):
    rng = np.random.default_rng(seed)
    mask = rng.random(shape) < share**3
    mask[rng.integers(shape[0]), rng.integers(shape[1])] = True
    check(mask)


@pytest.mark.parametrize("turned", [False, True])
def test_none_is_nearer_of_blobs(turned):
    y, x = np.mgrid[:500, :700]
    mask = (np.hypot(x - 300, (y - 200) / 1.4) < 90) | (np.hypot(x - 620, y - 430) < 30)
    check(mask.T if turned else mask)
