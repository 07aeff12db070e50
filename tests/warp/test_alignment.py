"""The warp against maps that are known."""

import os
import subprocess
import sys

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter
from skimage import data
from skimage.transform import AffineTransform, warp

from relit.errors import ImageError, LandmarkError, OptionError
from relit.face.landmarks import Landmarks
from relit.warp.alignment import MAP_TOLERANCE, align, lay_over
from relit.warp.similarity import fit_similarity


def photo(channels=1):
    image = data.astronaut()[:240, 100:340]
    return image if channels == 3 else image[..., 1].copy()


def test_identical_landmarks_give_the_reference_back(face_points):
    face = Landmarks(face_points + 40)
    for image in (photo(), photo(3), photo().astype(np.uint16) * 257, photo() / 255):
        np.testing.assert_allclose(align(image, face, face, image.shape).warped, image, atol=1e-6)


@pytest.mark.parametrize("kernel", ["thin_plate_spline", "multiquadric", "gaussian"])
@pytest.mark.parametrize("affine", [True, False])
def test_landmarks_land_on_their_partners_with_smoothing_0(face_points, kernel, affine):
    rng = np.random.default_rng(0)
    target, reference = (
        Landmarks(face_points + 40),
        Landmarks(face_points * 0.9 + 50 + rng.normal(0, 1, (68, 2))),
    )
    alignment = align(
        photo(), reference, target, (200, 210), kernel=kernel, affine=affine, smoothing=0, dtype=np.uint8
    )
    assert np.abs(alignment.interpolant(target.xy) - reference.xy).max() < 1e-6
    assert alignment.warped.shape == (200, 210)


def test_a_similarity_of_the_landmarks_is_the_similarity_of_the_image(face_points):
    image = gaussian_filter(photo().astype(float) / 255, 1.5)
    known = AffineTransform(scale=0.95, rotation=0.15, translation=(12, -6))
    target = Landmarks(face_points + np.array([60, 70]))
    alignment = align(image, Landmarks(known(target.xy)), target, image.shape)
    expected = warp(image, known, order=3, mode="edge")
    np.testing.assert_allclose(alignment.warped, expected, atol=0.01)
    y, x = np.mgrid[: image.shape[0], : image.shape[1]]
    np.testing.assert_allclose(
        alignment.map, known(np.column_stack([x.ravel(), y.ravel()])).reshape(240, 240, 2), atol=1e-3
    )
    inside = ((alignment.map >= -0.5) & (alignment.map <= 239.5)).all(axis=-1)
    np.testing.assert_array_equal(alignment.inside, inside)
    assert not inside.all()
    assert alignment.folded == 0


def test_a_larger_reference_is_blurred_before_it_is_shrunk(face_points):
    stripes = np.tile(np.array([0.0, 1.0]), (480, 240))
    small = Landmarks(face_points + 40)
    shrunk = align(stripes, Landmarks(small.xy * 2), small, (240, 240)).warped[20:-20, 20:-20]
    assert np.abs(shrunk - 0.5).max() < 0.2  # unblurred, the pattern aliases to values anywhere in [0, 1]


def test_smoothing_rises_until_nothing_folds(face_points):
    rng = np.random.default_rng(1)
    target = Landmarks(face_points + 40)
    reference = Landmarks(target.xy + rng.normal(0, 4, (68, 2)))
    exact = align(photo(), reference, target, photo().shape, smoothing=0)
    assert exact.folded > 0
    default = align(photo(), reference, target, photo().shape)
    assert default.folded == 0
    assert default.smoothing > 1e-3


@pytest.mark.slow
@pytest.mark.rotating
def test_folds_in_a_small_face_on_a_large_photo_are_seen():
    grid = np.stack(np.meshgrid(np.arange(5), np.arange(5)), axis=-1).reshape(-1, 2) * 12.0 + 1500
    swapped = grid.copy()
    swapped[[11, 12]] = swapped[[12, 11]]
    photo_ = np.zeros((3000, 3000), np.uint8)
    assert align(photo_, Landmarks(swapped), Landmarks(grid), photo_.shape, smoothing=0).folded > 0.01
    default = align(photo_, Landmarks(swapped), Landmarks(grid), photo_.shape)
    assert default.folded == 0
    assert default.smoothing > 1e-3


def test_values_stay_within_the_references():
    edge = np.full((60, 60), 0.2)
    edge[:, 30:] = 0.8
    face = Landmarks([[10, 10], [50, 12], [30, 30], [20, 50], [45, 48]])
    warped = align(edge, face.shifted(0.4, 0.3), face, edge.shape).warped
    assert warped.min() >= np.float32(0.2)
    assert warped.max() <= np.float32(0.8)


