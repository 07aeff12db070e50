"""Skins are of all complexions that people have, and parts of a face differ as they do."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from training.skins import Skin, waves

FACE = np.random.default_rng(0).uniform([-0.7, 0.2, -0.2], [0.7, 0.8, 0.2], (400, 3))
NONE = np.zeros(len(FACE))


def skin(**changes):
    usual = {"seed": 1, "melanin": 0.5, "blood": 0.3, "stubble": 0.0, "brows": 0.5, "freckles": 0.0}
    return Skin(hair=np.array([0.02, 0.015, 0.01]), **{**usual, **changes})


@given(st.floats(0, 1), st.floats(0.1, 0.7), st.integers(0, 2**31 - 1))
def test_skin_is_red_before_green_before_blue(melanin, blood, seed):
    color = skin(melanin=melanin, blood=blood, seed=seed).albedo(FACE, NONE, NONE, NONE).mean(axis=0)
    assert 1 > color[0] > color[1] > color[2] > 0


def test_complexions_reach_from_dark_to_fair():
    """L* of rendered portraits of real people is 25 to 64."""
    from skimage.color import rgb2lab

    from relit.photo.profile import encode_srgb

    light = [
        float(
            rgb2lab(encode_srgb(skin(melanin=m).albedo(FACE, NONE, NONE, NONE).mean(axis=0))[None, None])[
                0, 0, 0
            ]
        )
        for m in (1.0, 0.0)
    ]
    assert light[0] < 30
    assert light[1] > 64


def test_more_melanin_is_darker_and_blood_is_redder():
    fair, dark, pale, flushed = (
        skin(**changes).albedo(FACE, NONE, NONE, NONE)
        for changes in ({"melanin": 0.2}, {"melanin": 0.8}, {"blood": 0.1}, {"blood": 0.7})
    )
    assert (dark < fair).all()
    assert (flushed[:, 0] / flushed[:, 1]).mean() > (pale[:, 0] / pale[:, 1]).mean()


def test_lips_are_redder_eyes_white_and_hair_is_of_its_colour():
    ones = np.ones(len(FACE))
    bare, lips = (skin().albedo(FACE, part, NONE, NONE) for part in (NONE, ones))
    assert ((lips[:, 0] / lips[:, 1]) > (bare[:, 0] / bare[:, 1])).all()
    eyes = skin().albedo(FACE, NONE, ones, NONE)
    assert set(eyes.round(3)[:, 0].tolist()) <= {0.6, 0.05}
    hair = skin().albedo(FACE, NONE, NONE, ones)
    np.testing.assert_allclose(hair / hair[:, :1], np.broadcast_to([1, 0.75, 0.5], hair.shape), rtol=1e-6)


@given(st.floats(0.1, 2.0))
def test_waves_are_noise_of_unit_variance(size):
    places = np.random.default_rng(0).uniform(-20, 20, (4000, 3)) * size
    made = waves(places, size, np.random.default_rng(1))
    assert abs(made.mean()) < 0.15
    assert made.std() == pytest.approx(1, abs=0.15)
    near = waves(places + 0.02 * size, size, np.random.default_rng(1))
    assert np.abs(near - made).mean() < 0.2
