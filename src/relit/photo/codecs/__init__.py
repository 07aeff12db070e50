"""The formats: photos from and to the bytes of a file."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable

    #: Called with width, height and perhaps the bytes a pixel takes (3 by default), before any pixel is
    #: decoded; raises where they are too large.
    CheckSize = Callable[..., None]
