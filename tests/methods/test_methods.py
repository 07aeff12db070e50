"""The baselines: each against the property that defines it, or another way to compute it."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from skimage import data
from skimage.exposure import match_histograms

from relit.compose.adjust import anchored
from relit.errors import ImageError, OptionError
from relit.face.landmarks import Landmarks
from relit.face.regions import FaceRegions
from relit.figures import contact_sheet, stage_pictures
from relit.ltv.decomposition import decompose
from relit.methods import RELIGHT, Scene
from relit.methods.baselines import wls
from relit.methods.baselines.quotient import correlation
from relit.methods.baselines.spherical_harmonics import harmonics
from relit.relighting import transfer
from relit.settings.methods import METHODS, WITH_SECOND_REFERENCE
from relit.settings.options import TransferOptions


def scene(target, reference, face=None, points=((10, 10), (30, 10), (20, 30)), lam=0.2):
    landmarks = Landmarks(np.array(points, float))
    regions = FaceRegions(landmarks, target.shape[:2])
    vars(regions)["interior"] = np.ones(regions.shape, bool) if face is None else face
    return Scene(target, reference, regions, landmarks, lam, TransferOptions(mask=False))


def relit(method, given):
    return anchored(RELIGHT[method](given), given.options)


@pytest.fixture(scope="module")
def pair():
    image = data.astronaut()
    return image[60:140, 180:250], image[160:240, 300:370]


def test_every_method_has_a_name_and_every_name_a_method():
    assert (
        tuple(METHODS) == tuple(RELIGHT) == TransferOptions.__dataclass_fields__["method"].metadata["choices"]
    )


@pytest.mark.parametrize("method", ["ltv", "log-gaussian", "wls"])
def test_splits_multiply_to_their_images_and_parts_are_swapped(method, pair):
    given = scene(*pair)
    result = relit(method, given)
    for split, image in ((result.target_split, pair[0]), (result.reference_split, pair[1])):
        np.testing.assert_allclose(split.u * split.v, np.maximum(image / 255, 0.5 / 255), rtol=1e-4)
    np.testing.assert_allclose(result.planes, result.reference_split.u * result.target_split.v, rtol=1e-6)


@pytest.mark.parametrize("method", ["ltv", "log-gaussian", "wls", "moments", "histogram"])
def test_a_photo_in_its_own_light_stays(method, pair):
    difference = relit(method, scene(pair[0], pair[0])).planes - np.maximum(pair[0] / 255, 0.5 / 255)
    if method == "wls":  # whose guided filter smooths even where guide and image are one
        assert np.abs(difference).mean() < 0.01
    else:
        assert np.abs(difference).max() < 3e-3


@pytest.mark.parametrize("lam", [1e-4, 1e-300])
def test_light_without_details_is_the_mean_of_log_intensity(pair, lam):
    target, reference = (image[..., 0] / 255 + 0.01 for image in pair)
    result = relit("log-gaussian", scene(target, reference, lam=lam))
    gain = np.exp(np.log(reference).mean() - np.log(target).mean())
    np.testing.assert_allclose(result.planes, target * gain, rtol=1e-4)


@pytest.mark.parametrize("method", ["log-gaussian", "wls"])
def test_exposure_comes_from_the_reference(method, pair):
    target, reference = pair[0][..., 0] / 255 + 0.01, pair[1][..., 0] / 510 + 0.01
    plain = relit(method, scene(target / 2, reference)).planes
    np.testing.assert_allclose(relit(method, scene(target / 4, reference)).planes, plain, rtol=1e-3)
    np.testing.assert_allclose(relit(method, scene(target / 2, reference / 2)).planes, plain / 2, rtol=1e-3)


def test_the_ltv_swap_is_the_papers_formula(pair):
    given = scene(*pair, lam=0.3)
    distance = given.face.interocular_distance
    u, v = (
        getattr(decompose(image, 0.3, interocular_distance=distance), part)
        for image, part in ((pair[1], "u"), (pair[0], "v"))
    )
    np.testing.assert_array_equal(relit("ltv", given).planes, u * v)


@given(seed=st.integers(0, 2**32 - 1), strength=st.floats(0.01, 50), width=st.integers(2, 6))
def test_weighted_least_squares_is_the_minimiser(seed, strength, width):
    """Against the energy itself: its gradient at the solution is 0, by finite differences."""
    random = np.random.default_rng(seed)
    f = random.normal(size=(5, width))

    def energy(u):
        total = ((u - f) ** 2).sum()
        for axis in (0, 1):
            weights = strength / (np.abs(np.diff(f, axis=axis)) ** 1.2 + 1e-4)
            total += (weights * np.diff(u, axis=axis) ** 2).sum()
        return total

    u = wls.smoothed(f, strength)
    for _ in range(5):
        step = 1e-3 * random.normal(size=f.shape)
        assert energy(u + step) + energy(u - step) >= 2 * energy(u)
        assert energy(u + step) - energy(u - step) == pytest.approx(
            0, abs=1e-6 * max(energy(f), 1) * strength
        )


def test_guided_filter_is_linear_in_the_image_and_keeps_the_guides_edges():
    guide = np.zeros((40, 40))
    guide[:, 20:] = 5
    noisy = guide / 2 + np.random.default_rng(0).normal(0, 0.2, guide.shape)
    kept = wls.guided(guide, noisy, 9)
    assert kept[:, 21].mean() - kept[:, 18].mean() == pytest.approx(2.5, abs=0.1)
    assert kept[:, 25:].std() < 0.1
    np.testing.assert_allclose(wls.guided(guide, 3 * noisy + 1, 9), 3 * kept + 1, atol=1e-9)


def test_moments_of_the_face_become_those_of_the_reference(pair):
    face = np.zeros(pair[0].shape[:2], bool)
    face[20:60, 20:50] = True
    target, reference = pair[0] / 1000 + 0.3, pair[1] / 1000 + 0.2
    made = relit("moments", scene(target, reference, face)).planes
    np.testing.assert_allclose(made[face].mean(axis=0), reference[face].mean(axis=0), atol=1e-5)
    np.testing.assert_allclose(made[face].std(axis=0), reference[face].std(axis=0), atol=1e-5)


def test_histogram_matching_is_that_of_scikit_image(pair):
    made = relit("histogram", scene(*pair)).planes
    theirs = match_histograms(pair[0], pair[1], channel_axis=-1) / 255
    assert np.abs(made - theirs).mean() < 1 / 255  # which takes the share up to a value, not its middle
    assert np.abs(made - theirs).max() < 6 / 255


def test_spherical_harmonics_relight_a_ball_as_it_would_be_lit(ball):
    landmarks, normals, face = ball
    basis = harmonics(normals)
    lights = ([0.5, 0.1, 0, -0.3, 0, 0.02, 0, 0.01, 0], [0.5, -0.25, 0.1, -0.2, 0.03, 0, 0, 0, 0.02])
    albedo = 0.7 + 0.2 * (np.indices(face.shape).sum(axis=0) % 2)
    shade, light = (basis @ np.array(coefficients) for coefficients in lights)
    regions = FaceRegions(landmarks, face.shape)
    vars(regions)["interior"] = face
    given = Scene(albedo * shade, light, regions, landmarks, 0.2, TransferOptions())
    made = relit("spherical-harmonics", given).planes / (albedo * light)
    # The albedo of the two differs by a factor, which is no light.
    assert (made / np.median(made[face]))[face] == pytest.approx(1, abs=0.04)


def quotient_scene(seed=0):
    """Two albedos in two lights: target, reference in the target's light, reference in the other."""
    random = np.random.default_rng(seed)
    albedo, other = random.uniform(0.2, 0.8, (2, 40, 40, 3))
    own, light = np.linspace(0.2, 1, 40)[:, None], np.linspace(1, 0.3, 40)[:, None, None]
    target, second, reference = albedo * own[..., None], other * own[..., None], other * light
    given = scene(target, reference, points=((8, 10), (32, 10), (20, 30)))
    return dataclasses.replace(given, second=second), albedo * light


