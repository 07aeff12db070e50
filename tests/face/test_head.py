"""The template head, laid on faces whose pose is known, and on photos."""

import numpy as np
import pytest
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from relit.face.detect import detect_landmarks
from relit.face.head import fitted, has_head, pose, seen_head, turn_between
from relit.face.landmarks import Landmarks
from relit.face.shape import head_shape
from relit.face.template_head import template_head, vertex_normals
from relit.photo.reading import read_image
from relit.photo.samples import sample

TURNS = [(0, 0, 0), (30, 10, 0), (-75, 0, 0), (75, -15, 20), (10, 25, 90), (-20, 0, 180), (0, -30, -135)]


def turned(yaw=0.0, pitch=0.0, roll=0.0):
    return Rotation.from_euler("yxz", [yaw, pitch, roll], degrees=True).as_matrix().T


def face_of(template, turn, scale=40.0, to=(100.0, 90.0, 7.0)):
    """Landmarks of the template itself, turned; those that it does not know lie where others do."""
    rows = np.abs(np.arange(478)[:, None] - template.rows).argmin(axis=1)
    points = template.landmarks[rows] @ turn * scale + to
    points[468:] += np.linspace(0, 0.1, 30).reshape(10, 3)
    return Landmarks(points)


def test_the_template_is_a_symmetric_closed_front():
    head = template_head()
    distance, twin = cKDTree(head.vertices).query(head.vertices * [-1, 1, 1])
    assert distance.max() < 1e-9
    normals = vertex_normals(head.vertices, head.triangles)
    np.testing.assert_allclose(normals[twin] * [-1, 1, 1], normals, atol=1e-6)
    # From every side that a face is seen from, it has no holes.
    for turn in TURNS[:3]:
        face = face_of(head, turned(*turn))
        shape = head_shape(face, (200, 200))
        assert shape.head[shape.inside].mean() > 0.97


def test_landmarks_lie_on_the_template_the_left_ones_on_the_left():
    head = template_head()
    assert cKDTree(head.vertices).query(head.landmarks)[0].max() < 0.15
    place = dict(zip(head.rows.tolist(), head.landmarks, strict=True))
    tip = head.vertices[np.abs(head.vertices[:, 0]) < 0.3][:, 2].min()
    assert place[4][2] == pytest.approx(tip, abs=0.1)
    assert place[263][0] > 0.4 > -0.4 > place[33][0]
    assert place[152][1] > place[13][1] > place[4][1] > place[10][1]


@pytest.mark.parametrize("turn", TURNS)
def test_a_known_pose_is_found_again(turn):
    head = template_head()
    truth = turned(*turn) * 40
    found, origin = pose(head.landmarks, head.landmarks @ truth + [100, 90, 7])
    np.testing.assert_allclose(found, truth, atol=1e-6)
    np.testing.assert_allclose(origin, [100, 90, 7], atol=1e-6)
    vertices = fitted(face_of(head, turned(*turn)))
    np.testing.assert_allclose(vertices, head.vertices @ truth + [100, 90, 7], atol=1e-6)


def test_a_head_that_differs_as_heads_do_is_found_again():
    """Of the way that a head differs from the mean, where landmarks show it, most is found, depth and all."""
    head = template_head()
    kind = np.random.default_rng(5).normal(0, 1, len(head.modes))
    turn = turned(15, -5) * 100
    marks = head.landmarks + np.tensordot(kind, head.landmark_modes, 1)
    truth = (head.vertices + np.tensordot(kind, head.modes, 1)) @ turn
    points = np.zeros((478, 3))
    points[head.rows] = marks @ turn
    found = fitted(Landmarks(points + 300)) - 300
    mean = head.vertices @ turn
    near = cKDTree(head.landmarks).query(head.vertices)[0] < 0.1
    off, before = (
        np.linalg.norm(one - truth - (one - truth)[near].mean(axis=0), axis=1) for one in (found, mean)
    )
    assert off[near].mean() < 0.35 * before[near].mean()


