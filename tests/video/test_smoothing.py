"""Smoothing keeps what is constant, and what moves evenly, where it is: it has no lag."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from relit.video.smoothing import curve_weights, faded, filled

steps = st.lists(st.floats(0.005, 0.2), min_size=1, max_size=20)


@given(steps, st.data())
def test_a_constant_and_a_line_stay(gaps, data):
    times = np.cumsum([0.0, *gaps])
    trust = np.array(data.draw(st.lists(st.floats(0.1, 1), min_size=len(times), max_size=len(times))))
    at = times[data.draw(st.integers(0, len(times) - 1))]
    weights = curve_weights(times, at, 0.1, trust)
    assert weights.sum() == pytest.approx(1, abs=1e-9)
    near = np.exp(-0.5 * ((times - at) / 0.1) ** 2)
    if near.sum() > near.max() + 1e-3:  # a line needs two points
        assert weights @ (7 * times - 2) == pytest.approx(7 * at - 2, abs=1e-5)


def test_it_is_what_numpy_fits():
    random = np.random.default_rng(0)
    times, values, trust = (
        np.sort(random.uniform(0, 1, 12)),
        random.normal(size=12),
        random.uniform(0.2, 1, 12),
    )
    weights = curve_weights(times, 0.4, 0.2, trust)
    root = np.sqrt(trust * np.exp(-0.5 * ((times - 0.4) / 0.2) ** 2))
    _slope, level = np.polyfit(times - 0.4, values, 1, w=root)
    assert weights @ values == pytest.approx(level, rel=1e-9)
    *_, level = np.polyfit(times - 0.4, values, 2, w=root)
    assert curve_weights(times, 0.4, 0.2, trust, 2) @ values == pytest.approx(level, rel=1e-6)


def test_what_speeds_up_is_late_by_a_line_and_not_by_a_parabola():
    times = np.arange(60) / 30
    late = curve_weights(times, times[30], 0.1, np.ones(60)) @ (times - times[30]) ** 2
    assert late == pytest.approx(0.1**2, rel=0.01)
    assert curve_weights(times, times[30], 0.1, np.ones(60), 2) @ (times - times[30]) ** 2 < 1e-9
    few = curve_weights(times[:2], times[0], 0.1, np.ones(2), 2)
    assert few @ (3 * times[:2]) == pytest.approx(0, abs=1e-9), "two values have but a line"


def test_noise_gets_less():
    times = np.arange(200) / 30
    noise = np.random.default_rng(1).normal(size=200)
    smooth = [curve_weights(times, at, 0.12, np.ones(200)) @ noise for at in times[20:-20]]
    assert np.std(smooth) < 0.45 * noise.std()


def test_what_does_not_count_does_not():
    weights = curve_weights(np.arange(3.0), 1.0, 1.0, np.array([1.0, 0.0, 1.0]))
    assert weights[1] == 0
    assert curve_weights(np.array([0.0, 90.0]), 50.0, 0.1, np.ones(2)).tolist() == [0, 1]


@given(st.lists(st.floats(0, 1), min_size=1, max_size=30))
def test_a_fade_is_below_and_gentle(share):
    times = np.arange(len(share)) / 30
    made = faded(np.array(share), times, 0.3)
    assert (made <= np.array(share)).all()
    assert (np.abs(np.diff(made)) <= 1 / 30 / 0.3 + 1e-12).all()


def test_gaps_at_the_ends_stay():
    valid = np.array([0, 1, 0, 1, 0], bool)
    assert filled(valid, np.arange(5.0), 2.0).tolist() == [False, True, True, True, False]
