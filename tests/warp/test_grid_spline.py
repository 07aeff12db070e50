"""Splines through grids against FITPACK's."""

import numpy as np
import pytest
from scipy.interpolate import RectBivariateSpline

from relit.warp.grid_spline import GridSpline


@pytest.mark.parametrize(("rows", "columns", "step"), [(4, 5, 1), (5, 4, 3), (6, 23, 32), (40, 31, 8)])
def test_it_is_fitpacks(rows, columns, step):
    rng = np.random.default_rng(rows)
    values = rng.normal(0, 100, (rows, columns, 2))
    height, width = (rows - 1) * step, (columns - 1) * step
    places = rng.random((200, 2)) * [width, height]
    places[:2] = [0, 0], [width, height]
    ours = GridSpline(values, step)
    for k in range(2):
        theirs = RectBivariateSpline(np.arange(rows) * step, np.arange(columns) * step, values[..., k])
        np.testing.assert_allclose(ours.at(places)[:, k], theirs.ev(places[:, 1], places[:, 0]), atol=1e-9)
        pixels = ours.on_pixels(height - 1, width)[..., k]
        np.testing.assert_allclose(pixels, theirs(np.arange(height - 1), np.arange(width)), atol=1e-9)
