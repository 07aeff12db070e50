"""Convex hulls against Qhull's."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial import ConvexHull

from relit.face.hull import convex_hull, polygon_area


@given(seed=st.integers(0, 2**32 - 1), count=st.integers(3, 60), whole=st.booleans())
def test_it_is_qhulls(seed, count, whole):
    points = np.random.default_rng(seed).normal(50, 9, (count, 2))
    # Of whole numbers many lie on one edge, and some twice.
    points = np.vstack([points.round(), [[0, 0], [9, 0], [0, 9]]]) if whole else points
    theirs, ours = ConvexHull(points), convex_hull(points)
    start = points[theirs.vertices].tolist().index(ours[0].tolist())
    np.testing.assert_array_equal(ours, points[np.roll(theirs.vertices, -start)])
    assert polygon_area(ours) == pytest.approx(theirs.volume)


def test_of_a_line_there_are_its_ends():
    assert sorted(convex_hull(np.array([[1.0, 1], [3, 3], [2, 2], [3, 3]])).tolist()) == [[1, 1], [3, 3]]
    assert convex_hull(np.array([[1.0, 1], [1, 1]])).tolist() == [[1, 1]]
