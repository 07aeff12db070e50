from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from relit.errors import LandmarkError
from relit.face.landmarks import Landmarks, as_landmarks, check_inside, check_pair, control_rows
from relit.face.schemes import SCHEMES

PORTRAITS = Path(__file__).parents[3] / "shared" / "portraits"
TRIANGLE = [[10.0, 20.0], [50.0, 20.0], [30.0, 60.0]]


def scattered(scheme: str, dimensions: int = 2) -> np.ndarray:
    count = SCHEMES[scheme].count or 9
    return np.random.default_rng(count).uniform(0, 100, (count, dimensions))


# --- construction


def test_points_are_a_read_only_copy():
    given_points = np.array(TRIANGLE)
    landmarks = Landmarks(given_points)
    given_points[:] = 0
    assert landmarks.points.tolist() == TRIANGLE
    assert landmarks.points.dtype == Landmarks(np.array(TRIANGLE, np.float32)).points.dtype == np.float64
    with pytest.raises(ValueError, match="read-only"):
        landmarks.points[0, 0] = 1
    with pytest.raises(dataclasses.FrozenInstanceError):
        landmarks.scheme = "points"


def test_xy_leaves_the_depth_out():
    landmarks = Landmarks([[*xy, z] for xy, z in zip(TRIANGLE, (1, 2, 3), strict=True)])
    assert landmarks.xy.tolist() == TRIANGLE
    assert landmarks.points[:, 2].tolist() == [1, 2, 3]


@pytest.mark.parametrize(
    ("points", "message"),
    [
        (None, r"expected shape \(n, 2\) or \(n, 3\), got \(\)"),
        ([1, 2, 3], r"got \(3,\)"),
        ([[1], [2], [3]], r"got \(3, 1\)"),
        ([[1, 2, 3, 4]] * 3, r"got \(3, 4\)"),
        ([TRIANGLE], r"got \(1, 3, 2\)"),
        ([[1, 2], [3]], r"expected an \(n, 2\) or \(n, 3\) array of numbers"),
        ([["a", 2], [3, 4], [5, 7]], "could not convert string to float: 'a'"),
        (np.empty((0, 2)), "at least 3 points are needed, got 0"),
        (TRIANGLE[:2], "at least 3 points are needed, got 2"),
        ([[1, 2], [np.nan, 4], [5, 7], [8, np.inf]], "point 1, 3 is missing or not finite"),
        ([[1, 2, 0], [3, 4, -np.inf], [5, 7, 0]], "point 1 is missing or not finite"),
        ([[np.nan] * 2] * 9, r"point 0, 1, 2, 3, 4, \.\.\. is missing"),
        ([[5, 5]] * 4, "in one place"),
        ([[1, 1, 0], [2, 2, 9], [3, 3, 0]], "on one line"),
        ([[0, 0], [100, 0], [50, 1e-5]], "on one line"),
    ],
)
def test_unusable_points_are_refused(points, message):
    with pytest.raises(LandmarkError, match=f"^landmarks: .*{message}"):
        Landmarks(points)


@given(
    angle=st.floats(0, np.pi),
    along=st.lists(st.floats(-1000, 1000), min_size=3, max_size=8),
    start=st.tuples(st.floats(-1000, 1000), st.floats(-1000, 1000)),
)
def test_points_on_a_line_are_refused_and_a_point_off_it_saves_them(angle, along, start):
    direction = np.array([np.cos(angle), np.sin(angle)])
    points = np.array(start) + np.outer(along, direction)
    with pytest.raises(LandmarkError, match="on one line"):
        Landmarks(points)
    off = np.array([-direction[1], direction[0]])
    assert len(Landmarks([start, start + 20 * direction, start + 10 * direction + off])) == 3


# --- schemes


@pytest.mark.parametrize(
    ("count", "scheme"), [(478, "mesh478"), (68, "ibug68"), (189, "frl189"), (70, "points")]
)
def test_the_scheme_follows_from_the_number_of_points(count, scheme):
    points = np.random.default_rng(0).uniform(0, 100, (count, 2))
    assert Landmarks(points).scheme == scheme
    assert Landmarks(points, scheme).scheme == scheme
    assert Landmarks(points, "points").scheme == "points"


def test_a_scheme_that_does_not_fit_is_refused():
    with pytest.raises(LandmarkError, match="scheme ibug68 has 68 points, got 3"):
        Landmarks(TRIANGLE, "ibug68")
    with pytest.raises(
        LandmarkError, match="unknown scheme 'ibug'; expected one of mesh478, ibug68, frl189, points"
    ):
        Landmarks(TRIANGLE, "ibug")


@pytest.mark.parametrize("name", [name for name, scheme in SCHEMES.items() if scheme.count])
def test_a_scheme_speaks_of_its_own_rows(name):
    scheme = SCHEMES[name]
    for rows in (scheme.right_eye, scheme.left_eye, scheme.outline, *scheme.groups.values()):
        assert set(rows) <= set(range(scheme.count))
        assert len(set(rows)) == len(rows) > 0
    assert not set(scheme.right_eye) & set(scheme.left_eye)
    assert {*scheme.right_eye, *scheme.left_eye} <= set(scheme.groups["eyes"])


