"""Pictures as text for a terminal."""

import re

import numpy as np
from PIL import Image

from relit.display.half_blocks import half_blocks

CELL = re.compile(r"\x1b\[38;2;(\d+);(\d+);(\d+)m\x1b\[48;2;(\d+);(\d+);(\d+)m▀")


def as_pixels(text):
    """Return what a terminal would show of it."""
    rows = []
    for line in text.split("\n"):
        cells = np.array(CELL.findall(line), int)
        assert CELL.sub("", line) == "\x1b[0m"
        rows += [cells[:, :3], cells[:, 3:]]
    return np.array(rows)


def test_every_pixel_is_there_in_its_place():
    pixels = np.random.default_rng(0).integers(0, 256, (6, 5, 3)).astype(np.uint8)
    np.testing.assert_array_equal(as_pixels(half_blocks(Image.fromarray(pixels), 80, 24)), pixels)


def test_an_odd_row_is_doubled():
    pixels = np.arange(27, dtype=np.uint8).reshape(3, 3, 3)
    np.testing.assert_array_equal(
        as_pixels(half_blocks(Image.fromarray(pixels), 80, 24)), pixels[[0, 1, 2, 2]]
    )


def test_it_fits_the_terminal_and_keeps_its_shape():
    shown = as_pixels(half_blocks(Image.new("L", (400, 200), 9), 40, 24))
    assert shown.shape == (20, 40, 3)
    assert as_pixels(half_blocks(Image.new("L", (200, 400), 9), 80, 10)).shape == (20, 10, 3)


def test_what_is_transparent_is_white():
    assert (as_pixels(half_blocks(Image.new("RGBA", (2, 2), (0, 0, 0, 0)), 80, 24)) == 255).all()
