"""Surfaces of faces against surfaces whose normals are known."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.interpolate import LinearNDInterpolator, NearestNDInterpolator
from scipy.ndimage import gaussian_filter

from relit.face.detect import detect_landmarks
from relit.face.landmarks import Landmarks
from relit.face.shape import face_shape, with_depth
from relit.photo.reading import read_image
from relit.photo.samples import sample


def between(a, b):
    """Angles of two fields of normals, in degrees."""
    return np.rad2deg(np.arccos(np.clip((a * b).sum(axis=-1), -1, 1)))


def test_normals_and_depth_of_a_ball_are_its_own(ball):
    landmarks, truth, face = ball
    shape = face_shape(landmarks, face.shape)
    assert between(shape.normals, truth)[face].max() < 3
    np.testing.assert_allclose(shape.depth[face], 40 * truth[..., 2][face], atol=1)
    assert shape.inside[face].all()
    assert not shape.inside[0].any()
    np.testing.assert_allclose(np.linalg.norm(shape.normals, axis=2), 1, atol=1e-5)


def test_depth_is_scipys_between_the_landmarks_and_beyond_them():
    landmarks = detect_landmarks(read_image(sample("target")).pixels)
    shape = face_shape(landmarks, (400, 512))
    y, x = np.indices((400, 512))
    depth = landmarks.points[:, 2]
    truth = LinearNDInterpolator(landmarks.xy, depth)(x, y)
    beyond = np.isnan(truth)
    np.testing.assert_array_equal(shape.head, ~beyond)
    truth[beyond] = NearestNDInterpolator(landmarks.xy, depth)(x[beyond], y[beyond])
    blurred = gaussian_filter(truth, 0.02 * landmarks.interocular_distance, mode="nearest")
    np.testing.assert_allclose(shape.depth, blurred, atol=1e-3)


def test_another_shape_lies_on_this_face(ball):
    """Its normals are its own, not those of the mesh as it is stretched."""
    landmarks, truth, face = ball
    wide = Landmarks(landmarks.points * [2, 2, 2] + [7, 9, 3])
    there = face_shape(landmarks, face.shape, of=wide)
    assert between(there.normals, truth)[face].max() < 3


@given(st.integers(0, 2**32 - 1))
def test_a_plane_has_one_normal(seed):
    random = np.random.default_rng(seed)
    slope = random.uniform(-2, 2, 2)
    xy = random.uniform(0, 30, (20, 2))
    normals = face_shape(Landmarks(np.column_stack([xy, xy @ slope + 5])), (30, 30)).normals
    wanted = np.append(slope, -1) / np.sqrt(slope @ slope + 1)
    np.testing.assert_allclose(normals, np.broadcast_to(wanted, normals.shape), atol=1e-4)


def test_points_without_depth_are_round(ball):
    landmarks, truth, face = ball
    shape = face_shape(Landmarks(landmarks.xy), face.shape)
    inner = face & (np.hypot(*(np.indices(face.shape) - 50)) < 20)
    assert between(shape.normals, truth)[inner].mean() < 15
    assert with_depth(Landmarks(landmarks.xy))[:, 2].min() < 0


def test_twins_and_faces_of_three_points_have_normals():
    for points in ([[2, 2], [20, 2], [11, 20]], [[2, 2, 0], [20, 2, 0], [11, 20, 0], [11, 20, 0]]):
        assert np.isfinite(face_shape(Landmarks(points), (24, 24)).normals).all()


def test_a_nose_looks_to_both_sides():
    photo = read_image(sample("reference")).pixels
    found = detect_landmarks(photo)
    normals = face_shape(found, photo.shape).normals
    (x, y), eyes = found.xy[4], found.interocular_distance
    left, right = (normals[int(y - 0.1 * eyes), int(x + side * 0.2 * eyes), 0] for side in (-1, 1))
    assert left < -0.3
    assert right > 0.3
    assert normals[int(y), int(x), 2] == pytest.approx(-1, abs=0.2)
