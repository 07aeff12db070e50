"""A setting of the whole process, held for as long as any thread wants it."""

from __future__ import annotations

from contextlib import contextmanager
from threading import Lock
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator


class Held:
    """What the first to go in sets, and the last to leave sets back; to go in again costs nothing.

    Parameters
    ----------
    hold : callable
        Sets it, and returns what sets it back.

    Examples
    --------
    >>> told = []
    >>> held = Held(lambda: told.append("set") or (lambda: told.append("back")))
    >>> with held.inside(), held.inside():
    ...     pass
    >>> told
    ['set', 'back']
    """

    def __init__(self, hold: Callable[[], Callable[[], None]]) -> None:
        self._hold, self._lock, self._inside = hold, Lock(), 0
        self._set_back: Callable[[], None] | None = None

    @contextmanager
    def inside(self) -> Iterator[None]:
        """Hold it meanwhile."""
        with self._lock:
            if self._set_back is None:
                self._set_back = self._hold()
            self._inside += 1
        try:
            yield
        finally:
            with self._lock:
                self._inside -= 1
                if self._inside == 0:
                    self._set_back()
                    self._set_back = None
