"""The first flow of the exact solver: feasible, near to the optimum, and the same for any bands."""

import numpy as np
import pytest
from skimage import data

from relit.runtime.threads import pool, split
from relit.solver.certificate import certify
from relit.solver.exact import tv_l1
from relit.solver.neighborhoods import UNIT, Grid, paired
from relit.solver.primal_dual_iteration import SaddlePoint
from relit.solver.warm_start import _doubled, nearly_maximal_flow


def flow_of(f, lam, neighborhood, bands=1):
    with pool(1) as run:
        return nearly_maximal_flow(f, lam, Grid.of(neighborhood), split(len(f), bands), run)


@pytest.mark.parametrize("neighborhood", [4, 8, 16])
def test_flow_keeps_to_the_arcs(neighborhood):
    f = data.astronaut()[60:120, 190:254, 1].astype(np.float32) / 255
    grid = Grid.of(neighborhood)
    for step, weight, along in zip(grid.steps, grid.weights, flow_of(f, 0.2, neighborhood), strict=True):
        here, _ = paired(f.shape, step)
        assert np.abs(along).max() <= weight / UNIT
        outside = np.ones(f.shape, bool)
        outside[here] = False
        assert not along[outside].any()


@pytest.mark.parametrize("neighborhood", [4, 8, 16])
@pytest.mark.parametrize("lam", [0.1, 0.8])
def test_flow_is_nearly_maximal(neighborhood, lam):
    image = data.astronaut()[60:160, 190:290, 1]
    optimum = certify(image, tv_l1(image, lam, neighborhood), lam, neighborhood).primal / UNIT
    divergence = np.zeros(image.shape)
    grid = Grid.of(neighborhood)
    for step, along in zip(
        grid.steps, flow_of(image.astype(np.float32) / 255, lam, neighborhood), strict=True
    ):
        here, there = paired(image.shape, step)
        divergence[here] += along[here]
        divergence[there] -= along[here]
    # What exceeds λ pays λ: the bound that holds whatever the flow, as values lie between 0 and 255.
    f = image.astype(float)
    pixels = np.stack([f * divergence, lam * f, lam * (255 - f) + 255 * divergence])
    bound = pixels.min(axis=0).sum()
    assert 0.85 * optimum < bound <= optimum


@pytest.mark.parametrize("neighborhood", [4, 16])
def test_bands_do_not_change_a_bit(neighborhood):
    f = data.astronaut()[60:160, 190:254, 1].astype(np.float32) / 255
    whole = flow_of(f, 0.3, neighborhood)
    for bands in (2, 5):
        np.testing.assert_array_equal(flow_of(f, 0.3, neighborhood, bands), whole)


@pytest.mark.parametrize("step", [(0, 0), (0, 1), (1, 0), (1, -1), (2, 1), (1, -2)])
@pytest.mark.parametrize("shape", [(24, 32), (23, 31)])
def test_what_is_linear_doubles_to_itself(step, shape):
    """A pixel of the half size lies amid four, and what belongs to a step, halfway along it."""

    def plane(y, x):
        return 3 * y - 2 * x + 5

    dy, dx = step
    y, x = np.mgrid[: (shape[0] + 1) // 2, : (shape[1] + 1) // 2]
    coarse = plane(2 * y + 0.5 + dy, 2 * x + 0.5 + dx).astype(np.float32)
    y, x = np.mgrid[: shape[0], : shape[1]]
    fine = plane(y + dy / 2, x + dx / 2)
    inside = slice(3, -3), slice(3, -3)
    np.testing.assert_allclose(_doubled(coarse, shape, step)[inside], fine[inside], atol=1e-4)


def test_iterations_that_begin_anywhere_end_at_one_saddle_point():
    """What the iterations begin at must not last: u of TV + λ|u - f| is unique where f is 0, and is 0."""
    f = np.zeros((40, 40), np.float32)
    random = np.random.default_rng(0)
    u, p = random.random((40, 40), np.float32), np.zeros((2, 40, 40), np.float32)
    with pool(1) as run:
        iteration = SaddlePoint(
            f, 0.5, [(0, 1), (1, 0)], [1, 1], ratio=0.05, rows=[(0, 20), (20, 40)], run=run
        )
        iteration.start(u, p)
        np.testing.assert_array_equal(iteration.u, u)
        iteration.advance(400)
    assert np.abs(iteration.u).max() < 1e-3
