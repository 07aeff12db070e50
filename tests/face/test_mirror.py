"""The halves of a face, against planes that have a mirror image of their own."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from relit.face.detect import detect_landmarks
from relit.face.landmarks import Landmarks
from relit.face.mirror import halves, twins
from relit.face.shape import FaceShape, head_shape
from relit.photo.reading import read_image
from relit.photo.samples import sample


def mirrored(shape):
    """Twins of a grid that is mirrored about its middle column."""
    y, x = np.indices(shape).astype(float)
    return np.stack([y, shape[1] - 1 - x])


@given(seed=st.integers(0, 2**32 - 1))
def test_both_parts_make_up_the_plane(seed):
    random = np.random.default_rng(seed)
    plane, weight = random.normal(size=(2, 12, 17)).astype(np.float32)
    twin = random.uniform(-3, 20, (2, 12, 17))
    for where in (twin, None):
        shared, differing = halves(plane, np.clip(weight, 0, 1), where)
        np.testing.assert_allclose(shared + differing, plane, atol=1e-5)


def test_halves_that_are_alike_differ_by_nothing():
    plane = np.random.default_rng(0).normal(size=(12, 17)).astype(np.float32)
    ones, twin = np.ones_like(plane), mirrored(plane.shape)
    even, odd = plane + plane[:, ::-1], plane - plane[:, ::-1]
    shared, differing = halves(even, ones, twin)
    np.testing.assert_allclose(shared, even, atol=1e-5)
    np.testing.assert_allclose(differing, 0, atol=1e-5)
    shared, differing = halves(odd, ones, twin)
    np.testing.assert_allclose(shared, 0, atol=1e-5)
    np.testing.assert_allclose(differing, odd, atol=1e-5)


def test_where_the_twin_is_not_known_all_is_shared():
    plane = np.random.default_rng(0).normal(size=(12, 17)).astype(np.float32)
    weight = np.ones_like(plane)
    weight[:, 9:] = 0
    shared, differing = halves(plane, weight, mirrored(plane.shape))
    np.testing.assert_array_equal(differing[:, :8], 0)
    np.testing.assert_array_equal(shared[:, :8], plane[:, :8])


def test_without_eyes_there_are_no_twins(ball):
    landmarks, normals, face = ball
    shape = FaceShape(normals, 40 * normals[..., 2], face, face)
    assert twins(landmarks, shape) is None


@pytest.mark.parametrize("yaw", [0, 25, -40])
def test_twins_on_a_turned_ball_lie_across_its_own_middle(yaw):
    """A ball turned about its axis looks the same, but its eyes have moved."""
    y, x = np.mgrid[-50:51, -50:51].astype(float)
    depth = -np.sqrt(np.maximum(45.0**2 - x**2 - y**2, 0))
    points = np.zeros((68, 3))
    points[:] = np.random.default_rng(0).normal(size=(68, 3))
    turn = np.radians(yaw)
    for rows, side in ((slice(36, 42), -1), (slice(42, 48), 1)):
        a = turn + side * np.radians(25)
        points[rows] = 45 * np.sin(a) + 50, 35, -45 * np.cos(a)
    shape = FaceShape(np.zeros((101, 101, 3)), depth, depth < 0, depth < 0)
    twin = twins(Landmarks(points), shape)
    # On the equator, azimuth a has its twin at 2·yaw - a.
    for azimuth in (yaw - 20, yaw + 5, yaw + 30):
        there = np.radians(2 * yaw - azimuth)
        if abs(azimuth) > 60 or abs(there) > np.radians(60):
            continue
        column = round(50 + 45 * np.sin(np.radians(azimuth)))
        assert twin[1, 50, column] == pytest.approx(50 + 45 * np.sin(there), abs=2.5)
        assert twin[0, 50, column] == pytest.approx(50, abs=1e-6)


@pytest.mark.parametrize("name", ["target", "reference"])
def test_an_eye_is_the_other_eyes_twin(name):
    photo = read_image(sample(name)).pixels
    found = detect_landmarks(photo)
    twin = twins(found, head_shape(found, photo.shape))
    right, left = found.eyes[:, :2]
    for here, there in ((right, left), (left, right)):
        column, row = np.rint(here).astype(int)
        off = np.hypot(twin[1, row, column] - there[0], twin[0, row, column] - there[1])
        assert off < 0.08 * found.interocular_distance
