"""Layers that turn one picture into another, held against the formulas of W3C's Compositing and Blending."""

import hypothesis.extra.numpy as arrays
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from relit.photo.layers import as_mask, box_of, change_in_layers
from relit.photo.photo import Photo


def dodged(below, layer):
    """As https://www.w3.org/TR/compositing-1/#blendingcolordodge has it, in [0, 1]."""
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(below == 0, 0, np.where(layer == 1, 1, np.minimum(1, below / (1 - layer))))


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
@pytest.mark.parametrize("rounded", [False, True])
@given(data=st.data())
def test_dodged_and_multiplied_a_picture_is_the_other_to_a_level(data, dtype, rounded):
    full = int(np.iinfo(dtype).max)
    shape = data.draw(arrays.array_shapes(min_dims=3, max_dims=3, max_side=5))
    before = data.draw(arrays.arrays(dtype, shape, elements=st.integers(1, full)))
    after = data.draw(arrays.arrays(dtype, shape, elements=st.integers(0, full)))
    lower, upper = change_in_layers(before, after)
    assert lower.dtype == upper.dtype == dtype
    made = dodged(before / full, lower / full)
    if rounded:  # as programs do that keep integers between layers
        made = np.rint(made * full) / full
    made = np.rint(made * upper / full * full)
    assert np.abs(made - after.astype(int)).max() <= 1
    np.testing.assert_array_equal(lower[after <= before], 0)
    np.testing.assert_array_equal(upper[after == before], full)


def test_all_pairs_of_8_bit_levels_are_met_to_a_level():
    before, after = (levels.astype(np.uint8) for levels in np.mgrid[1:256, 0:256])
    lower, upper = change_in_layers(before, after)
    made = np.rint(np.rint(dodged(before / 255, lower / 255) * 255) * (upper / 255))
    assert np.abs(made - after).max() <= 1


def test_of_a_tall_picture_all_rows_are_turned():
    before, after = np.full((1000, 2), 100, np.uint8), np.full((1000, 2), 50, np.uint8)
    lower, upper = change_in_layers(before, after)
    assert (lower == 0).all()
    assert (upper == 128).all()


@given(arrays.arrays(bool, arrays.array_shapes(min_dims=2, max_dims=2, max_side=6)))
def test_a_box_is_the_smallest_that_holds_all(plane):
    box = box_of(plane)
    if box is None:
        assert not plane.any()
        return
    assert plane[box].sum() == plane.sum()
    for edge in (plane[box][0], plane[box][-1], plane[box][:, 0], plane[box][:, -1]):
        assert edge.any()


def test_a_mask_is_white_and_as_opaque_as_its_share():
    share = np.zeros((5, 7), np.float32)
    share[2, 3], share[3, 4] = 1, 0.5
    mask = as_mask("Face", share, Photo(np.zeros((5, 7, 3), np.uint8)))
    assert (mask.left, mask.top, mask.visible) == (3, 2, False)
    assert mask.photo.alpha.tolist() == [[255, 0], [0, 128]]
    assert (mask.photo.pixels == 255).all()
    assert mask.photo.pixels.shape == (2, 2, 3)


def test_there_is_no_mask_of_nothing():
    assert as_mask("Face", np.zeros((5, 7), np.float32), Photo(np.zeros((5, 7), np.uint8))) is None
