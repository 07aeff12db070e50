"""Keeping from stderr what libraries in C write there."""

from __future__ import annotations

import os
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from tempfile import TemporaryFile

_alone = threading.Lock()  # there is one stderr, which two threads would take from one another for good


@contextmanager
def muted(is_unwanted: Callable[[bytes], bool]) -> Iterator[None]:
    """Keep lines from stderr while the block lasts; all else that is written there comes after it.

    Where stderr is closed, as of a service, or nothing can be put aside, all is as if this were not here.
    """
    with _alone:
        try:
            meanwhile, stderr = TemporaryFile(), os.dup(2)  # noqa: SIM115 (closed below)
        except OSError:
            yield
            return
        with meanwhile:
            os.dup2(meanwhile.fileno(), 2)
            try:
                yield
            finally:
                os.dup2(stderr, 2)
                os.close(stderr)
                meanwhile.seek(0)
                lines = meanwhile.read().splitlines(keepends=True)
                os.write(2, b"".join(line for line in lines if not is_unwanted(line)))
