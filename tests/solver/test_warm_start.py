"""The first flow of the exact solver: feasible, near to the optimum, and the same for any bands."""

import numpy as np
import pytest
from skimage import data

from relit.runtime.threads import pool, split
from relit.solver.certificate import certify
from relit.solver.exact import tv_l1
from relit.solver.neighborhoods import UNIT, Grid, paired
from relit.solver.warm_start import nearly_maximal_flow


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
