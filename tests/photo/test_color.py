"""Colour spaces against the standard library, scikit-image and each other."""

import colorsys

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from skimage.color import rgb2ycbcr

from relit.errors import OptionError
from relit.photo.color import (
    COLOR_SPACES,
    channels_of,
    hsv_to_rgb,
    luma,
    rgb_to_hsv,
    rgb_to_ycbcr,
    ycbcr_to_rgb,
)

colors = arrays(np.float64, (5, 3), elements=st.floats(0, 1))


@settings(deadline=None)
@given(rgb=colors)
def test_hsv_is_the_standard_librarys(rgb):
    difference = np.abs(rgb_to_hsv(rgb) - [colorsys.rgb_to_hsv(*color) for color in rgb])
    difference[:, 0] = np.minimum(difference[:, 0], 1 - difference[:, 0])  # hue is a circle
    assert difference.max() < 1e-9


@settings(deadline=None)
@given(hsv=colors)
def test_hsv_back_is_the_standard_librarys(hsv):
    np.testing.assert_allclose(hsv_to_rgb(hsv), [colorsys.hsv_to_rgb(*color) for color in hsv], atol=1e-9)


def test_ycbcr_is_bt601_at_full_range():
    rgb = np.random.default_rng(0).random((50, 3))
    # scikit-image gives studio range: Y in 16..235, Cb and Cr in 16..240.
    studio = rgb2ycbcr(rgb)
    full = np.column_stack([(studio[:, 0] - 16) / 219, (studio[:, 1:] - 128) / 224 + 0.5])
    np.testing.assert_allclose(rgb_to_ycbcr(rgb), full, atol=1e-4)
    np.testing.assert_allclose(luma(rgb), rgb_to_ycbcr(rgb)[:, 0])


@settings(deadline=None)
@given(rgb=colors)
def test_every_space_leads_back_and_stays_in_its_range(rgb):
    for space in COLOR_SPACES.values():
        there = space.from_rgb(rgb)
        assert there.min() >= -1e-12
        assert there.max() <= 1 + 1e-12
        np.testing.assert_allclose(space.to_rgb(there), rgb, atol=1e-9)
    np.testing.assert_allclose(ycbcr_to_rgb(rgb_to_ycbcr(rgb)), rgb, atol=1e-12)


def test_float32_stays_float32():
    rgb = np.random.default_rng(1).random((4, 4, 3)).astype(np.float32)
    for space in COLOR_SPACES.values():
        assert space.from_rgb(rgb).dtype == np.float32
        assert space.to_rgb(space.from_rgb(rgb)).dtype == np.float32


@pytest.mark.parametrize(
    ("space", "channels", "expected"),
    [
        ("rgb", "all", (0, 1, 2)),
        ("rgb", "g", (1,)),
        ("hsv", "primary", (0,)),
        ("hsv", "v", (2,)),
        ("ycbcr", "primary", (0,)),
        ("ycbcr", "cr", (2,)),
    ],
)
def test_channels_by_name(space, channels, expected):
    assert channels_of(space, channels) == expected


@pytest.mark.parametrize(
    ("space", "channels", "message"),
    [
        ("lab", "all", "color_space: expected one of rgb, hsv, ycbcr, got 'lab'"),
        ("rgb", "primary", "channels: expected one of all, r, g, b"),
        ("hsv", "y", "channels: expected one of all, primary, h, s, v"),
    ],
)
def test_unknown_channels_are_refused(space, channels, message):
    with pytest.raises(OptionError, match=message):
        channels_of(space, channels)
