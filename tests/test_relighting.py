"""The transfer: the paper's equation, its special cases, and what may be given."""

import numpy as np
import pytest
from skimage import data

from relit.errors import FaceNotFoundError, ImageError, LandmarkError, OptionError
from relit.face.landmark_files import read_landmarks
from relit.face.landmarks import Landmarks
from relit.face.outline import face_outline
from relit.photo.photo import Photo
from relit.photo.pixels import DARKEST
from relit.photo.reading import read_image
from relit.relighting import transfer
from relit.settings.options import TransferOptions


@pytest.fixture
def target():
    return data.astronaut()[20:180, 140:300]


@pytest.fixture
def reference():
    return np.ascontiguousarray(data.astronaut()[20:180, 140:300][:, ::-1][:, :, ::-1])


@pytest.fixture
def face(face_points):
    return face_points * 0.9 + [26, 40]


def given(face):
    return {"target_landmarks": face, "reference_landmarks": face}


def test_a_photo_as_its_own_reference_comes_back(target, face):
    for options in ({}, {"mask": False}, {"neighborhood": 8, "lam": 0.5, "mask": False}):
        result = transfer(target, target, **given(face), method="ltv", **options)
        np.testing.assert_allclose(result.image, target, atol=1)


def test_the_result_is_the_references_u_times_the_targets_v(target, reference, face):
    result = transfer(target, reference, **given(face), mask=False, method="ltv")
    product = result.first.reference_split.u * result.first.target_split.v
    # u·v is often half way between two grey levels.
    np.testing.assert_allclose(result.image, np.clip(product, 0, 1) * 255, atol=0.501)
    np.testing.assert_allclose(
        result.first.reference_split.u * result.first.reference_split.v,
        np.maximum(result.first.alignment.warped / 255, DARKEST),
        rtol=1e-5,
    )
    np.testing.assert_allclose(
        result.first.target_split.u * result.first.target_split.v,
        np.maximum(target / 255, DARKEST),
        rtol=1e-5,
    )
    assert result.first.target_split.lam == pytest.approx(
        0.2 * 100 / result.target_landmarks.interocular_distance
    )


def test_a_flat_target_shows_the_light_alone(face):
    ramp = np.tile(np.linspace(40, 220, 160).astype(np.uint8), (160, 1))
    result = transfer(np.full((160, 160), 77, np.uint8), ramp, **given(face), mask=False, method="ltv")
    np.testing.assert_array_equal(result.image, np.rint(result.first.reference_split.u * 255))
    np.testing.assert_allclose(result.image[80, 20:140], ramp[80, 20:140], atol=8)


def test_the_mask_keeps_the_rest_and_changes_the_face(target, reference, face):
    result = transfer(target, reference, **given(face))
    weight = np.zeros(target.shape[:2])
    weight[result.window] = result.mask
    np.testing.assert_array_equal(result.image[weight == 0], target[weight == 0])
    assert np.abs(result.image[weight == 1].astype(int) - target[weight == 1]).mean() > 3
    assert 0.1 < (weight > 0).mean() < 0.9


@pytest.mark.parametrize("options", [{"method": "ltv"}, {"method": "shading", "exposure": "take"}])
def test_working_on_the_region_alone_changes_next_to_nothing_in_the_face(target, reference, face, options):
    # No four points on a circle: how these are joined to triangles is a matter of rounding.
    small = face * 0.5 + 30 + np.random.default_rng(0).normal(0, 0.05, face.shape)
    within = transfer(target, reference, **given(small), **options)
    whole = transfer(target, reference, **given(small), mask=False, **options)
    core = within.mask == 1
    assert within.mask.shape != target.shape[:2]
    # What the method finds; with a mask, it is then carried on over brows, eyes and lips.
    relit = [np.exp(one.first.change) * np.atleast_3d(target)[within.window] for one in (within,)]
    relit.append((np.exp(whole.first.change) * target)[within.window])
    assert np.abs(np.clip(relit[0], 0, 255) - np.clip(relit[1], 0, 255))[core].mean() < 0.5
    # What lies just outside the outline counts: without it, u would end at the outline.
    outline = face_outline(within.target_landmarks)
    margin = 0.7 * within.target_landmarks.interocular_distance
    rows, columns = within.window
    assert rows.start <= max(outline[:, 1].min() - margin, 0)
    assert columns.stop >= min(outline[:, 0].max() + margin, target.shape[1])


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.float32, np.float64])
def test_dtype_and_shape_are_the_targets(target, reference, face, dtype):
    scale = {"u": np.iinfo(dtype).max if np.dtype(dtype).kind == "u" else 1, "f": 1}[np.dtype(dtype).kind]
    deep = (target / 255 * scale).round(12).astype(dtype)
    result = transfer(deep, reference[:150], **given(face))
    assert result.image.dtype == dtype
    assert result.image.shape == target.shape
    eight = transfer(target, reference[:150], **given(face))
    np.testing.assert_allclose(result.image / scale, eight.image / 255, atol=0.06)
    assert np.abs(result.image / scale - eight.image / 255).mean() < 0.004


@pytest.mark.parametrize(
    ("method", "space"), [("shading", "rgb"), ("ltv", "rgb"), ("ltv", "hsv"), ("ltv", "ycbcr")]
)
def test_a_grey_target_becomes_coloured(target, reference, face, method, space):
    grey = target.mean(axis=2).astype(np.uint8)
    result = transfer(grey, reference, **given(face), method=method, color_space=space)
    assert result.image.shape == (*grey.shape, 3)
    weight = np.zeros(grey.shape)
    weight[result.window] = result.mask
    np.testing.assert_array_equal(result.image[weight == 0], np.repeat(grey[weight == 0][:, None], 3, axis=1))
    inside = result.image[weight == 1].astype(int)
    assert np.ptp(inside, axis=1).mean() > 10