def test_anchors_keep_their_distance_from_a_face_at_the_frame(face_points):
    # A point in the very corner moves; an anchor in the same corner would have to stay.
    corner = np.vstack([face_points, [[0, 0]]])
    moved = corner + np.vstack([np.zeros((68, 2)), [[6, -4]]])
    alignment = align(
        photo()[:130, :130], Landmarks(moved + np.array([0, 4])), Landmarks(corner), (130, 130), smoothing=0
    )
    assert np.abs(alignment.interpolant(corner) - moved - np.array([0, 4])).max() < 1e-6
    assert alignment.folded == 0


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="BLAS has one thread there")
@pytest.mark.rotating
def test_the_map_does_not_depend_on_the_threads_of_blas():
    code = """
import hashlib, numpy as np
from relit.warp.alignment import MAP_TOLERANCE, align, lay_over
from relit.face.landmarks import Landmarks
rng = np.random.default_rng(0)
points = rng.random((160, 2)) * 300 + 50
moved = points + rng.normal(0, 2, points.shape)
alignment = align(np.zeros((400, 400)), moved, points, (400, 400))
print(hashlib.sha256(alignment.map.tobytes() + alignment.interpolant.coefficients.tobytes()).hexdigest())
"""
    sums = {
        subprocess.check_output(
            [sys.executable, "-c", code], env=os.environ | {"OPENBLAS_NUM_THREADS": threads}
        )
        for threads in ("1", "2", "3")
    }
    assert len(sums) == 1


def test_arguments_are_checked_by_name(face_points):
    face = face_points + 40
    with pytest.raises(ImageError, match="reference: expected shape"):
        align(np.zeros((99, 99, 5), np.uint8), face, face, (99, 99))
    with pytest.raises(LandmarkError, match="target_landmarks: expected"):
        align(photo(), face, "face", (240, 240))
    with pytest.raises(OptionError, match="shape: expected"):
        align(photo(), face, face, (240,))
    np.testing.assert_array_equal(align(photo(), face.tolist(), face, (240, 240)).warped, photo())


def test_faces_that_fill_the_frame_do_not_fold(face_points):
    cropped = photo()[:110, :110]
    target = Landmarks(face_points - [6, 2])
    alignment = align(cropped, Landmarks(target.xy + np.array([2, -1])), target, cropped.shape)
    assert alignment.folded == 0


def test_dtype_is_converted_to_the_targets(face_points):
    face = Landmarks(face_points + 40)
    warped = align(photo(), face, face, (240, 240), dtype=np.uint16).warped
    np.testing.assert_array_equal(warped, photo().astype(np.uint16) * 257)


def test_landmarks_that_do_not_pair_or_fit_are_refused(face_points):
    face = Landmarks(face_points + 40)
    with pytest.raises(LandmarkError, match="must pair up"):
        align(photo(), Landmarks(face_points[:50] + 40), face, (240, 240))
    with pytest.raises(LandmarkError, match=r"reference_landmarks: .* outside the 100x100 image"):
        align(photo()[:100, :100], face, face, (240, 240))
    with pytest.raises(LandmarkError, match=r"target_landmarks: .* outside the 100x100 image"):
        align(photo(), face, face, (100, 100))


def test_similarity_is_the_least_squares_one():
    rng = np.random.default_rng(2)
    source, destination = rng.random((2, 30, 2))
    fitted = fit_similarity(source, destination)
    # Normal equations of [[a, -b], [b, a]] x + t, solved in the open.
    x, y = source.T
    system = np.vstack(
        [
            np.column_stack([x, -y, np.ones(30), np.zeros(30)]),
            np.column_stack([y, x, np.zeros(30), np.ones(30)]),
        ]
    )
    a, b, *shift = np.linalg.lstsq(system, destination.T.ravel(), rcond=None)[0]
    np.testing.assert_allclose(fitted.linear, [[a, -b], [b, a]], atol=1e-12)
    np.testing.assert_allclose(fitted.shift, shift, atol=1e-12)


@pytest.mark.parametrize("scale", [20, 60])
@pytest.mark.parametrize("tolerance", [MAP_TOLERANCE, 0.25])
def test_a_reference_that_is_far_larger_is_seen_as_by_the_targets_pixels(scale, tolerance):
    rng, size = np.random.default_rng(scale), 24
    reference = gaussian_filter(rng.random((scale * size, scale * size)), scale / 3).astype(np.float32)
    reference = (reference - reference.min()) / np.ptp(reference)
    points = np.array([[6.0, 6], [17, 6], [11, 11], [7, 17], [16, 17]])
    there = (points + 0.5) * scale - 0.5
    made = lay_over(reference, Landmarks(there), Landmarks(points), (size, size), tolerance=tolerance)
    assert made.scale == pytest.approx(scale)
    blurred = gaussian_filter(reference.astype(float), 0.5 * np.sqrt(scale**2 - 1), mode="nearest")
    middle = (np.arange(4, size - 4) + 0.5) * scale - 0.5
    expected = blurred[np.ix_(middle.round().astype(int), middle.round().astype(int))]
    seen = made.warped[4:-4, 4:-4]
    assert np.abs(seen - expected).max() < 0.02 * np.ptp(blurred)