@pytest.mark.parametrize(("yaw", "kept"), [(0, 1), (12, 1), (25, 0.5), (40, 0), (-40, 0), (-12, 1)])
def test_light_goes_with_a_head_that_is_turned_far(yaw, kept):
    """What share of a turn the light does not make: all of a small one, none of a large one."""
    head = template_head()
    frontal, other = face_of(head, turned()), face_of(head, turned(yaw))
    turn = turn_between(frontal, other)
    np.testing.assert_allclose(turn @ turn.T, np.eye(3), atol=1e-9)
    nose = np.array([0, 0, -1]) @ turn
    angle = np.degrees(np.arctan2(nose[0], -nose[2]))
    wanted = (np.array([0, 0, -1]) @ turned(yaw)) if yaw else np.array([0, 0, -1])
    assert angle == pytest.approx((1 - kept) * np.degrees(np.arctan2(wanted[0], -wanted[2])), abs=0.5)


def test_without_a_template_light_stays():
    points = Landmarks([[0, 0], [9, 0], [5, 9]])
    np.testing.assert_array_equal(turn_between(points, points), np.eye(3))


@pytest.mark.parametrize("turn", TURNS)
def test_the_picture_of_a_turned_head_shows_its_normals(turn):
    """At vertices that nothing hides, the normals are those of the turned template."""
    head = template_head()
    turn = turned(*turn)
    face = face_of(head, turn)
    seen = seen_head(face, (200, 200), face)
    vertices = head.vertices @ turn * 40 + [100, 90, 7]
    normals = vertex_normals(head.vertices, head.triangles) @ turn
    x, y = np.round(vertices[:, :2]).astype(int).T
    within = (x >= 0) & (x < 200) & (y >= 0) & (y < 200)
    index = np.flatnonzero(within & (normals[:, 2] < -0.5))
    near = np.abs(seen.surface[y[index], x[index], 3] - vertices[index, 2]) < 1.5
    index = index[near]
    assert len(index) > 400
    shown = seen.surface[y[index], x[index], :3]
    cosine = (shown / np.linalg.norm(shown, axis=1, keepdims=True) * normals[index]).sum(axis=1)
    assert np.median(np.rad2deg(np.arccos(cosine.clip(-1, 1)))) < 4


@pytest.mark.parametrize("role", ["target", "reference"])
def test_landmarks_of_the_head_land_on_those_of_the_photo(role):
    photo = read_image(sample(role)).pixels
    face = detect_landmarks(photo)
    head = template_head()
    vertices = fitted(face)
    # The vertex next to a landmark on the template is next to it in the photo as well.
    distance, vertex = cKDTree(head.vertices).query(head.landmarks)
    near = distance < 0.03
    off = np.linalg.norm(vertices[vertex[near], :2] - face.xy[head.rows[near]], axis=1)
    assert np.median(off) < 0.03 * face.interocular_distance
    assert off.max() < 0.15 * face.interocular_distance


def test_of_another_head_the_normals_are_its_own():
    """A turned head laid over a frontal one shows, where the nose is, the turned normals of that nose."""
    head = template_head()
    front, turn = face_of(head, turned()), turned(30)
    both = seen_head(front, (200, 200), face_of(head, turn))
    alone = seen_head(front, (200, 200), front)
    np.testing.assert_array_equal(both.head, alone.head)
    wanted = alone.surface[..., :3] @ turn
    surely = both.head & (wanted[..., 2] < -0.1) & (alone.surface[..., 2] < -0.01)
    np.testing.assert_allclose(both.surface[surely][:, :3], wanted[surely], atol=1e-3)


def test_other_landmarks_keep_their_mesh():
    photo = read_image(sample("target")).pixels
    face = detect_landmarks(photo)
    assert has_head(face)
    flat = Landmarks(face.xy)
    assert not has_head(flat)
    assert not has_head(Landmarks(face.points[:100]))
    assert head_shape(face, photo.shape).head.sum() > 1.3 * head_shape(flat, photo.shape).head.sum()


def test_a_face_beyond_the_frame_has_a_shape():
    head = template_head()
    shape = head_shape(face_of(head, turned(), to=(5000, 5000, 0)), (40, 40))
    assert np.isfinite(shape.normals).all()
    assert not shape.head.any()