@pytest.mark.parametrize("name", SCHEMES)
def test_groups(name):
    landmarks = Landmarks(scattered(name), name)
    expected = {"points": tuple(range(9))} if name == "points" else SCHEMES[name].groups
    assert landmarks.groups == expected


@pytest.mark.skipif(not PORTRAITS.is_dir(), reason="the shared portraits are not beside this checkout")
@pytest.mark.parametrize("path", sorted(PORTRAITS.glob("*.tem")), ids=lambda path: path.stem)
def test_frl189_on_real_faces(path):
    landmarks = Landmarks(np.loadtxt(path, skiprows=1, max_rows=189))
    centre = {name: landmarks.xy[list(rows)].mean(axis=0) for name, rows in landmarks.groups.items()}
    assert centre["hairline"][1] < centre["brows"][1] < centre["eyes"][1] < centre["nose"][1]
    assert centre["nose"][1] < centre["mouth"][1] < centre["jaw"][1]
    scheme = SCHEMES["frl189"]
    right, left = landmarks.xy[scheme.right_eye[0]], landmarks.xy[scheme.left_eye[0]]
    assert right[0] < left[0]
    assert landmarks.interocular_distance == pytest.approx(np.hypot(*(left - right)))
    # Round the face in order: every step turns the same way as seen from the nose.
    spokes = landmarks.xy[list(scheme.outline)] - centre["nose"]
    following = np.roll(spokes, -1, axis=0)
    turns = spokes[:, 0] * following[:, 1] - spokes[:, 1] * following[:, 0]
    assert (turns > 0).all() or (turns < 0).all()


# --- interocular distance


@pytest.mark.parametrize("name", ["mesh478", "ibug68", "frl189"])
def test_interocular_distance_is_that_of_the_eye_centres(name):
    scheme = SCHEMES[name]
    points = scattered(name, 3)
    for rows, centre in ((scheme.right_eye, (20, 30, 5)), (scheme.left_eye, (50, 70, 17))):
        ring = np.random.default_rng(1).normal(0, 3, (len(rows), 3))
        points[list(rows)] = np.array(centre) + ring - ring.mean(axis=0)
    assert Landmarks(points[:, :2], name).interocular_distance == pytest.approx(50)
    assert Landmarks(points, name).interocular_distance == pytest.approx(np.sqrt(50**2 + 12**2))


def test_interocular_distance_of_plain_points_is_half_the_root_of_their_hull():
    square = [[0, 0], [60, 0], [60, 60], [0, 60], [30, 20]]
    assert Landmarks(square).interocular_distance == pytest.approx(30)


@pytest.mark.parametrize("name", SCHEMES)
@given(
    angle=st.floats(-np.pi, np.pi),
    scale=st.floats(0.1, 10),
    shift=st.tuples(st.floats(-500, 500), st.floats(-500, 500)),
)
def test_interocular_distance_scales_with_the_face_and_with_nothing_else(name, angle, scale, shift):
    cos, sin = scale * np.cos(angle), scale * np.sin(angle)
    points = scattered(name)
    moved = Landmarks(points @ np.array([[cos, sin], [-sin, cos]]) + shift, name)
    expected = scale * Landmarks(points, name).interocular_distance
    assert moved.interocular_distance == pytest.approx(expected, rel=1e-9)


# --- shifted, as_landmarks


@pytest.mark.parametrize("dimensions", [2, 3])
def test_shifted_moves_the_image_position_only(dimensions):
    landmarks = Landmarks(scattered("ibug68", dimensions), "points", 0.5)
    moved = landmarks.shifted(3, -7.5)
    assert moved.xy == pytest.approx(landmarks.xy + np.array([3, -7.5]))
    assert (moved.points[:, 2:] == landmarks.points[:, 2:]).all()
    assert (moved.scheme, moved.confidence) == ("points", 0.5)


def test_as_landmarks():
    landmarks = Landmarks(TRIANGLE)
    assert as_landmarks(landmarks, "target_landmarks") is landmarks
    assert as_landmarks(TRIANGLE, "target_landmarks").points.tolist() == TRIANGLE
    with pytest.raises(LandmarkError, match=r"^target_landmarks: at least 3 points"):
        as_landmarks(TRIANGLE[:2], "target_landmarks")


# --- control_rows


def test_the_mesh_is_aligned_by_its_features():
    rows = control_rows(Landmarks(scattered("mesh478")))
    groups = SCHEMES["mesh478"].groups
    assert 80 <= len(rows) <= 200
    assert (np.diff(rows) > 0).all()
    assert {*groups["oval"], *groups["eyes"], *groups["mouth"]} <= set(rows)
    assert not {*groups["inner_mouth"], *range(468, 478)} & set(rows)


@pytest.mark.parametrize("name", ["ibug68", "frl189", "points"])
def test_placed_points_are_all_used(name):
    landmarks = Landmarks(scattered(name), name)
    assert control_rows(landmarks).tolist() == list(range(len(landmarks)))


# --- check_inside


