"""A change of light made as bright, and of the hue, that is wanted: as is measured in the result."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from relit.compose.adjust import anchored
from relit.light.dome import DOME, Lamps
from relit.methods.light_change import LightChange
from relit.methods.lit_face import linear
from relit.settings.options import TransferOptions

RNG = np.random.default_rng(0)
SHAPE = (24, 30)
FACE = np.zeros(SHAPE, bool)
FACE[4:20, 5:25] = True
CAST = np.array([0.5, -0.1, -0.9])


def decoded(planes):
    """The curve of IEC 61966-2-1, backwards, and beyond 1."""
    return np.where(planes <= 0.04045, planes / 12.92, ((np.maximum(planes, 0) + 0.055) / 1.055) ** 2.4)


def change(target=None, encoded=True, **given):
    target = RNG.uniform(0.1, 0.9, (*SHAPE, 3)).astype(np.float32) if target is None else target
    hue = RNG.normal(0, 0.2, (*SHAPE, 3)).astype(np.float32) if target.ndim == 3 else None
    made = {
        "brightness": RNG.normal(0, 0.7, SHAPE).astype(np.float32),
        "hue": hue,
        "bleach": None,
        "cast": CAST,
        "ours": 0.5,
        "theirs": 0.2,
        "no_skin": False,
    } | given
    return LightChange(
        light=linear(target, encoded),
        encoded=encoded,
        face=FACE,
        known=np.ones(SHAPE, np.float32),
        confidence=1.0,
        lamps=Lamps(DOME, np.ones(100)),
        sources=Lamps(DOME, np.ones(100)),
        layers={},
        **made,
    )


def light_of(made, planes):
    return decoded(np.float64(planes)) if made.encoded else np.float64(planes)


def brightest(light):
    """How bright the face is in the channel that is brightest, where it is lit."""
    return np.quantile(np.atleast_3d(light)[FACE].max(axis=1), 0.95)


@pytest.mark.parametrize("encoded", [True, False])
@pytest.mark.parametrize("cast", [0.0, 0.4, 1.0, None])
def test_kept_exposure_keeps_the_brightest_channel(encoded, cast):
    made = change(encoded=encoded)
    relit = made.anchored(0.0, cast).planes
    before, after = brightest(made.light), brightest(light_of(made, relit))
    assert after == pytest.approx(before, rel=1e-4)


def test_grey_is_kept_and_stays_grey():
    made = change(RNG.uniform(0.1, 0.9, SHAPE).astype(np.float32), encoded=False)
    relit = made.anchored(0.0, None).planes
    assert relit.shape == SHAPE
    assert brightest(relit) == pytest.approx(brightest(made.light), rel=1e-4)
    ratio = np.log(relit / made.light) - made.brightness
    np.testing.assert_allclose(ratio, ratio[0, 0], atol=1e-4)


@pytest.mark.parametrize("share", [0.0, 0.5, 1.0])
def test_taken_exposure_is_the_references(share):
    """Of the ratio of the two faces' brightness, in light, and of the whole photo alike."""
    made = change()
    kept, taken = (light_of(made, made.anchored(one, 0.0).planes) for one in (0.0, share))
    np.testing.assert_allclose(taken / kept, (0.2 / 0.5) ** share, rtol=1e-3)


def test_neutral_light_leaves_every_hue():
    """In linear light the channels of each pixel keep their ratios to one another."""
    made = change()
    options = TransferOptions(tint="neutral")
    relit = anchored(made, options).planes
    shares = [light / light.sum(axis=2, keepdims=True) for light in (made.light, decoded(relit))]
    np.testing.assert_allclose(*shares, atol=1e-4)
    ratio = np.log(decoded(relit).sum(axis=2) / made.light.sum(axis=2)) - made.brightness
    np.testing.assert_allclose(ratio, ratio[0, 0], atol=1e-3)


@pytest.mark.parametrize(("tint", "share"), [("keep", 0.0), (0.3, 0.3), ("take", 1.0)])
def test_the_cast_is_taken_by_its_share(tint, share):
    made = change()
    relit, without = (
        decoded(anchored(one, TransferOptions(tint=tint)).planes)
        for one in (made, dataclasses.replace(made, cast=np.zeros(3)))
    )
    log = np.log(relit / without)
    np.testing.assert_allclose(
        log - log[..., :1], np.broadcast_to(share * (CAST - CAST[0]), log.shape), atol=2e-3
    )


def test_by_default_a_cast_counts_as_far_as_it_is_more_than_two_skins_differ():
    def taken(cast):
        made = change(cast=np.array(cast))
        relit, kept = (decoded(made.anchored(0.0, one).planes) for one in (None, 0.0))
        log = np.log(relit / kept)
        return (log[..., 0] - log[..., 2]).mean() / (cast[0] - cast[2])

    assert taken([0.15, 0.0, -0.25]) == pytest.approx(0, abs=1e-4)
    assert 0.3 < taken([0.35, 0.0, -0.5]) < 0.7
    assert taken([2.0, 0.0, -3.0]) > 0.95


def test_by_default_a_cast_without_a_skin_in_it_counts_whole():
    made = change(cast=np.array([0.05, 0.0, -0.1]), no_skin=True)
    np.testing.assert_array_equal(made.anchored(0.0, None).planes, made.anchored(0.0, 1.0).planes)


@given(arrays(np.float32, SHAPE, elements=st.floats(-6, 6, width=32)))
def test_nothing_is_negative_or_without_end(brightness):
    for target in (np.zeros((*SHAPE, 3), np.float32), np.ones(SHAPE, np.float32)):
        relit = change(target, brightness=brightness).anchored(1.0, 1.0).planes
        assert np.isfinite(relit).all()
        assert relit.min() >= 0