def test_the_quotient_relights_exactly_where_two_faces_have_one_shape():
    given, truth = quotient_scene()
    np.testing.assert_allclose(relit("quotient", given).planes, truth, atol=1e-6)


def test_the_expression_ratio_lies_between_the_quotient_and_a_blurred_one():
    given, truth = quotient_scene()
    # The ratio of two smooth lights is smooth, so that smoothing it changes little, but at the frame.
    made = relit("expression-ratio", given).planes
    np.testing.assert_allclose(made[5:-5, 5:-5], truth[5:-5, 5:-5], rtol=0.02)
    # Where the second reference is the target in every detail, nothing is smoothed.
    same = dataclasses.replace(given, target=given.second)
    np.testing.assert_allclose(relit("expression-ratio", same).planes, given.reference, atol=1e-5)


def test_correlation_is_that_of_the_textbook():
    random = np.random.default_rng(0)
    a = random.normal(size=(60, 60))
    for factor in (1, -2):
        np.testing.assert_allclose(correlation(a, factor * a + 3, 4.0), np.sign(factor), atol=1e-9)
    b = a + random.normal(size=a.shape)
    # A window much larger than the plane sees all of it.
    assert correlation(a, b, 200.0)[30, 30] == pytest.approx(
        np.corrcoef(a.ravel(), b.ravel())[0, 1], abs=0.02
    )
    assert np.abs(correlation(a, np.ones_like(a), 4.0)).max() < 1e-6


def test_a_second_reference_goes_with_the_methods_that_take_one(pair, ball):
    points = ball[0].points[::40] * 0.5 + [10, 15, 0]
    landmarks = {"target_landmarks": points, "reference_landmarks": points}
    with pytest.raises(OptionError, match="second_reference: expected the reference's face"):
        transfer(*pair, **landmarks, method="quotient")
    with pytest.raises(OptionError, match="second_reference: expected none with method 'ltv'"):
        transfer(*pair, **landmarks, method="ltv", second_reference=pair[1])
    with pytest.raises(ImageError, match="second_reference: expected grey or colour"):
        transfer(
            *pair, **landmarks, method="quotient", second_reference=pair[1][..., 0], second_landmarks=points
        )


@pytest.mark.parametrize("method", [name for name in METHODS if name != "ltv"])
def test_transfers_by_every_method(method, pair, ball):
    points = ball[0].points[::40] * [0.5, 0.5, 0.5] + [10, 15, 0]
    given = {"target_landmarks": points, "reference_landmarks": points, "method": method}
    if method in WITH_SECOND_REFERENCE:
        given |= {"second_reference": pair[1][::-1].copy(), "second_landmarks": points}
    result = transfer(*pair, **given)
    assert result.image.shape == pair[0].shape
    assert result.image.dtype == np.uint8
    assert (result.image != pair[0]).any()
    pictures = stage_pictures(result)
    assert ("target_u" in pictures) == (result.first.target_split is not None)
    assert ("new_light" in pictures) == (method == "shading")
    assert contact_sheet(result).ndim == 3
    assert ("warped_second_reference" in stage_pictures(result)) == (method in WITH_SECOND_REFERENCE)
    coloured = transfer(pair[0][..., 1], pair[1], **given)
    assert coloured.image.shape == pair[0].shape