@pytest.mark.parametrize("space", ["rgb", "hsv", "ycbcr"])
@pytest.mark.parametrize("method", ["shading", "ltv"])
def test_a_colour_target_keeps_its_colour_under_a_grey_reference(target, reference, face, method, space):
    grey = reference.mean(axis=2).astype(np.uint8)
    result = transfer(target, grey, **given(face), method=method, color_space=space)
    weight = np.zeros(target.shape[:2])
    weight[result.window] = result.mask
    before, after = target[weight == 1] / 255, result.image[weight == 1] / 255
    shares = [colors / np.maximum(colors.sum(axis=1, keepdims=True), 0.05) for colors in (before, after)]
    assert np.abs(shares[0] - shares[1]).mean() < 0.03
    assert np.abs(result.image[weight == 1].astype(int) - target[weight == 1]).mean() > 2


@pytest.mark.slow
@pytest.mark.rotating
def test_extremes_give_no_nan_and_stay_in_range(face):
    black, white = np.zeros((160, 160), np.uint8), np.full((160, 160), 255, np.uint8)
    speckled = np.where(np.random.default_rng(0).random((160, 160)) < 0.5, black, white)
    for first in (black, white, speckled):
        for second in (black, white, speckled):
            for lam in (0.01, 0.2, 5):
                assert np.isfinite(transfer(first, second, **given(face), lam=lam).relit).all()
                result = transfer(first, second, **given(face), lam=lam, method="ltv")
                assert np.isfinite(result.relit).all()
                for split in (result.first.target_split, result.first.reference_split):
                    assert np.isfinite(split.u).all()
                    assert np.isfinite(split.v).all()
    whole = {**given(face), "mask": False, "method": "ltv"}
    np.testing.assert_array_equal(transfer(black, white, **whole).image, 255)
    assert transfer(white, black, **whole).image.max() <= 1


def test_landmarks_may_be_arrays_lists_or_landmarks(target, reference, face):
    plain = transfer(target, reference, **given(face), method="ltv").image
    for landmarks in (face.tolist(), Landmarks(face), np.column_stack([face, np.zeros(68)])):
        result = transfer(target, reference, **given(landmarks), method="ltv")
        assert result.target_landmarks.scheme == "ibug68"
        np.testing.assert_array_equal(result.image, plain)


def test_options_object_and_keywords_agree(target, reference, face):
    options = TransferOptions(lam=0.6, neighborhood=8)
    one = transfer(target, reference, **given(face), options=options, mask=False)
    other = transfer(target, reference, **given(face), lam=0.6, neighborhood=8, mask=False)
    np.testing.assert_array_equal(one.image, other.image)
    assert one.options == other.options == options.changed(mask=False)


def test_landmarks_far_from_the_outline_are_worked_with(portraits):
    photo = read_image(portraits / "005_03.jpg").pixels[::3, ::3].copy()
    points = read_landmarks(portraits / "005_03.tem").points / 3
    points[151, 1] = 5  # the top of very high hair
    result = transfer(photo, photo, target_landmarks=points, reference_landmarks=points, method="ltv")
    assert result.target_landmarks.scheme == "frl189"
    np.testing.assert_allclose(result.image, photo, atol=1)


def test_inputs_are_left_alone(target, reference, face):
    copies = target.copy(), reference.copy()
    transfer(target, reference, **given(face))
    np.testing.assert_array_equal(target, copies[0])
    np.testing.assert_array_equal(reference, copies[1])


def test_same_input_gives_the_same_bytes(target, reference, face):
    first, second = (transfer(target, reference, **given(face)).image.tobytes() for _ in range(2))
    assert first == second


def test_photos_may_be_given(target, reference, face):
    from PIL import ImageCms

    srgb = ImageCms.ImageCmsProfile(ImageCms.createProfile("sRGB")).tobytes()
    plain = transfer(target, reference, **given(face)).image
    result = transfer(Photo(target), Photo(reference, profile=srgb), **given(face))
    np.testing.assert_allclose(result.image.astype(int), plain, atol=3)


def test_detected_landmarks_are_used_by_default(target, reference):
    result = transfer(target, reference)
    assert result.target_landmarks.scheme == result.reference_landmarks.scheme == "mesh478"
    assert result.target_landmarks.confidence > 0.9


def test_wrong_arguments_are_refused_by_name(target, reference, face):
    with pytest.raises(ImageError, match=r"^target: expected shape"):
        transfer(np.dstack([target, target]), reference, **given(face))
    with pytest.raises(ImageError, match=r"^reference: 1x1 px cannot hold a face"):
        transfer(target, reference[:1, :1], **given(face))
    with pytest.raises(FaceNotFoundError, match=r"^reference: no face found"):
        transfer(target, np.zeros((64, 64), np.uint8), target_landmarks=face)
    with pytest.raises(LandmarkError, match="must pair up"):
        transfer(target, reference, target_landmarks=face, reference_landmarks=face[:50])
    with pytest.raises(LandmarkError, match=r"^target_landmarks: expected shape"):
        transfer(target, reference, target_landmarks=face[0], reference_landmarks=face)
    with pytest.raises(LandmarkError, match=r"^reference_landmarks: .*another image"):
        transfer(target, reference, target_landmarks=face, reference_landmarks=face + 100)
    with pytest.raises(OptionError, match=r"^lam"):
        transfer(target, reference, **given(face), lam=0)
    with pytest.raises(OptionError, match=r"^strenght: no such option"):
        transfer(target, reference, **given(face), strenght=1)
