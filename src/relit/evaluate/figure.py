"""The paper's Fig. 5: a transfer beside its truth, where they differ, and by how much how often."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from relit.evaluate.evaluation import Images
from relit.figures import INK, PAPER, page, strip

_HEIGHT = 300
_LEVELS = 128  # of difference that the histogram shows; nearly all pixels differ by less
_BARS, _LINE = (120, 150, 190), (200, 60, 40)


def truth_figure(rows: Sequence[tuple[str, Images, str]]) -> NDArray[np.uint8]:
    """Draw transfers whose truth is known, one below the other.

    Parameters
    ----------
    rows : sequence of (str, Images, str)
        What to call a transfer, its images, and the method to show.

    Returns
    -------
    (H, W, 3) uint8 array
    """
    strips = []
    for name, images, method in rows:
        difference = np.abs(images.relit[method] - images.truth)
        if difference.ndim == 3:
            difference = difference.mean(axis=2)
        panels: dict[str, NDArray[Any]] = {
            f"{name}: target": images.target,
            "reference": images.reference,
            "relit": images.relit[method],
            "truth": images.truth,
            f"4 x difference; mean {difference.mean() / 2.55:.1f} %": 4 * difference,
            "how often, and accumulated": difference_histogram(difference),
        }
        pictures = [np.clip(np.rint(panel), 0, 255).astype(np.uint8) for panel in panels.values()]
        strips.append(strip([*zip(panels, pictures, strict=True)], _HEIGHT))
    return page(strips)


def difference_histogram(difference: NDArray[np.float64], height: int = _HEIGHT) -> NDArray[np.uint8]:
    """Draw how many pixels differ by so many grey levels, and the share that differs by at most as many.

    Parameters
    ----------
    difference : array
        Absolute differences, in grey levels of 255.
    height : int
        Of the picture, in px.

    Returns
    -------
    (height, W, 3) uint8 array

    Examples
    --------
    >>> import numpy as np
    >>> difference_histogram(np.array([0.0, 1, 1, 40])).shape
    (300, 474, 3)
    """
    counts = np.bincount(np.minimum(np.rint(difference).astype(int), 255).ravel(), minlength=256)
    share = counts / counts.sum()
    text, step = height // 20, 3
    left, right, top, bottom = 2 * text, 4 * text, text, 3 * text
    width, tall = _LEVELS * step, height - top - bottom
    base = top + tall
    picture = Image.new("RGB", (left + width + right, height), PAPER)
    draw, font = ImageDraw.Draw(picture), ImageFont.load_default(text)
    xs = range(left, left + width, step)
    for x, bar in zip(xs, share / share.max() * tall, strict=False):
        draw.rectangle((x, base - bar, x + step - 1, base), fill=_BARS)
    heights = base - np.cumsum(share) * tall
    draw.line([(x + step / 2, y) for x, y in zip(xs, heights, strict=False)], fill=_LINE, width=2)
    draw.rectangle((left, top, left + width, base), outline=INK)
    for level in range(0, _LEVELS, 32):
        draw.text((left + level * step, base + text // 3), str(level), fill=INK, font=font)
    for percent in (0, 50, 100):
        y = base - percent / 100 * tall - text // 2
        draw.text((left + width + 4, y), f"{percent}%", fill=_LINE, font=font)
    draw.text((left, base + 3 * text // 2), "grey levels of difference", fill=INK, font=font)
    return np.asarray(picture)
