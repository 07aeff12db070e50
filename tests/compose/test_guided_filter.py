"""Guided enlargement: identities, and Pillow's bilinear resize."""

import numpy as np
import pytest
from PIL import Image
from scipy.ndimage import gaussian_filter

from relit.compose.guided_filter import fit_lines, guided_filter
from relit.photo.resampling import Enlarger, reduced


@pytest.mark.parametrize("factor", [1, 2, 3, 7])
def test_enlarging_agrees_with_pillow(factor):
    plane = np.random.default_rng(0).random((11, 13)).astype(np.float32)
    shape = (11 * factor - factor // 2, 13 * factor)
    rows = Enlarger(plane, factor, shape).rows(0, shape[0])
    expected = Image.fromarray(plane).resize((13 * factor, 11 * factor), Image.Resampling.BILINEAR)
    np.testing.assert_allclose(rows, np.asarray(expected)[: shape[0]], atol=1e-5)


def test_rows_are_the_same_in_pieces_and_with_several_planes():
    planes = np.random.default_rng(0).random((9, 8, 3)).astype(np.float32)
    whole = Enlarger(planes, 4, (36, 32)).rows(0, 36)
    pieces = [Enlarger(planes, 4, (36, 32)).rows(a, b) for a, b in ((0, 5), (5, 30), (30, 36))]
    # OpenCV rounds the last rows of a piece its own way.
    np.testing.assert_allclose(np.concatenate(pieces), whole, rtol=2e-7)
    np.testing.assert_allclose(Enlarger(planes[..., 1], 4, (36, 32)).rows(0, 36), whole[..., 1], rtol=2e-7)


def test_a_plane_that_follows_its_guide_is_enlarged_with_the_edges_of_the_guide():
    """A step that the reduced plane has lost comes back where the guide has it."""
    guide = np.zeros((64, 64))
    guide[:, 29:] = 1  # not at a block's border
    plane = 2 * guide - 0.3
    small_guide, small = reduced(guide.astype(np.float32), 4), reduced(plane.astype(np.float32), 4)
    lines = fit_lines(small, small_guide, 1, 1e-3)
    slope, offset = (Enlarger(one, 4, (64, 64)).rows(0, 64) for one in lines)
    guided = slope * guide + offset
    bilinear = Enlarger(small, 4, (64, 64)).rows(0, 64)
    near = np.s_[8:-8, 27:31]
    assert np.abs(guided - plane)[near].max() < 0.1
    assert np.abs(bilinear - plane)[near].max() > 0.5


def test_the_filter_keeps_the_edge_of_the_guide_and_smooths_beside_it():
    rng = np.random.default_rng(0)
    guide = np.repeat([0.0, 1.0], 32) * np.ones((64, 1))
    noisy = guide + 0.1 * rng.standard_normal(guide.shape)
    smooth = guided_filter(noisy, guide, 4, 0.1)
    assert (smooth - guide).std() < 0.25 * (noisy - guide).std()
    blurred = gaussian_filter(noisy, 4)
    assert np.abs(smooth - guide)[:, 31:33].mean() < 0.2 * np.abs(blurred - guide)[:, 31:33].mean()


def test_a_flat_guide_says_nothing():
    lines = fit_lines(np.random.default_rng(0).random((20, 20)), np.full((20, 20), 0.5), 2, 0.01)
    np.testing.assert_allclose(lines.slope, 0, atol=1e-6)
