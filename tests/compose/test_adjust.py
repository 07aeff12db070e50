"""What the options do to a change of light."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from relit.compose.adjust import controlled
from relit.settings.options import TransferOptions

RNG = np.random.default_rng(0)
BASE = RNG.uniform(0.2, 0.9, (20, 24, 3)).astype(np.float32)
CHANGE = RNG.normal(0.1, 0.3, (20, 24, 3)).astype(np.float32)
FACE = np.ones((20, 24), bool)
FACE[:5] = False
LUMA = np.array([0.299, 0.587, 0.114], np.float32)


def under(change=CHANGE, base=BASE, weights=LUMA, **options):
    return controlled(change, base, FACE, weights, TransferOptions(**options))


def test_by_default_a_change_stays_as_the_method_made_it():
    np.testing.assert_allclose(under(method="ltv"), CHANGE, atol=1e-6)
    grey = CHANGE[..., :1]
    np.testing.assert_allclose(under(grey, BASE[..., :1], np.ones(1, np.float32)), grey, atol=1e-6)


def test_another_method_keeps_the_hue_of_skin_in_light_and_shade():
    """A skin whose blue falls off more steeply, and a light that is red to the left for its own part."""
    y, x = np.mgrid[-1:1:40j, -1:1:50j]
    face = np.ones(x.shape, bool)
    steep, red = y[..., None] * [0.9, 1.0, 1.3], x[..., None] * [0.2, -0.1, 0]
    change, base = (steep + red).astype(np.float32), np.full((40, 50, 3), 0.5, np.float32)
    kept, taken = (
        controlled(change, base, face, LUMA, TransferOptions(method="ltv", tint=tint))
        for tint in ("keep", "take")
    )
    np.testing.assert_allclose(kept - red, (steep @ LUMA)[..., None] * [1, 1, 1], atol=0.02)
    np.testing.assert_allclose(taken, change, atol=1e-5)


@pytest.mark.parametrize("tint", ["keep", "take", "neutral", 0.5, None])
def test_shading_has_seen_to_its_colours(tint):
    np.testing.assert_allclose(under(tint=tint), CHANGE, atol=1e-6)


@given(st.floats(0, 4))
def test_strength_scales_the_change(strength):
    np.testing.assert_allclose(under(strength=strength, tint="take"), strength * CHANGE, rtol=1e-4, atol=1e-5)


def test_shadows_and_highlights_scale_their_own_side():
    light = CHANGE @ LUMA
    middle = light[FACE].mean()
    for name, side in (("shadows", light < middle), ("highlights", light > middle)):
        changed = under(tint="take", **{name: 0.25})
        np.testing.assert_allclose(changed[~side], CHANGE[~side], atol=1e-6)
        off = changed[side] @ LUMA - middle
        np.testing.assert_allclose(off, 0.25 * (light[side] - middle), atol=1e-5)
        # All planes by the same, so that hues stay.
        np.testing.assert_allclose(np.diff(changed - CHANGE, axis=2), 0, atol=1e-5)


@pytest.mark.parametrize("method", ["ltv", "moments"])
def test_exposure_is_kept_taken_or_so_many_stops_more(method):
    def brightest(change):
        return np.quantile((BASE * np.exp(change))[FACE] @ LUMA, 0.95)

    kept, taken = under(method=method, exposure="keep"), under(method=method, exposure="take")
    np.testing.assert_allclose(taken, CHANGE, atol=1e-6)
    assert brightest(kept) == pytest.approx(brightest(np.zeros(1)), rel=1e-4)
    stops = under(method=method, exposure=-1.5)
    # A stop is a factor of two in light, which an encoded value shows as its power 1 / 2.2.
    np.testing.assert_allclose((np.exp(stops - kept)) ** 2.2, 2**-1.5, rtol=1e-4)


def test_shading_has_seen_to_its_exposure_and_gets_stops_alone():
    np.testing.assert_allclose(under(exposure="keep", tint="take"), CHANGE, atol=1e-6)
    np.testing.assert_allclose((np.exp(under(exposure=1, tint="take") - CHANGE)) ** 2.2, 2, rtol=1e-4)


def test_a_neutral_tint_changes_brightness_alone():
    neutral = under(method="ltv", tint="neutral")
    np.testing.assert_allclose(np.ptp(neutral, axis=2), 0, atol=1e-6)
    np.testing.assert_allclose(neutral[..., 0], CHANGE @ LUMA, atol=1e-5)


def test_tint_is_the_share_of_the_overall_colour():
    def overall(change):
        mean = change[FACE].mean(axis=0)
        return mean - mean @ LUMA

    for share, tint in ((0, "keep"), (0.4, 0.4), (1, "take")):
        changed = under(method="ltv", tint=tint)
        np.testing.assert_allclose(overall(changed), share * overall(CHANGE), atol=1e-5)
        np.testing.assert_allclose(
            changed[FACE].mean(axis=0) @ LUMA, CHANGE[FACE].mean(axis=0) @ LUMA, atol=1e-5
        )


def test_in_other_spaces_brightness_is_that_of_its_own_plane():
    weights = np.array([0, 0, 1], np.float32)
    changed = under(weights=weights, method="ltv", color_space="hsv", exposure=1, shadows=0.5)
    np.testing.assert_array_equal(changed[..., :2], CHANGE[..., :2])
    assert np.abs(changed[..., 2] - CHANGE[..., 2]).max() > 0.1
