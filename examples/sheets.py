"""Strips of pictures on a page."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from relit.figures import page

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray
    from PIL import Image


def columns(strips: Sequence[Image.Image], number: int) -> NDArray[np.uint8]:
    """Return strips in columns, read downwards."""
    rows = -(-len(strips) // number)
    parts = [page(strips[start : start + rows]) for start in range(0, len(strips), rows)]
    height = max(len(part) for part in parts)
    return np.concatenate(
        [np.pad(part, ((0, height - len(part)), (0, 0), (0, 0)), constant_values=255) for part in parts],
        axis=1,
    )
