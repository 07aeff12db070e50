"""Bounding what OpenCV does on its own: threads are this package's to share out."""

from __future__ import annotations

from contextlib import contextmanager
from functools import partial
from typing import TYPE_CHECKING

import cv2

from relit.runtime.held import Held

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator


def _hold() -> Callable[[], None]:
    before = cv2.getNumThreads()
    cv2.setNumThreads(1)
    return partial(cv2.setNumThreads, before)


_one = Held(_hold)


@contextmanager
def one_opencv_thread() -> Iterator[None]:
    """Keep OpenCV to the thread that calls it: its own would wait for those of a `pool` beside it.

    What a user has set is set again when nobody is inside.

    Examples
    --------
    >>> before = cv2.getNumThreads()
    >>> with one_opencv_thread():
    ...     cv2.getNumThreads()
    1
    >>> cv2.getNumThreads() == before
    True
    """
    with _one.inside():
        yield
