"""A bleached skin gets its hue back where it gets darker, and gives some where it gets brighter."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from relit.methods.bleach import Bleach, bleach_of
from relit.photo.color import LUMA_WEIGHTS

SHAPE = 40, 40
SKIN = np.array([0.6, 0.35, 0.25])
HUE = np.log(SKIN / (SKIN @ LUMA_WEIGHTS))
ALL = np.ones(SHAPE, np.float32)


def mixed(share):
    """Return skin as bright as before, with the share of its hue left out: 1 is white, -1 twice the hue."""
    light = np.exp((1 - share)[..., None] * HUE)
    return np.asarray(0.3 * light / (light @ LUMA_WEIGHTS)[..., None], np.float32)


def found_in(light, skin=ALL, own_hue=None):
    return bleach_of(light, own_hue, skin, ALL > 0, 10.0)


def patch(share):
    made = np.zeros(SHAPE)
    made[:, 28:] = share
    return made


@given(st.floats(-0.6, 1))
def test_a_share_of_white_is_found(share):
    found = found_in(mixed(patch(share))).share[20]
    wanted = np.sign(share) * max(abs(share) - 0.1, 0) * (0.5 if share < 0 else 1)
    # A mixture's luma is not quite that of the log-linear one.
    assert found[36] == pytest.approx(wanted, abs=0.08)
    np.testing.assert_allclose(found[4:24], 0, atol=1e-5)


@pytest.mark.parametrize(("share", "change", "left"), [(0.8, -1.0, 0.25), (-0.8, 1.0, 0.7)])
def test_what_gets_darker_is_skin_again_and_what_gets_brighter_is_less_red(share, change, left):
    light = mixed(patch(share))
    bleach = found_in(light)
    made = light * np.exp(change + bleach.undone(np.full(SHAPE, change, np.float32)))
    hue = np.log(made / (made @ LUMA_WEIGHTS)[..., None])
    before = np.log(light / (light @ LUMA_WEIGHTS)[..., None])
    away, was = (np.abs(h[20, 36] - HUE).max() for h in (hue, before))
    assert away < left * was
    np.testing.assert_allclose(hue[20, 10], HUE, atol=1e-4)


@given(st.floats(-1, 1), st.floats(-3, 3))
def test_nothing_is_undone_that_the_light_does_not_show(share, change):
    bleach = Bleach(np.full(SHAPE, share, np.float32), HUE.astype(np.float32))
    undone = bleach.undone(np.full(SHAPE, change, np.float32))
    if share * change >= 0:
        assert not undone.any()
    assert np.abs(undone).max() <= np.abs(share * HUE).max() + 1e-6


def test_grey_photos_and_grey_skins_have_no_hue_to_lose():
    assert found_in(ALL) is None
    assert found_in(np.full((*SHAPE, 3), 0.4, np.float32)) is None
    assert found_in(mixed(patch(0.5)), 0 * ALL) is None


def test_off_the_skin_only_highlights_are_bleached():
    skin = ALL.copy()
    skin[:, 20:] = 0
    dark = mixed(patch(0.8)) * np.where(np.arange(40) < 28, 1, 0.8).astype(np.float32)[:, None]
    assert np.abs(found_in(dark, skin).share[:, 32:]).max() < 1e-3
    bright = mixed(patch(0.8)) * np.where(np.arange(40) < 28, 1, 1.5).astype(np.float32)[:, None]
    assert found_in(bright, skin).share[20, 36] > 0.6


def test_the_lights_own_hue_bleaches_nothing():
    hue = patch(1.0)[..., None] * np.array([-0.2, 0.02, 0.3])
    light = np.asarray(mixed(patch(0)) * np.exp(hue), np.float32)
    own = np.log(light / (light @ LUMA_WEIGHTS)[..., None]).astype(np.float32)
    assert np.abs(found_in(light, own_hue=own).share).max() < 0.05
    assert np.abs(found_in(light).share[20, 36]) > 0.2


def test_paint_and_what_is_beyond_white_is_not_bleached():
    across = np.cross(HUE, [1, 1, 1])
    across *= np.linalg.norm(HUE) / np.linalg.norm(across)
    for hue in (HUE / 2 + across, -1.5 * HUE):
        light = mixed(patch(0))
        light[:, 28:] = 0.3 * np.exp(hue)
        assert np.abs(found_in(light).share[20, 36]) < 0.1
