"""Results that are kept: always what the step would have given, and no more than they may hold."""

import threading
from dataclasses import dataclass
from functools import partial

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import relit.face.person
from relit.face.detect import detect_landmarks
from relit.photo.reading import read_image
from relit.photo.resampling import reduced
from relit.photo.samples import sample
from relit.relighting import transfer
from relit.runtime.memo import Memo, doing_once, remembered, same, size_of
from relit.runtime.threads import pool
from relit.settings.options import TransferOptions


@dataclass(eq=False)
class Pair:
    one: np.ndarray
    other: object


def counted():
    calls = []

    @remembered
    def step(values, power=1, *, extra=()):
        calls.append(values)
        return [values**power, *extra]

    return step, calls


def test_without_an_open_memo_every_call_computes():
    step, calls = counted()
    step(np.ones(3))
    step(np.ones(3))
    assert len(calls) == 2


def test_what_is_spelled_differently_is_the_same_call():
    step, calls = counted()
    with Memo().open():
        step(np.ones(3), 1)
        step(values=np.ones(3))
        step(np.ones(3), power=1, extra=())
    assert len(calls) == 1


def test_another_memo_knows_nothing():
    step, calls = counted()
    for _ in range(2):
        with Memo().open():
            step(np.ones(3))
    assert len(calls) == 2


def test_threads_of_a_pool_use_the_memo():
    step, calls = counted()
    with Memo().open():
        for _ in range(2):
            with pool(2) as run:
                run(step, [np.full(3, k) for k in range(4)])
    assert len(calls) == 4


def test_what_was_not_asked_for_longest_is_forgotten():
    step, calls = counted()
    one = np.ones(100)  # 800 bytes, and as many of its result
    with Memo(most_bytes=3 * 1600).open():
        for k in (1, 2, 3, 1, 4):  # 2 makes room for 4
            step(k * one)
        assert len(calls) == 4
        step(one)
        assert len(calls) == 4
        step(2 * one)
        assert len(calls) == 5


def test_an_array_that_several_results_share_counts_once():
    calls = []

    @remembered
    def beside(values, number):
        calls.append(number)
        return values, number

    one = np.ones(100)  # 800 bytes
    memo = Memo(most_bytes=1000)
    with memo.open():
        for number in (1, 2, 3, 1, 2, 3):
            assert beside(one, number)[0] is one
    assert (calls, memo.size) == ([1, 2, 3], 800)


def test_what_is_too_large_is_given_but_not_kept():
    step, calls = counted()
    with Memo(most_bytes=100).open():
        step(np.ones(3))
        assert step(np.ones(100))[0].sum() == 100
        step(np.ones(100))
        assert len(calls) == 3
        step(np.ones(3))
    assert len(calls) == 3


def test_work_can_be_called_off_before_a_step():
    step, calls = counted()

    def stop():
        raise InterruptedError

    memo = Memo()
    with memo.open():
        step(np.ones(3))
    with memo.open(stop):
        step(np.ones(3))  # nothing to do
        with pytest.raises(InterruptedError):
            step(np.zeros(3))
    assert len(calls) == 1


VALUES = st.recursive(
    st.integers(0, 2) | st.sampled_from(["a", None, 1.0, True]) | st.builds(np.arange, st.integers(0, 3)),
    lambda inner: (
        st.lists(inner, max_size=3)
        | st.dictionaries(st.sampled_from("ab"), inner)
        | st.builds(Pair, st.builds(np.zeros, st.integers(0, 2)), inner)
    ),
    max_leaves=6,
)


def spelled(value):
    """Return a text that tells values apart by type and content."""
    if isinstance(value, np.ndarray):
        return f"array({value.dtype}, {value.shape}, {value.tolist()})"
    if isinstance(value, Pair):
        return f"Pair({spelled(value.one)}, {spelled(value.other)})"
    if isinstance(value, dict):
        return f"{{{', '.join(f'{key}: {spelled(part)}' for key, part in value.items())}}}"
    if isinstance(value, list):
        return f"[{', '.join(map(spelled, value))}]"
    return f"{type(value).__name__}({value!r})"


@given(VALUES, VALUES)
@settings(max_examples=300)
def test_same_is_same_type_and_content(one, other):
    assert same(one, other) == (spelled(one) == spelled(other))
    assert same(one, one)


def test_bytes_are_counted_through_all_that_holds_arrays():
    assert size_of((Pair(np.zeros(4), {"a": [np.zeros(2, np.uint8)]}), "text")) == 34
    assert size_of(partial(np.add, np.zeros(4), where=np.zeros(2, bool))) == 34


SETTINGS = [
    {},
    {"lam": 0.8},
    {"strength": 0.4, "shadows": 0.5},
    {"exposure": "take", "tint": "take"},
    {"method": "ltv", "mask": False},
    {"method": "ltv", "lam": 0.8},
    {"method": "ltv", "color_space": "hsv", "channels": "primary"},
    {"smoothing": 0.1},
    {"region": "left"},
]


def test_a_transfer_in_a_memo_is_the_transfer_without():
    """The order is random, and every second face has one point moved: whatever is kept must not show."""
    photos = [read_image(sample(role)) for role in ("target", "reference")]
    here, there = (detect_landmarks(photo.pixels).reduced(4).points for photo in photos)
    target, reference = (reduced(photo.pixels, 4) for photo in photos)
    rng = np.random.default_rng(7)
    with Memo(most_bytes=20_000_000).open():
        made = []
        for k in rng.permutation(2 * len(SETTINGS)):
            marks = here.copy()
            marks[1, :2] += k % 2
            pair = {"target_landmarks": marks, "reference_landmarks": there}
            options = TransferOptions(**SETTINGS[k // 2])
            made.append((pair, options, transfer(target, reference, **pair, options=options)))
    for pair, options, result in made:
        alone = transfer(target, reference, **pair, options=options)
        np.testing.assert_array_equal(result.image, alone.image)
        np.testing.assert_array_equal(result.first.warped, alone.first.warped)


def test_what_is_done_once_is_kept_by_who_keeps_already():
    step, calls = counted()
    with Memo().open():
        for _ in range(2):
            with doing_once():
                step(np.ones(3))
    assert len(calls) == 1


def test_who_stops_does_not_wait_for_what_has_not_begun():
    begun, stop = [], threading.Event()

    def work(item):
        begun.append(item)
        if item == 0:
            raise KeyboardInterrupt
        stop.wait(1)

    with pytest.raises(KeyboardInterrupt), pool(2) as run:
        run(work, range(200))
    assert len(begun) < 100  # as many as began before this thread had its turn


def test_a_transfer_looks_at_the_person_once(monkeypatch):
    seen = []
    see = relit.face.person.see_person
    monkeypatch.setattr(relit.face.person, "see_person", lambda *given: seen.append(1) or see(*given))
    transfer(read_image(sample("target")), read_image(sample("reference")))
    assert len(seen) == 2  # near and wide
