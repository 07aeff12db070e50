"""Lamps stand evenly round a head, and lights are made of them."""

import numpy as np
import pytest

from training.lights import LAMPS, a_light, lamps


def test_lamps_are_as_dense_everywhere():
    ways = lamps()
    np.testing.assert_allclose(np.linalg.norm(ways, axis=1), 1)
    # Of a cap round any direction before the head, as many lie in it as its share of the area says.
    for axis in ([0, 0, -1], [0.6, 0, -0.8], [0, -0.6, -0.8]):
        inside = (ways @ axis > 0.8).sum()
        assert inside == pytest.approx(LAMPS * 0.2 / 1.35, abs=3)


def test_lights_come_mostly_from_before_and_above():
    random = np.random.default_rng(0)
    lights = np.array([a_light(random) for _ in range(200)])
    assert lights.min() > 0
    towards = (lights @ lamps()).mean(axis=0)
    assert towards[2] < 0
    assert towards[1] < 0
    assert abs(towards[0]) < 0.1


def test_a_seed_gives_one_light():
    one, other = (a_light(np.random.default_rng(3)) for _ in range(2))
    np.testing.assert_array_equal(one, other)
