"""Isotropic TV-L1: its gap must be honest, and its discs must vanish where theory says."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.optimize import linprog
from skimage import data

from relit.errors import ImageError, OptionError
from relit.runtime import threads as threads_module
from relit.solver.isotropic import tv_l1_isotropic

images = arrays(
    np.float64, st.tuples(st.integers(1, 8), st.integers(1, 8)), elements=st.floats(-5, 5, width=16)
)


def energy_of(u, f, lam):
    across = np.diff(u, axis=1, append=u[:, -1:])
    down = np.diff(u, axis=0, append=u[-1:])
    return np.hypot(across, down).sum() + lam * np.abs(u - f).sum()


@pytest.mark.slow
@settings(max_examples=40, deadline=None)
@given(f=images, lam=st.floats(0.05, 3), rivals=st.integers(0, 2**32 - 1))
def test_reported_energy_is_true_and_no_rival_beats_the_bound(f, lam, rivals):
    # Some draws with a small λ take more than the 20 000 iterations that are the default.
    solution = tv_l1_isotropic(f, lam, tolerance=1e-4, max_iterations=200_000)
    assert solution.gap <= 1e-4
    assert solution.energy == pytest.approx(energy_of(solution.u, f, lam), rel=1e-9, abs=1e-9)
    rng = np.random.default_rng(rivals)
    for spread in (0.01, 0.3, 3):
        rival = solution.u + spread * rng.standard_normal(f.shape)
        assert energy_of(rival, f, lam) >= solution.bound - 1e-9
    for level in np.unique(f):
        assert energy_of(np.full_like(f, level), f, lam) >= solution.bound - 1e-9


@settings(max_examples=20, deadline=None)
@given(
    f=arrays(np.float64, st.integers(2, 12).map(lambda n: (1, n)), elements=st.integers(0, 9)),
    lam=st.floats(0.1, 2),
)
def test_on_a_single_row_the_bound_meets_the_linear_program(f, lam):
    n = f.size
    difference = np.diff(np.eye(n), axis=0)
    a = np.block(
        [
            [difference, -np.eye(n - 1), np.zeros((n - 1, n))],
            [-difference, -np.eye(n - 1), np.zeros((n - 1, n))],
            [np.eye(n), np.zeros((n, n - 1)), -np.eye(n)],
            [-np.eye(n), np.zeros((n, n - 1)), -np.eye(n)],
        ]
    )
    b = np.concatenate([np.zeros(2 * (n - 1)), f[0], -f[0]])
    cost = np.concatenate([np.zeros(n), np.ones(n - 1), np.full(n, lam)])
    optimum = linprog(cost, a, b, bounds=[(None, None)] * n + [(0, None)] * (2 * n - 1)).fun
    solution = tv_l1_isotropic(f, lam, tolerance=1e-5)
    assert solution.bound <= optimum + 1e-7
    # A hard draw may end at the last iteration, with a gap that it tells.
    assert solution.energy == pytest.approx(optimum, rel=max(2e-5, 2 * solution.gap), abs=1e-7)


@pytest.mark.parametrize("radius", [6, 12])
def test_discs_vanish_at_two_over_their_radius(radius):
    y, x = np.mgrid[-40:41, -40:41]
    disc = (x**2 + y**2 <= radius**2).astype(float)
    assert tv_l1_isotropic(disc, 0.9 * 2 / radius).u[40, 40] < 0.02
    assert tv_l1_isotropic(disc, 1.15 * 2 / radius).u[40, 40] > 0.98


def test_gaps_beyond_single_precision_are_reached():
    for f, lam in ((np.array([[0.0, 1.0]]), 0.05), (data.astronaut()[100:112, 200:212, 0] / 255, 1.5)):
        assert tv_l1_isotropic(f, lam, tolerance=1e-9).gap <= 1e-9


def test_threads_change_nothing(monkeypatch):
    f = data.astronaut()[60:160, 190:254, 1]
    alone = tv_l1_isotropic(f, 0.2, threads=1)
    monkeypatch.setattr(threads_module, "_LEAST_PIXELS", 1)
    shared = tv_l1_isotropic(f, 0.2, threads=3)
    np.testing.assert_array_equal(shared.u, alone.u)
    assert (shared.energy, shared.bound) == (alone.energy, alone.bound)


def test_intensity_scale_does_not_matter():
    f = data.astronaut()[100:140, 200:240, 0]
    small, large = tv_l1_isotropic(f / 255, 0.4), tv_l1_isotropic(f, 0.4)
    np.testing.assert_allclose(255 * small.u, large.u, atol=1e-6)
    assert small.gap == pytest.approx(large.gap)


def test_stops_at_the_iteration_limit_and_tells_the_gap():
    f = data.astronaut()[100:140, 200:240, 0]
    solution = tv_l1_isotropic(f, 0.2, tolerance=1e-12, max_iterations=30)
    assert solution.iterations == 30
    assert solution.gap > 1e-12


def test_constant_image_is_its_own_minimiser():
    solution = tv_l1_isotropic(np.full((4, 5), 7, np.uint8), 0.2)
    np.testing.assert_array_equal(solution.u, 7.0)
    assert solution.gap == 0


def test_arguments_out_of_range_are_refused():
    f = np.eye(3)
    with pytest.raises(OptionError, match="lam"):
        tv_l1_isotropic(f, 0)
    with pytest.raises(OptionError, match="tolerance"):
        tv_l1_isotropic(f, 1, tolerance=np.nan)
    with pytest.raises(OptionError, match="max_iterations"):
        tv_l1_isotropic(f, 1, max_iterations=0)
    with pytest.raises(ImageError, match="NaN"):
        tv_l1_isotropic(f * np.nan, 1)
