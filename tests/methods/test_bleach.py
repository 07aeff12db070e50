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


def patch(share):
    made = np.zeros(SHAPE)
    made[:, 28:] = share
    return made


@given(st.floats(-1, 1))
def test_a_share_of_white_is_found(share):
    found = bleach_of(mixed(patch(share)), ALL, 10.0).share[20]
    # A mixture's luma is not quite that of the log-linear one.
    assert found[36] == pytest.approx(np.sign(share) * max(abs(share) - 0.1, 0), abs=0.08)
    np.testing.assert_allclose(found[4:24], 0, atol=1e-5)


@pytest.mark.parametrize(("share", "change"), [(0.8, -1.0), (-0.8, 1.0)])
def test_what_gets_darker_is_skin_again_and_what_gets_brighter_is_no_redder(share, change):
    light = mixed(patch(share))
    bleach = bleach_of(light, ALL, 10.0)
    made = light * np.exp(change + bleach.undone(np.full(SHAPE, change, np.float32)))
    hue = np.log(made / (made @ LUMA_WEIGHTS)[..., None])
    before = np.log(light / (light @ LUMA_WEIGHTS)[..., None])
    away, was = (np.abs(h[20, 36] - HUE).max() for h in (hue, before))
    assert away < 0.25 * was
    np.testing.assert_allclose(hue[20, 10], HUE, atol=1e-4)


@given(st.floats(-1, 1), st.floats(-3, 3))
def test_nothing_is_undone_that_the_light_does_not_show(share, change):
    bleach = Bleach(np.full(SHAPE, share, np.float32), HUE.astype(np.float32))
    undone = bleach.undone(np.full(SHAPE, change, np.float32))
    if share * change >= 0:
        assert not undone.any()
    assert np.abs(undone).max() <= np.abs(share * HUE).max() + 1e-6


def test_grey_photos_and_grey_skins_have_no_hue_to_lose():
    assert bleach_of(ALL, ALL, 10.0) is None
    assert bleach_of(np.full((*SHAPE, 3), 0.4, np.float32), ALL, 10.0) is None
    assert bleach_of(mixed(patch(0.5)), 0 * ALL, 10.0) is None


def test_off_the_skin_nothing_is_bleached():
    skin = ALL.copy()
    skin[:, 20:] = 0
    assert np.abs(bleach_of(mixed(patch(0.8)), skin, 10.0).share[:, 30:]).max() < 1e-3