@pytest.mark.parametrize("shape", [(61, 51), (61, 51, 3)])
def test_points_may_lie_one_pixel_outside(shape):
    check_inside(Landmarks([[-1, -1], [51, 61], [30, 30]]), shape, "target_landmarks")


@pytest.mark.parametrize("point", [(-1.1, 30), (51.1, 30), (30, -1.1), (30, 61.1)])
def test_a_point_further_out_is_named(point):
    landmarks = Landmarks([[10, 20], [40, 20], [30, 40], point])
    message = (
        rf"^target_landmarks: 1 of 4 points lie outside the 51x61 image, for example "
        rf"point 3 at \({point[0]:.1f}, {point[1]:.1f}\)"
    )
    with pytest.raises(LandmarkError, match=message):
        check_inside(landmarks, (61, 51, 3), "target_landmarks")


@pytest.mark.parametrize("outside", [0, 1, 239, 240, 478])
def test_half_of_a_mesh_may_lie_outside(outside):
    points = np.random.default_rng(0).uniform(0, 100, (478, 2))
    points[:outside, 1] -= 200
    if outside <= 239:
        check_inside(Landmarks(points), (100, 100), "landmarks")
    else:
        with pytest.raises(LandmarkError, match=f"{outside} of 478 points"):
            check_inside(Landmarks(points), (100, 100), "landmarks")


# --- check_pair


def test_a_pair_of_one_scheme_and_size_passes():
    check_pair(Landmarks(scattered("ibug68")), Landmarks(scattered("ibug68", 3)))
    check_pair(Landmarks(TRIANGLE), Landmarks(TRIANGLE[::-1]))


@pytest.mark.parametrize(
    ("target", "reference"),
    [
        (Landmarks(scattered("ibug68")), Landmarks(scattered("ibug68"), "points")),
        (Landmarks(TRIANGLE), Landmarks([*TRIANGLE, [0, 0]])),
        (Landmarks(scattered("ibug68")), Landmarks(scattered("mesh478"))),
    ],
)
def test_faces_that_do_not_pair_up_are_refused(target, reference):
    message = (
        rf"target has {len(target)} points \({target.scheme}\), .* {len(reference)} \({reference.scheme}\)"
    )
    with pytest.raises(LandmarkError, match=message):
        check_pair(target, reference)


def test_one_place_cannot_go_to_two():
    doubled = Landmarks([*TRIANGLE, TRIANGLE[1]])
    spread = Landmarks([*TRIANGLE, [0, 0]])
    check_pair(doubled, doubled)
    check_pair(spread, doubled)  # two places may go to one
    with pytest.raises(LandmarkError, match="target_landmarks: points 1 and 3 are duplicates"):
        check_pair(doubled, spread)


@pytest.mark.parametrize(
    ("points", "options", "message"),
    [
        ([[10**400, 0], [1, 1], [5, 0]], {}, "expected an .* array of numbers"),
        ([[1.7e308, 0], [1.7e308, 5], [1, 1]], {}, "no pixel position"),
        ([[0, 0], [9, 0], [0, 9]], {"confidence": 7.0}, r"confidence must be in \[0, 1\], got 7.0"),
    ],
)
def test_absurd_values_are_refused(points, options, message):
    with pytest.raises(LandmarkError, match=message):
        Landmarks(points, **options)


def test_eyes_in_one_place_are_refused():
    points = np.random.default_rng(0).random((68, 2)) * 100
    points[36:48] = 50
    with pytest.raises(LandmarkError, match="eyes coincide"):
        Landmarks(points)


def test_faces_of_one_pixel_beside_those_of_a_photo_are_refused():
    points = scattered("mesh478", 3)
    for share, fine in ((1 / 100, True), (1 / 900, True), (1e-4, False), (1e-6, False)):
        target, reference = Landmarks(points * share + 50), Landmarks(points)
        for pair in ((target, reference), (reference, target)):
            if fine:
                check_pair(*pair)
                continue
            with pytest.raises(LandmarkError, match="one to be at most 1000 times as large") as told:
                check_pair(*pair)
            for landmarks in pair:
                assert f"{landmarks.interocular_distance:.3g}" in str(told.value)


def test_depth_does_not_hide_that_a_face_has_no_size():
    points = scattered("mesh478", 3)
    flat = points * [1e-5, 1e-5, 1] + 50
    assert Landmarks(flat).interocular_distance > 0.1 * Landmarks(points).interocular_distance
    with pytest.raises(LandmarkError, match="1000 times"):
        check_pair(Landmarks(flat), Landmarks(points))


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_points_far_from_their_image_are_refused(axis):
    points = 90 * scattered("mesh478", 3) / np.abs(scattered("mesh478", 3)).max()
    check_inside(Landmarks(points), (100, 100), "landmarks")
    points[33, axis] = 450
    with pytest.raises(LandmarkError, match="px is far from the 100x100 image"):
        check_inside(Landmarks(points), (100, 100), "landmarks")


def test_points_nearly_on_a_line_are_refused():
    points = 100 * np.random.default_rng(0).random((68, 2))
    Landmarks(points * [1, 0.05])
    with pytest.raises(LandmarkError, match="on one line, or nearly so"):
        Landmarks(points * [1, 0.005])
