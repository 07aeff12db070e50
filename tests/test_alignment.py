"""The warp against maps that are known."""

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter
from skimage import data
from skimage.transform import AffineTransform, warp

from relit.alignment import align, fit_similarity
from relit.errors import LandmarkError
from relit.landmarks import Landmarks


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
