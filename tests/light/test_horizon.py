"""Horizons against shadows that geometry knows, and against rays that are marched one by one."""

import numpy as np
import pytest
from scipy.ndimage import map_coordinates

from relit.light.horizon import horizons, visible

IOD = 40.0


def lamp(azimuth, elevation):
    """Towards a lamp so many degrees round the image from x on by way of y, and above its plane."""
    a, e = np.radians([azimuth, elevation])
    return np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), -np.sin(e)])


@pytest.fixture(scope="module")
def dome_on_a_plane():
    """Half a ball of 25 px radius on a plane."""
    y, x = np.mgrid[-70:71, -70:71]
    depth = -np.sqrt(np.maximum(25.0**2 - x**2 - y**2, 0))
    return x, y, depth, horizons(depth, np.ones(depth.shape, bool), IOD)


@pytest.mark.parametrize("way", range(4))
def test_a_wall_covers_the_sky_up_to_its_edge(way):
    height, foot = 15.0, 45
    depth = np.where(np.arange(120) < 60, 0.0, -height) * np.ones((120, 1))
    # The wall is to the right; turned, it is above, to the left, below.
    turned = np.rot90(depth, way)
    seen = np.rot90(horizons(turned, np.ones(depth.shape, bool), IOD), -way, (1, 2))[:, 60, foot]
    towards, away = seen[(-4 * way) % 16], seen[(8 - 4 * way) % 16]
    assert towards == pytest.approx(np.arctan2(height, 60 - foot), abs=0.1)
    assert away == pytest.approx(0, abs=0.05)
    # Aslant, the wall is farther off.
    aslant = np.arctan2(height, (60 - foot) * np.sqrt(2))
    assert seen[(2 - 4 * way) % 16] == pytest.approx(aslant, abs=0.1)


def test_what_is_no_surface_covers_nothing():
    depth = np.where(np.arange(120) < 60, 0.0, -15.0) * np.ones((120, 1))
    solid = np.arange(120) < 60
    seen = horizons(depth, solid * np.ones((120, 1), bool), IOD)
    assert seen[:, :, :50].max() < 0.05


@pytest.mark.parametrize("azimuth", [0.0, 45.0, 100.0, 191.0, 300.0])
@pytest.mark.parametrize("elevation", [20.0, 30.0])
def test_half_a_balls_shadow_is_an_ellipse(dome_on_a_plane, azimuth, elevation):
    """On the plane, a point lies in it if the way to the lamp comes nearer to the middle than the radius."""
    x, y, depth, horizon = dome_on_a_plane
    towards = lamp(azimuth, elevation)
    along = x * towards[0] + y * towards[1]
    nearest = np.sqrt(np.maximum(x**2 + y**2 - along**2, 0))
    dark = (along < 0) & (nearest < 25.0)
    share = next(visible(horizon, towards[None]))
    # All but what is within the soft edge of 0.15 rad.
    sure = (depth == 0) & (np.hypot(x, y) > 29) & (np.hypot(x, y) < 60)
    surely_dark = sure & (along < 0) & (nearest < 19)
    surely_lit = sure & ~(dark | ((along < 0) & (nearest < 31)))
    assert surely_lit.sum() > 1000
    assert share[surely_lit].mean() > 0.9
    assert surely_dark.sum() > 100
    assert share[surely_dark].mean() < 0.25


def marched(depth, y, x, towards, reach):
    """Whether a point sees the lamp, by a ray that goes up to it px by px."""
    step = np.arange(2.0, reach)[:, None] * towards / np.hypot(*towards[:2])
    ground = map_coordinates(depth, [y + step[:, 1], x + step[:, 0]], order=1, cval=np.inf)
    return not np.any(ground < depth[y, x] - 0.02 * IOD + step[:, 2])


def test_shadows_are_those_of_marched_rays():
    random = np.random.default_rng(3)
    y, x = np.mgrid[:110, :110]
    depth = np.zeros(x.shape)
    for _ in range(12):
        (row, column), width = random.uniform(20, 90, 2), random.uniform(6, 16)
        depth -= random.uniform(2, 14) * np.exp(-((x - column) ** 2 + (y - row) ** 2) / (2 * width**2))
    horizon = horizons(depth, np.ones(depth.shape, bool), IOD)
    agree, dark = [], 0
    for azimuth in (10.0, 130.0, 250.0):
        towards = lamp(azimuth, 25)
        share = next(visible(horizon, towards[None]))
        for row, column in random.integers(15, 95, (200, 2)):
            truth = marched(depth, row, column, towards, 1.6 * IOD)
            dark += not truth
            # What is half hidden may be either.
            agree.append(truth == (share[row, column] > 0.5) or abs(share[row, column] - 0.5) < 0.3)
    assert dark > 40
    assert np.mean(agree) > 0.97


def test_a_lamp_at_the_camera_is_always_seen(dome_on_a_plane):
    horizon = dome_on_a_plane[3]
    front, back = (one.copy() for one in visible(horizon, np.array([[0.0, 0.0, -1.0], [0.0, 0.0, 1.0]])))
    assert front.min() > 0.9
    assert back.max() == 0


def test_size_does_not_matter(dome_on_a_plane):
    """A head twice as large, with eyes twice as far apart, has the same horizons."""
    y, x = np.mgrid[-140:141, -140:141]
    depth = -np.sqrt(np.maximum(50.0**2 - x**2 - y**2, 0))
    large = horizons(depth, np.ones(depth.shape, bool), 2 * IOD)[:, ::2, ::2]
    assert np.abs(large - dome_on_a_plane[3])[:, 10:-10, 10:-10].mean() < 0.01
