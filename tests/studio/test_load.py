"""Honest clients beside attackers: the load benchmark, for some seconds."""

import io

import numpy as np
import pytest
from PIL import Image

from benchmarks.attackers import ATTACKERS, black_png
from benchmarks.load import BOUND, SLOWER, load, slowed
from benchmarks.tally import Tally

pytestmark = [pytest.mark.slow, pytest.mark.e2e]


@pytest.mark.rotating
def test_the_honest_are_served_and_attackers_refused():
    phases = [*([name] for name in ATTACKERS), list(ATTACKERS)]
    tally, peak = load(clients=8, quiet=1.5, seconds=2, phases=phases)
    assert tally.wrong == []
    assert 0 < peak <= BOUND
    for kind in (
        *("many renders 503", "held uploads", "many sessions 503", "half a head", "shrunk face 400"),
        *("hung-up export", "black photo 200", "bomb 400", "stranger 403"),
    ):
        assert tally.counts[kind] > 0, kind


def test_what_is_slowed_is_told():
    tally = Tally()
    tally.seconds["quiet"]["render"] = [1.0] * 20
    tally.seconds["many_renders"]["render"] = [SLOWER * 0.99] * 20
    assert slowed(tally) == []
    tally.seconds["half_heads"]["render"] = [1.0] * 17 + [SLOWER * 1.01] * 3
    (told,) = slowed(tally)
    assert told.startswith("render: 5.05 s, 1.00 s in quiet")
    assert "(half_heads)" in told


def test_the_black_photo_is_one():
    with Image.open(io.BytesIO(black_png(100))) as photo:
        np.testing.assert_array_equal(photo, np.zeros((100, 100, 3), np.uint8))
