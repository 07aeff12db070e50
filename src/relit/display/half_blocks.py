"""Pictures as text: two pixels to a character, in the 24-bit colours of a terminal."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from PIL import Image

if TYPE_CHECKING:
    from numpy.typing import NDArray

_PLAIN = "\x1b[0m"


def half_blocks(picture: Image.Image, columns: int, lines: int) -> str:
    r"""Return a picture as text of at most so many columns and lines.

    A character is twice as high as it is wide: the upper half shows one pixel, the lower half the next.

    Examples
    --------
    >>> half_blocks(Image.new("RGB", (1, 2), (255, 0, 10)), 80, 24)
    '\x1b[38;2;255;0;10m\x1b[48;2;255;0;10m▀\x1b[0m'
    """
    colored = picture.convert("RGBA")
    seen = Image.alpha_composite(Image.new("RGBA", colored.size, "white"), colored).convert("RGB")
    seen.thumbnail((max(columns, 1), 2 * max(lines, 1)), Image.Resampling.LANCZOS)
    pixels = np.asarray(seen)
    if len(pixels) % 2:
        pixels = np.concatenate([pixels, pixels[-1:]])
    return "\n".join(_line(*two) for two in zip(pixels[::2], pixels[1::2], strict=True))


def _line(upper: NDArray[np.uint8], lower: NDArray[np.uint8]) -> str:
    """Return two rows of pixels as a line."""
    halves = (
        f"\x1b[38;2;{r};{g};{b}m\x1b[48;2;{x};{y};{z}m▀"
        for (r, g, b), (x, y, z) in zip(upper.tolist(), lower.tolist(), strict=True)
    )
    return "".join(halves) + _PLAIN
