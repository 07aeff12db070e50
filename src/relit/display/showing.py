"""Show photos and results: as a notebook's output, in a terminal's colours, or else in words."""

from __future__ import annotations

import shutil
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from relit.display.half_blocks import half_blocks
from relit.display.html import LONGEST, image_html, result_html, row_html
from relit.display.small import small
from relit.errors import ImageError
from relit.photo.foreign_images import opened, pixels_of
from relit.photo.pixels import size_and_dtype
from relit.results import TransferResult

if TYPE_CHECKING:
    from collections.abc import Sequence

    from relit.photo.foreign_images import AnyImage

    Showable = AnyImage | TransferResult

_LINES_KEPT = 3  # of a terminal, for what is told below and the next prompt


def show(what: Showable | Sequence[Showable], *, caption: str | Sequence[str] = "") -> None:
    """Show a result or an image, or several, wherever this runs.

    In a notebook they become its output; a result has a slider between before and after, and its stages. In
    a terminal they are drawn in its colours, two pixels to a character; a result before and after. Where
    stdout is neither, their sizes are told. No window is opened, and nothing is written to disk.

    Parameters
    ----------
    what : TransferResult, array, Photo, PIL image, torch tensor, path, or list of such
    caption : str or list of str, optional
        Of a list, one for each.

    Raises
    ------
    ImageError
        If something is of another kind, or cannot be read; or captions are not as many as there are images.

    Examples
    --------
    >>> import numpy as np
    >>> show(np.zeros((20, 30, 3), np.uint8), caption="black")
    black: 30x20 uint8
    """
    several = list(what) if isinstance(what, (list, tuple)) else [what]
    captions = list(caption) if isinstance(caption, (list, tuple)) else [str(caption)] * len(several)
    if len(captions) != len(several):
        raise ImageError(
            f"caption: expected as many as there are images, {len(several)}, got {len(captions)}"
        )
    both = list(zip(several, captions, strict=True))
    text = "\n".join(_told(one, told) for one, told in both)
    if _in_notebook():
        parts = [_html(one, told) for one, told in both]
        page = row_html(parts) if len(parts) > 1 else "".join(parts)
        sys.modules["IPython"].display.display({"text/html": page, "text/plain": text}, raw=True)
    elif sys.stdout.isatty():
        columns, lines = shutil.get_terminal_size()
        for one, told in both:
            sys.stdout.write(f"{_drawn(one, columns, lines - _LINES_KEPT)}\n{_told(one, told)}\n")
    else:
        sys.stdout.write(f"{text}\n")


def _in_notebook() -> bool:
    """Return whether this process is the kernel of a notebook; who is in one has IPython loaded."""
    ipython = sys.modules.get("IPython")
    shell: Any = ipython.get_ipython() if ipython else None
    return getattr(shell, "kernel", None) is not None


def _html(one: Any, caption: str) -> str:
    if isinstance(one, TransferResult):
        return result_html(one)
    return image_html(one, caption or _told(one, ""))


def _drawn(one: Any, columns: int, lines: int) -> str:
    """Return an image as a terminal shows it; a result as before and after, side by side."""
    if not isinstance(one, TransferResult):
        return half_blocks(small(one, LONGEST), columns, lines)
    halves = (
        half_blocks(small(pixels_of(image, "image"), LONGEST), (columns - 1) // 2, lines).split("\n")
        for image in (one.target, one.image)
    )
    return "\n".join(" ".join(pair) for pair in zip(*halves, strict=True))


def _told(one: Any, caption: str) -> str:
    """Return what an image is, in words."""
    if isinstance(one, TransferResult):
        words = repr(one)
    else:
        name = f"{Path(one).name}, " if isinstance(one, (str, Path)) else ""
        words = name + size_and_dtype(opened(one, "image").photo.pixels)
    return f"{caption}: {words}" if caption else words
