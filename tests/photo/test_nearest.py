"""The nearest pixels of masks: none is nearer by SciPy's distances."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.ndimage import distance_transform_edt
from scipy.spatial import cKDTree

from relit.photo.nearest import nearest_in, nearest_of


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


@given(seed=st.integers(0, 2**32 - 1), count=st.integers(1, 60), spread=st.floats(0, 400))
def test_none_of_the_points_is_nearer(seed, count, spread):
    rng = np.random.default_rng(seed)
    points = rng.normal([40, 60], spread, (count, 2))
    mask = rng.random((100, 75)) < 0.3
    mask[:40, :40] = False
    places = np.argwhere(mask)[:, ::-1]
    away = np.linalg.norm(points[nearest_of(points, mask)] - places, axis=1)
    np.testing.assert_allclose(away, cKDTree(points).query(places)[0])
