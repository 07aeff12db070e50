"""The stopwatch."""

import time

import pytest

from relit.runtime.timing import Stopwatch


def test_it_adds_up_by_stage_also_when_the_work_fails():
    watch = Stopwatch()
    for _ in range(2):
        with pytest.raises(KeyError), watch("one"):
            _fail_late()
    with watch("two"):
        pass
    watch.add("two", 5)
    assert list(watch.seconds) == ["one", "two"]
    assert watch.seconds["one"] >= 0.04
    assert watch.seconds["two"] >= 5


def _fail_late():
    time.sleep(0.02)
    raise KeyError
