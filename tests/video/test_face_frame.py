"""The frame of a face moves with it: what is at a place of the face stays at one place of the frame."""

import numpy as np
import pytest

from relit.face.detect import detect_landmarks
from relit.video.face_frame import FaceFrame
from relit.video.steady import Steady
from relit.video.tracking import Track
from relit.warp.similarity import Similarity
from tests.video.clips import face


def track_of(faces, presence=None, starts=(0,)):
    points = np.stack(faces).astype(np.float32)
    count = len(points)
    return Track(
        pts=np.arange(count),
        times=np.arange(count) / 30,
        points=points,
        presence=np.ones(count, np.float32) if presence is None else np.array(presence, np.float32),
        yaw=np.zeros(count, np.float32),
        inside=np.ones(count, np.float32),
        starts=list(starts),
    )


@pytest.fixture(scope="module")
def mesh():
    return np.asarray(detect_landmarks(face(256)).points)


def turned(points, angle, scale, shift):
    cos, sin = scale * np.cos(angle), scale * np.sin(angle)
    move = Similarity(np.array([[cos, -sin], [sin, cos]]), np.array(shift, float))
    return np.column_stack([move(points[:, :2]), scale * points[:, 2]])


def test_a_face_that_only_moves_keeps_its_place(mesh):
    faces = [turned(mesh, 0.02 * k, 1 + 0.01 * k, (3 * k, k)) for k in range(9)]
    frame = FaceFrame.of(track_of(faces))
    for one in faces:
        placed = frame.placed(one)
        assert np.abs(placed.bend).max() < 0.05
        assert placed.lying(frame.template[:, :2]) == pytest.approx(one[:, :2], abs=0.1)


def test_planes_come_back(mesh):
    face_frame = FaceFrame.of(track_of([mesh, mesh]))
    bent = mesh.copy()
    bent[:, 0] += 6 * np.sin(mesh[:, 1] / 40)
    placed = face_frame.placed(turned(bent, 0.1, 0.9, (20, 5)))
    y, x = np.mgrid[:256, :256].astype(np.float32)
    planes = np.stack([np.sin(x / 30), np.cos(y / 25), x / 100], axis=-1)
    taken = placed.taken(planes, 1, (0, 0))
    back = placed.laid(taken, (256, 256), 1, (0, 0))
    inside = np.s_[60:200, 60:200]
    assert np.abs(back - planes)[inside].max() < 0.02


def test_a_view_is_a_part_reduced(mesh):
    placed = FaceFrame.of(track_of([mesh])).placed(mesh)
    y, x = np.mgrid[:256, :256].astype(np.float32)
    whole = placed.taken(np.stack([x, y], axis=-1), 1, (0, 0))
    small = np.stack([x, y], axis=-1)[20:220, 40:240].reshape(100, 2, 100, 2, 2).mean(axis=(1, 3))
    part = placed.taken(small, 2, (40, 20))
    middle = np.s_[90:150, 130:200]  # of which the part shows all
    assert np.abs(part - whole)[middle].max() < 0.05


def test_a_face_that_moves_evenly_is_not_late(mesh):
    faces = [mesh + np.array([4.0 * k, -2.0 * k, 0]) for k in range(21)]
    track = track_of(faces)
    frame = FaceFrame.of(track)
    for number in (0, 1, 10, 20):
        assert Steady(track, frame).landmarks(number).points == pytest.approx(faces[number], abs=0.01)


def test_jitter_gets_less(mesh):
    noise = np.random.default_rng(0)
    faces = [mesh + noise.normal(0, 0.5, mesh.shape) for _ in range(41)]
    track = track_of(faces)
    frame = FaceFrame.of(track)
    steady = Steady(track, frame)
    smooth = [steady.landmarks(number).xy for number in range(10, 31)]
    assert np.std(smooth, axis=0).mean() < 0.15


def test_a_frame_without_a_face_is_read_off_those_around(mesh):
    faces = [mesh + np.array([5.0 * k, 0, 0]) for k in range(9)]
    presence = [1, 1, 1, 1, 0, 1, 1, 1, 1]
    track = track_of([mesh if k == 4 else one for k, one in enumerate(faces)], presence)
    frame = FaceFrame.of(track)
    assert Steady(track, frame).landmarks(4).points == pytest.approx(faces[4], abs=0.01)


def test_another_shot_does_not_count(mesh):
    faces = [mesh + np.array([60.0 * (k >= 5), 0, 0]) for k in range(10)]
    track = track_of(faces, starts=(0, 5))
    frame = FaceFrame.of(track)
    for number in (4, 5):
        assert Steady(track, frame).landmarks(number).points == pytest.approx(faces[number], abs=0.01)


def test_changes_come_and_go_with_the_face(mesh):
    presence = [1.0] * 30 + [0.0] * 10 + [1.0] * 30
    shares = track_of([mesh] * 70, presence).shares
    assert shares[0] == shares[-1] == 1
    assert (shares[30:40] == 0).all()
    assert (np.abs(np.diff(shares)) <= 1 / 30 / 0.3 + 1e-9).all()
    blink = track_of([mesh] * 30, [1.0] * 14 + [0.0] * 2 + [1.0] * 14).shares
    assert (blink == 1).all()
