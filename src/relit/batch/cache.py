"""Results on disk."""

from __future__ import annotations

from contextlib import contextmanager
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path


class DiskCache:
    """Results of expensive steps."""

    def __init__(self, folder: Path, most_bytes: int) -> None:
        self.folder, self.most_bytes = folder, most_bytes

    @contextmanager
    def open(self) -> Iterator[None]:
        """Let steps use it."""
        yield
