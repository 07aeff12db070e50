"""Delaunay's triangles against SciPy's, and against the hull that they must fill."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial import ConvexHull, Delaunay

from relit.face.detect import detect_landmarks
from relit.face.triangles import delaunay
from relit.photo.reading import read_image
from relit.photo.samples import sample


def corners(triangles):
    return {frozenset(triangle) for triangle in triangles.tolist()}


def areas(points, triangles):
    a, b, c = points[triangles].transpose(1, 2, 0)
    return ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])) / 2


@given(seed=st.integers(0, 2**32 - 1), count=st.integers(3, 150), size=st.floats(1e-3, 1e5))
def test_triangles_of_scattered_points_are_scipys(seed, count, size):
    points = np.random.default_rng(seed).uniform(size, 3 * size, (count, 2))
    assert corners(delaunay(points)) == corners(Delaunay(points).simplices)


@pytest.mark.parametrize("name", ["target", "reference"])
def test_triangles_of_a_face_are_scipys(name):
    points = detect_landmarks(read_image(sample(name)).pixels).xy
    assert corners(delaunay(points)) == corners(Delaunay(points).simplices)


@given(seed=st.integers(0, 2**32 - 1), count=st.integers(1, 120), side=st.integers(1, 12))
def test_triangles_of_points_on_lines_circles_and_twins_fill_the_hull(seed, count, side):
    """What of the many that are right, is of no matter; that they neither cross nor leave a gap, is."""
    random = np.random.default_rng(seed)
    points = random.integers(0, side, (count, 2)) * random.choice([1, 0.1, 7.3e3])
    found = areas(points, delaunay(points))
    assert (found > 0).all()
    wide = np.linalg.matrix_rank(points - points[0]) == 2
    assert found.sum() == pytest.approx(ConvexHull(points).volume if wide else 0)


def test_a_crowd_and_one_far_away_have_triangles():
    points = np.vstack([np.random.default_rng(0).random((40, 2)), [[9000, 4000]]])
    assert areas(points, delaunay(points)).sum() == pytest.approx(ConvexHull(points).volume)
