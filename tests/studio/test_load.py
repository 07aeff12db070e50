"""Honest and hostile clients at once: the load benchmark, for a few seconds."""

import pytest

from benchmarks.load import BOUND, load

pytestmark = [pytest.mark.slow, pytest.mark.e2e]


@pytest.mark.rotating
def test_the_honest_are_served_and_the_hostile_refused():
    tally, peak = load(clients=8, seconds=6)
    assert tally.wrong == []
    assert peak <= BOUND
    for kind in ("render 200", "photo 200", "bomb 400", "stranger 403"):
        assert tally.counts[kind] > 0
    assert sum(count for kind, count in tally.counts.items() if kind.startswith("flood")) > 0
