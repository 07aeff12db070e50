"""A cache bounded by bytes, against one that is kept by hand."""

import pickle
import threading

from hypothesis import given
from hypothesis import strategies as st

from relit.runtime.lru import LRU


def letters(text):
    """Return what a text holds: each of its letters once, wherever it occurs."""
    return dict.fromkeys(text, 1)


STEPS = st.lists(st.tuples(st.sampled_from(["get", "put", "pop"]), st.integers(0, 5), st.text("abcdef")))


@given(st.integers(0, 5), STEPS)
def test_against_a_list(most, steps):
    cache, by_hand = LRU(most, letters), []  # keys and values, the latest last
    for do, key, text in steps:
        there = [pair for pair in by_hand if pair[0] == key]
        value = there[0][1] if there else None
        by_hand = [pair for pair in by_hand if pair[0] != key]
        if do == "put":
            cache.put(key, text)
            by_hand.append((key, text))
            while len(by_hand) > 1 and len(set("".join(held for _, held in by_hand))) > most:
                del by_hand[0]
        elif do == "get":
            assert cache.get(key) == value
            by_hand += there
        else:
            assert cache.pop(key) == value
        assert cache.items() == by_hand
        assert len(cache) == len(by_hand)
        assert cache.size == len(set("".join(held for _, held in by_hand)))


def test_values_may_grow_and_some_are_spared():
    cache = LRU(10, lambda value: {id(value): len(value)})
    values = {key: [0] * 2 for key in "abcd"}
    for key, value in values.items():
        cache.put(key, value)
    values["c"].extend([0] * 9)
    assert cache.excess == 7
    cache.make_room("a", "c")
    assert [key for key, _ in cache.items()] == ["a", "c"]
    cache.make_room("c")
    assert [key for key, _ in cache.items()] == ["c"]
    cache.make_room()
    assert len(cache) == cache.excess == 0


def test_a_pickled_one_comes_back_empty():
    cache = LRU(5, letters)
    cache.put(1, "abc")
    back = pickle.loads(pickle.dumps(cache))
    assert len(back) == 0
    back.put(1, "abcde")
    back.put(2, "f")
    assert [key for key, _ in back.items()] == [2]


def test_threads():
    cache, wrong = LRU(50, lambda number: {number: number}), []

    def use(start):
        for turn in range(500):
            number = (start * turn) % 23
            cache.put(number, number)
            wrong.extend({cache.get(number)} - {None, number})

    threads = [threading.Thread(target=use, args=(start,)) for start in (3, 5, 7, 11)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert wrong == []
    assert cache.size <= 50
