"""What was asked for lately, in memory, as much as fits: a cache bounded by bytes."""

from __future__ import annotations

import threading
from collections.abc import Callable, Hashable, Mapping
from typing import Any, Generic, TypeVar

Key = TypeVar("Key", bound=Hashable)
Value = TypeVar("Value")


class LRU(Generic[Key, Value]):
    """Values by key; where they no longer fit, those least recently used go first.

    Threads may share one. A pickled one comes back empty.

    Parameters
    ----------
    most_bytes : int
        How much the values may hold together.
    measure : callable
        Returns the bytes of the parts of a value, by what tells one part from another: a part that several
        values share counts once. It is asked again each time, since values may grow.

    Examples
    --------
    >>> cache = LRU(10, lambda text: {text: len(text)})
    >>> for word in ("light", "face", "mouth"):
    ...     cache.put(word[0], word)
    >>> cache.get("l"), cache.get("f"), cache.size
    (None, 'face', 9)
    """

    def __init__(self, most_bytes: int, measure: Callable[[Value], Mapping[Any, int]]) -> None:
        self._most_bytes, self._measure = most_bytes, measure
        self._values: dict[Key, Value] = {}  # the least recently used first
        self._lock = threading.RLock()

    def __reduce__(self) -> tuple[Any, ...]:
        """Leave the values behind."""
        return LRU, (self._most_bytes, self._measure)

    def __len__(self) -> int:
        """Return the number of values."""
        return len(self._values)

    @property
    def size(self) -> int:
        """Bytes that the values hold."""
        return sum(self.parts.values())

    @property
    def parts(self) -> Mapping[Any, int]:
        """Bytes of each part of the values."""
        return {part: held for _, value in self.items() for part, held in self._measure(value).items()}

    @property
    def excess(self) -> int:
        """Bytes by which they hold too much."""
        return max(self.size - self._most_bytes, 0)

    def items(self) -> list[tuple[Key, Value]]:
        """Return keys and values, the least recently used first; that does not count as use."""
        with self._lock:
            return list(self._values.items())

    def get(self, key: Key) -> Value | None:
        """Return a value, which is the most recently used one from now on; None if there is none."""
        with self._lock:
            if key in self._values:
                self._values[key] = self._values.pop(key)
            return self._values.get(key)

    def put(self, key: Key, value: Value, *spared: Key) -> None:
        """Add a value, and make room for it; those of the keys `spared` stay as well."""
        with self._lock:
            self._values.pop(key, None)
            self._values[key] = value
            self.make_room(key, *spared)

    def pop(self, key: Key) -> Value | None:
        """Forget a value and return it."""
        with self._lock:
            return self._values.pop(key, None)

    def make_room(self, *spared: Key) -> None:
        """Forget values until the others fit; those of the keys `spared` stay in any case."""
        with self._lock:
            for key in [key for key in self._values if key not in spared]:
                if not self.excess:
                    break
                del self._values[key]
