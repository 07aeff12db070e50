"""Which planes are relit, against Sect. 6 of the paper worked out by hand."""

import colorsys
from types import SimpleNamespace

import numpy as np
import pytest

from relit.photo.planes import plane_space

RNG = np.random.default_rng(0)
COLOR = RNG.integers(20, 235, (10, 12, 3)).astype(np.uint8)
OTHER = RNG.integers(20, 235, (10, 12, 3)).astype(np.uint8)
GREY = RNG.integers(20, 235, (10, 12)).astype(np.uint8)
SPACES = [
    ("rgb", "all"),
    ("rgb", "g"),
    ("hsv", "all"),
    ("hsv", "primary"),
    ("hsv", "v"),
    ("ycbcr", "all"),
    ("ycbcr", "primary"),
]


def planes_of(target, reference, space, channels):
    chosen = plane_space(target.ndim == 2, reference.ndim == 2, space, channels)
    return SimpleNamespace(
        target=chosen.of_target(target),
        reference=chosen.of_reference(reference),
        rebuild=lambda relit: chosen.rebuild(target, relit),
        weights=chosen.weights,
    )


@pytest.mark.parametrize(("space", "channels"), SPACES)
@pytest.mark.parametrize("reference", [OTHER, GREY])
def test_a_relighting_that_changes_nothing_gives_the_target_back(space, channels, reference):
    planes = planes_of(COLOR, reference, space, channels)
    target = planes.target / 255 if planes.target.dtype == np.uint8 else planes.target
    np.testing.assert_allclose(planes.rebuild(target.astype(np.float32)), COLOR / 255, atol=2e-6)


def test_rgb_planes_are_the_images_themselves():
    planes = planes_of(COLOR, OTHER, "rgb", "all")
    assert planes.target is COLOR
    assert planes.reference is OTHER


def test_grey_images_are_relit_as_they_are():
    planes = planes_of(GREY, GREY[::-1], "ycbcr", "primary")
    assert planes.target is GREY
    np.testing.assert_array_equal(planes.reference, GREY[::-1])


@pytest.mark.parametrize(("channels", "index"), [("primary", 0), ("s", 1), ("v", 2)])
def test_one_hsv_channel_is_taken_and_the_others_stay(channels, index):
    planes = planes_of(COLOR, OTHER, "hsv", channels)
    assert planes.target.shape == (10, 12)
    expected = colorsys.rgb_to_hsv(*(OTHER[3, 4] / 255))[index]
    assert planes.reference[3, 4] == pytest.approx(expected, abs=1e-6)
    rebuilt = planes.rebuild(np.full((10, 12), 0.25, np.float32))
    before, after = colorsys.rgb_to_hsv(*(COLOR[3, 4] / 255)), colorsys.rgb_to_hsv(*rebuilt[3, 4].tolist())
    for k in range(3):
        assert after[k] == pytest.approx(0.25 if k == index else before[k], abs=1e-5)


@pytest.mark.parametrize(("space", "channels"), SPACES)
def test_under_a_grey_reference_a_target_keeps_its_hue(space, channels):
    planes = planes_of(COLOR, GREY, space, channels)
    assert planes.target.ndim == planes.reference.ndim == 2
    darker = planes.rebuild((np.asarray(planes.target, np.float32) * 0.8).astype(np.float32))
    for color, relit in zip(COLOR.reshape(-1, 3) / 255, darker.reshape(-1, 3), strict=True):
        # YCbCr keeps its colour differences and leaves the gamut where luma falls too far: hue stays anyway.
        if relit.min() > 0:
            before, after = colorsys.rgb_to_hsv(*color)[0], colorsys.rgb_to_hsv(*relit.tolist())[0]
            assert min(abs(before - after), 1 - abs(before - after)) < 1e-3


def test_a_grey_reference_lights_through_its_own_level():
    planes = planes_of(COLOR, GREY, "rgb", "all")
    np.testing.assert_array_equal(planes.reference, GREY)
    np.testing.assert_allclose(planes.target, COLOR / 255 @ [0.299, 0.587, 0.114], atol=1e-6)


@pytest.mark.parametrize(("space", "channels"), SPACES)
def test_a_grey_target_has_no_colour_until_the_reference_gives_it(space, channels):
    planes = planes_of(GREY, OTHER, space, channels)
    if (space, channels) == ("rgb", "all"):
        assert planes.target is GREY
        assert planes.reference is OTHER
        return
    rebuilt = planes.rebuild(np.asarray(planes.target, np.float32))
    assert rebuilt.shape == (10, 12, 3)
    np.testing.assert_allclose(rebuilt, np.repeat(GREY[..., None] / 255, 3, axis=2), atol=2e-6)


def test_one_rgb_channel_is_taken_and_the_others_stay():
    planes = planes_of(COLOR, OTHER, "rgb", "g")
    np.testing.assert_allclose(planes.reference, OTHER[..., 1] / 255, atol=1e-6)
    rebuilt = planes.rebuild(np.full((10, 12), 0.25, np.float32))
    np.testing.assert_allclose(rebuilt[..., [0, 2]], COLOR[..., [0, 2]] / 255, atol=1e-6)
    np.testing.assert_array_equal(rebuilt[..., 1], 0.25)


@pytest.mark.parametrize("space", ["hsv", "ycbcr"])
def test_relit_channels_stay_in_their_range(space):
    planes = planes_of(COLOR, OTHER, space, "all")
    np.testing.assert_allclose(
        planes.rebuild(np.full((10, 12, 3), 7.0, np.float32)),
        planes.rebuild(np.ones((10, 12, 3), np.float32)),
    )


@pytest.mark.parametrize(("space", "channels"), SPACES)
def test_weights_tell_the_brightness_of_the_rebuilt_photo(space, channels):
    planes = planes_of(COLOR, OTHER, space, channels)
    count = np.atleast_3d(planes.target).shape[2]
    weights = planes.weights(count)
    assert weights.shape == (count,)
    assert weights.sum() == pytest.approx(1)
    if count == 3:
        target = planes.target / 255 if planes.target.dtype == np.uint8 else planes.target
        rgb = COLOR / 255
        measure = rgb.max(axis=2) if space == "hsv" else rgb @ [0.299, 0.587, 0.114]
        np.testing.assert_allclose(target @ weights, measure, atol=1e-6)
