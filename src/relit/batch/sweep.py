"""What killed processes leave behind, taken away."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable


class Sweep:
    """Takes away the unfinished files of processes that were killed.

    A run that goes on does so before its first row in a folder; every run, for workers of its own that died,
    when all its rows are through. Nobody else is at work there then: the journal is this run's.
    """

    def __init__(self, root: str, *, after_another: bool) -> None:
        self._root, self._after_another, self._entered = root, after_another, set[Path]()

    def enter(self, files: Iterable[str]) -> None:
        """Get ready for rows that write these files."""
        if "://" in self._root:
            return
        for folder in {Path(self._root, name).parent for name in files} - self._entered:
            self._entered.add(folder)
            if self._after_another:
                _clear(folder)

    def leave(self) -> None:
        """Clear all folders that were entered."""
        for folder in self._entered:
            _clear(folder)


def _clear(folder: Path) -> None:
    for path in folder.glob(".relit-*.tmp"):
        with suppress(OSError):
            path.unlink()
