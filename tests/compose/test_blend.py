"""The way back into the photo."""

import numpy as np
import pytest

from relit.compose import blend as room
from relit.compose.blend import base_of
from relit.face.landmarks import Landmarks
from relit.face.views import view_of
from relit.photo.planes import plane_space
from relit.photo.resampling import Enlarger, reduced

COLOR = plane_space(False, False, "rgb", "all")


def blend(target, change, mask, space=COLOR, factor=1):
    """Blend a change over all of a photo, worked out on it reduced by a factor."""
    face = Landmarks([[1, 1], [3, 1], [1, 3]])
    view = view_of(target, face, (slice(0, target.shape[0]), slice(0, target.shape[1])), factor)
    return room.blend(target, view, change, mask, space, base_of(view.pixels))


def photo(dtype, shape=(20, 30, 3)):
    target = np.random.default_rng(0).random(shape)
    return (
        target.astype(dtype) if np.dtype(dtype).kind == "f" else (target * np.iinfo(dtype).max).astype(dtype)
    )


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.float32, np.float64])
def test_what_is_outside_stays_bit_for_bit_and_the_rest_is_multiplied(dtype):
    target = photo(dtype)
    mask = np.zeros((20, 30), np.float32)
    mask[5:10, 5:10], mask[7, 7] = 0.5, 1
    change = np.random.default_rng(1).normal(0, 0.3, (20, 30, 3)).astype(np.float32)
    out = blend(target, change, mask)
    assert out.dtype == dtype
    np.testing.assert_array_equal(out[mask == 0], target[mask == 0])
    scale = 1 if np.dtype(dtype).kind == "f" else np.iinfo(dtype).max
    for y, x in ((7, 7), (5, 5)):
        expected = np.clip(target[y, x] / scale * np.exp(mask[y, x] * change[y, x]), 0, 1)
        np.testing.assert_allclose(out[y, x] / scale, expected, atol=0.51 / min(scale, 255) + 1e-6)


@pytest.mark.parametrize("factor", [2, 3])
def test_a_smooth_change_is_the_same_at_any_size(factor):
    target = photo(np.uint8, (60, 90, 3))
    y, x = np.mgrid[:60, :90]
    smooth = np.stack([np.sin(x / 25) / 3, np.cos(y / 30) / 4, (x + y) / 600], axis=-1).astype(np.float32)
    whole = blend(target, smooth, None)
    small = blend(target, reduced(smooth, factor), None, factor=factor)
    error = np.abs(whole.astype(int) - small)[factor:-factor, factor:-factor]
    assert np.sqrt((error**2).mean()) < 0.8
    assert np.abs(whole.astype(int) - target).mean() > 10


def test_no_change_at_a_reduced_size_gives_every_pixel_back():
    target = photo(np.uint8, (61, 47, 3))
    base = base_of(reduced(target, 4))
    out = blend(target, np.zeros(base.shape, np.float32), None, factor=4)
    np.testing.assert_array_equal(out, target)


def test_blended_block_by_block_it_is_the_same(monkeypatch):
    random = np.random.default_rng(2)
    target = photo(np.uint8, (61, 95, 3))
    change = random.normal(0, 0.3, (21, 32, 3)).astype(np.float32)
    mask = np.zeros((21, 32), np.float32)
    mask[5:9, 11:20] = random.random((4, 9))
    whole = blend(target, change, mask, factor=3)
    monkeypatch.setattr(room, "_ROWS", 6)
    np.testing.assert_array_equal(blend(target, change, mask, factor=3), whole)
    touched = (whole != target).any(axis=2)
    share = Enlarger(mask, 3, target.shape).rows(0, 61)
    assert touched[share > 0.1].all()
    assert not touched[share == 0].any()


def test_a_grey_target_is_coloured_inside_the_mask_only():
    target = np.full((4, 4), 100, np.uint8)
    space = plane_space(True, False, "rgb", "all")
    change = np.zeros((4, 4, 3), np.float32)
    change[..., 0] = np.log(2)
    mask = np.zeros((4, 4), np.float32)
    mask[1, 1] = 1
    out = blend(target, change, mask, space)
    assert out[1, 1].tolist() == [200, 100, 100]
    assert out[0, 0].tolist() == [100, 100, 100]


def test_black_can_become_light():
    target = np.zeros((8, 8), np.uint8)
    space = plane_space(True, True, "rgb", "all")
    out = blend(target, np.full((8, 8, 1), 9, np.float32), None, space)
    assert (out == 255).all()
