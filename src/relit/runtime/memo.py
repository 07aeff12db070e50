"""Keeping what was computed: while a keeper is open, a step that gets what it got before gives what it gave.

Steps are functions marked by `remembered`: pure ones, whose results nobody changes. So whoever tries many
settings on the same photos, as a person in the studio does, waits only for the steps that a change reaches,
and no step has to know.
"""

from __future__ import annotations

import inspect
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, nullcontext
from contextvars import ContextVar
from dataclasses import fields, is_dataclass
from functools import partial, wraps
from typing import Any, NamedTuple, ParamSpec, TypeVar

import numpy as np

from relit.runtime.lru import LRU

OF_ONE_CALL = 400_000_000  # bytes: two faces under 100 lamps, of up to 155 MB each, and the small steps
_PLAIN = frozenset([type(None), bool, int, float, str])  # what most values are, and holds nothing

Given = ParamSpec("Given")
Made = TypeVar("Made")

_open: ContextVar[tuple[Keeper, Callable[[], None]] | None] = ContextVar("keeper", default=None)


class Keeper(ABC):
    """What keeps results of steps: a `Memo`, or one that keeps them elsewhere."""

    @contextmanager
    def open(self, go_on: Callable[[], None] = lambda: None) -> Iterator[None]:
        """Let the steps of this thread, and of those that `threads.pool` lends it, be kept here.

        Before a step is done, `go_on` is called: what it raises ends the work.
        """
        token = _open.set((self, go_on))
        try:
            yield
        finally:
            _open.reset(token)

    @abstractmethod
    def recall(self, step: Callable[..., Made], given: dict[str, Any], go_on: Callable[[], None]) -> Made:
        """Return what a step gives, without doing it if that is kept."""


class Memo(Keeper):
    """The latest results of all steps, in memory.

    Parameters
    ----------
    most_bytes : int
        How much the arrays in them, and in what they were made of, may hold; what was not asked for longest
        is forgotten.
    each : int
        Of how many calls of a step: by default of both photos at two sizes, now and before. More only take
        time to look through.

    Examples
    --------
    >>> @remembered
    ... def double(values):
    ...     print("computing")
    ...     return 2 * values
    >>> memo = Memo()
    >>> with memo.open():
    ...     [double(np.arange(3)).tolist() for _ in range(2)]
    computing
    [[0, 2, 4], [0, 2, 4]]
    """

    def __init__(self, most_bytes: int = 100_000_000, each: int = 8) -> None:
        self._most_bytes, self._each = most_bytes, each
        self._results: LRU[object, _Result] = LRU(most_bytes, lambda result: result.arrays)

    @property
    def size(self) -> int:
        """Bytes that the arrays in it hold, each counted once."""
        return self._results.size

    @property
    def arrays(self) -> Mapping[int, int]:
        """Bytes of each of them, by what tells one from another."""
        return self._results.parts

    def recall(self, step: Callable[..., Made], given: dict[str, Any], go_on: Callable[[], None]) -> Made:
        """Return what a step gives, without doing it if it was done lately."""
        known = [(key, result) for key, result in self._results.items() if result.step is step]
        for key, result in reversed(known):
            if same(result.given, given):
                self._results.get(key)  # marks it as used
                return result.made  # type: ignore[no-any-return]
        go_on()
        made = step(**given)
        arrays = _arrays((given, made))
        if sum(arrays.values()) <= self._most_bytes:
            if len(known) == self._each:
                self._results.pop(known[0][0])
            self._results.put(object(), _Result(step, given, made, arrays))
        return made


@contextmanager
def doing_once(go_on: Callable[[], None] = lambda: None) -> Iterator[None]:
    """Let each step within be done once: open a `Memo`, unless a keeper is open that sees to it.

    Before a step is done, `go_on` is called: what it raises ends the work.

    Examples
    --------
    >>> done = []
    >>> step = remembered(lambda value: done.append(value))
    >>> with doing_once():
    ...     step(1), step(2), step(1)
    (None, None, None)
    >>> done
    [1, 2]
    """
    with nullcontext() if _open.get() else Memo(OF_ONE_CALL).open(go_on):
        yield


class _Result(NamedTuple):
    step: Callable[..., Any]
    given: dict[str, Any]
    made: Any
    arrays: Mapping[int, int]


def remembered(step: Callable[Given, Made]) -> Callable[Given, Made]:
    """Mark a pure function, so that an open `Keeper` may keep its results."""
    signature = inspect.signature(step)

    @wraps(step)
    def recalled(*args: Given.args, **named: Given.kwargs) -> Made:
        opened = _open.get()
        if opened is None:
            return step(*args, **named)
        keeper, go_on = opened
        bound = signature.bind(*args, **named)
        bound.apply_defaults()
        return keeper.recall(step, dict(bound.arguments), go_on)

    return recalled


def same(one: Any, other: Any) -> bool:
    """Return whether two values are of one type and content, arrays and dataclasses included.

    Examples
    --------
    >>> same({"a": np.zeros(2)}, {"a": np.zeros(2)}), same(np.zeros(2), np.zeros(2, int)), same([1], [2])
    (True, False, False)
    """
    if one is other:
        return True
    if type(one) is not type(other):
        return False
    if isinstance(one, np.ndarray):
        return one.dtype == other.dtype and np.array_equal(one, other)
    parts, others = _parts(one), _parts(other)
    if parts is None or others is None:
        return bool(one == other)
    return len(parts) == len(others) and all(map(same, parts, others))


def size_of(value: Any) -> int:
    """Return how many bytes the arrays in a value hold, each counted once.

    Examples
    --------
    >>> size_of({"a": [one := np.zeros(2), np.zeros((2, 2), np.uint8)], "b": one})
    20
    """
    return sum(_arrays(value).values())


def _arrays(value: Any) -> dict[int, int]:
    """Return the bytes of the arrays in a value, by what tells one from another."""
    found: dict[int, int] = {}
    waiting = [value]
    while waiting:
        one = waiting.pop()
        if type(one) in _PLAIN:
            continue
        if isinstance(one, np.ndarray):
            found[id(one)] = int(one.nbytes)
        else:
            # What a dataclass has worked out of its fields and kept, it holds as well.
            waiting += list(vars(one).values()) if is_dataclass(one) else _parts(one) or ()
    return found


def _parts(value: Any) -> list[Any] | None:
    """Return what a value is made of, None if it is one thing."""
    if is_dataclass(value):
        return [getattr(value, part.name) for part in fields(value)]
    if isinstance(value, partial):  # what is yet to be made holds what it will be made of
        return [value.func, *value.args, *value.keywords.values()]
    if isinstance(value, Mapping):
        return [*value.keys(), *value.values()]
    return list(value) if isinstance(value, (list, tuple)) else None
