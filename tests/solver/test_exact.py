"""Exact TV-L1 against a linear program, brute force, independent cuts, and the properties it must have."""

import itertools
import subprocess
import sys

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy import sparse
from scipy.optimize import linprog
from scipy.sparse.csgraph import breadth_first_order, maximum_flow
from skimage import data

from relit.errors import ImageError, OptionError
from relit.runtime import threads as threads_module
from relit.solver.certificate import certify
from relit.solver.exact import solve, tv_l1
from relit.solver.neighborhoods import UNIT, Grid

NEIGHBORHOODS = (4, 8, 16)

#: (dy, dx) of one direction per pair, and its length: written out here a second time on purpose.
STEPS = {
    4: [(0, 1), (1, 0)],
    8: [(0, 1), (1, 0), (1, 1), (1, -1)],
    16: [(0, 1), (1, 0), (1, 1), (1, -1), (2, 1), (2, -1), (1, 2), (1, -2)],
}

small_images = arrays(np.uint8, st.tuples(st.integers(1, 6), st.integers(1, 6)), elements=st.integers(0, 5))
lams = st.floats(0.05, 5.0)


def weight_of(neighborhood, step):
    if neighborhood == 4:
        return 1.0
    length = np.hypot(*step)
    share = {8: {1: 45, 2: 45}, 16: {1: 26.565051177, 2: 18.434948823, 5: 22.5}}[neighborhood]
    return np.deg2rad(share[round(length**2)]) / (2 * length)


def pairs_of(shape, neighborhood):
    """Every pair of neighbours as (pixel, pixel, weight), by plain loops."""
    height, width = shape
    return [
        (y * width + x, (y + dy) * width + x + dx, weight_of(neighborhood, (dy, dx)))
        for dy, dx in STEPS[neighborhood]
        for y in range(height)
        for x in range(width)
        if 0 <= y + dy < height and 0 <= x + dx < width
    ]


def energy_of(u, f, lam, neighborhood):
    u, f = u.astype(float).ravel(), f.astype(float)
    edges = sum(w * abs(u[i] - u[j]) for i, j, w in pairs_of(f.shape, neighborhood))
    return edges + lam * np.abs(u - f.ravel()).sum()


def lp_optimum(f, lam, neighborhood):
    """The minimum of the energy as a linear program over u, |u_i - u_j| and |u_i - f_i|, by HiGHS."""
    n, edges = f.size, pairs_of(f.shape, neighborhood)
    m = len(edges)
    cost = np.concatenate([np.zeros(n), [w for *_, w in edges], np.full(n, lam)])
    rows, bounds = [], []
    for e, (i, j, _) in enumerate(edges):
        for sign in (1, -1):
            rows.append({i: sign, j: -sign, n + e: -1})
            bounds.append(0.0)
    for i, value in enumerate(f.ravel().astype(float)):
        for sign in (1, -1):
            rows.append({i: sign, n + m + i: -1})
            bounds.append(sign * value)
    a = sparse.lil_array((len(rows), n + m + n))
    for r, row in enumerate(rows):
        for column, value in row.items():
            a[r, column] = value
    free = [(None, None)] * n + [(0, None)] * (m + n)
    return linprog(cost, a.tocsr(), bounds, bounds=free, method="highs").fun


def test_weights_are_the_cauchy_crofton_ones():
    for neighborhood in NEIGHBORHOODS:
        grid = Grid.of(neighborhood)
        assert sorted(grid.steps) == sorted(STEPS[neighborhood])
        for step, weight in zip(grid.steps, grid.weights, strict=True):
            assert weight == pytest.approx(weight_of(neighborhood, step) * UNIT, abs=1)


def test_more_neighbours_measure_the_length_of_a_circle_better():
    y, x = np.mgrid[-60:61, -60:61]
    disc = (x**2 + y**2 <= 50**2).astype(float)
    error = {n: energy_of(disc, disc, 1, n) / (2 * np.pi * 50) - 1 for n in NEIGHBORHOODS}
    assert error[4] == pytest.approx(4 / np.pi - 1, abs=0.02)
    assert abs(error[8]) < 0.05
    assert abs(error[16]) < 0.02


@pytest.mark.parametrize("neighborhood", NEIGHBORHOODS)
@settings(max_examples=40, deadline=None)
@given(f=small_images, lam=lams)
def test_energy_is_the_linear_programs_optimum(neighborhood, f, lam):
    u = tv_l1(f, lam, neighborhood)
    # Weights are rounded to 2⁻²⁰: at most 2⁻²¹ per arc or pixel and unit of intensity.
    tolerance = 255 * (len(pairs_of(f.shape, neighborhood)) + f.size) * 2**-20
    assert energy_of(u, f, lam, neighborhood) == pytest.approx(
        lp_optimum(f, lam, neighborhood), abs=tolerance
    )


def smallest_minimiser(f, lam, neighborhood):
    """The least of all images of values 0, 1 and 2 with the least energy, by trying them all."""
    candidates = np.array(list(itertools.product(range(3), repeat=f.size)), np.int64)
    grid = Grid.of(neighborhood)
    energies = grid.fidelity(lam) * np.abs(candidates - f.ravel()).sum(axis=1)
    weights = dict(zip(grid.steps, grid.weights, strict=True))
    for dy, dx in grid.steps:
        for y, x in np.ndindex(f.shape):
            if 0 <= y + dy < f.shape[0] and 0 <= x + dx < f.shape[1]:
                i, j = y * f.shape[1] + x, (y + dy) * f.shape[1] + x + dx
                energies += weights[dy, dx] * np.abs(candidates[:, i] - candidates[:, j])
    return candidates[energies == energies.min()].min(axis=0).reshape(f.shape)


@pytest.mark.parametrize("neighborhood", NEIGHBORHOODS)
@settings(max_examples=25, deadline=None)
@given(
    f=arrays(np.uint8, st.sampled_from([(2, 3), (3, 2), (1, 6), (2, 2)]), elements=st.integers(0, 2)),
    lam=lams,
)
def test_result_is_the_smallest_of_all_minimisers(neighborhood, f, lam):
    np.testing.assert_array_equal(tv_l1(f, lam, neighborhood), smallest_minimiser(f, lam, neighborhood))


@pytest.mark.slow
@pytest.mark.rotating
def test_ten_thousand_random_images_give_their_smallest_minimiser():
    random = np.random.default_rng(3)
    shapes = [(2, 3), (3, 2), (1, 6), (6, 1), (2, 2), (1, 5)]
    for i in range(10_000):
        f = random.integers(0, 3, shapes[i % len(shapes)]).astype(np.uint8)
        # Simple fractions tie often, so that the rule for ties is tried as well.
        lam = random.integers(1, 33) / 8 if i % 2 else random.uniform(0.02, 5)
        neighborhood = NEIGHBORHOODS[i % 3]
        np.testing.assert_array_equal(
            tv_l1(f, lam, neighborhood), smallest_minimiser(f, lam, neighborhood), f"{f} {lam} {neighborhood}"
        )


@pytest.mark.parametrize("neighborhood", NEIGHBORHOODS)
@pytest.mark.parametrize("threads", [2, 3])
def test_threads_change_nothing(neighborhood, threads, monkeypatch):
    f = data.astronaut()[60:160, 190:254, 1]
    alone = tv_l1(f, 0.1, neighborhood, threads=1)
    monkeypatch.setattr(threads_module, "_LEAST_PIXELS", 1)
    solution = solve(f, 0.1, neighborhood, threads=threads)
    np.testing.assert_array_equal(solution.u, alone)
    assert certify(f, solution.u, 0.1, neighborhood, solution.flow).optimal


@settings(max_examples=30)
@given(
    f=arrays(np.uint8, st.tuples(st.integers(32, 70), st.integers(1, 9)), elements=st.integers(0, 3)),
    lam=lams,
    neighborhood=st.sampled_from(NEIGHBORHOODS),
)
def test_bands_of_any_image_join(f, lam, neighborhood):
    alone = tv_l1(f, lam, neighborhood, threads=1)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(threads_module, "_LEAST_PIXELS", 1)
        np.testing.assert_array_equal(tv_l1(f, lam, neighborhood, threads=4), alone)


STRESS = """
import numpy as np
from relit.runtime import threads
from relit.solver.exact import tv_l1
threads._LEAST_PIXELS = 1
random = np.random.default_rng(0)
for i in range(30):
    f = random.integers(0, 2**16, (75, 194)).astype(np.uint16)
    neighborhood = (8, 16, 16)[i % 3]
    assert (tv_l1(f, 0.0464, neighborhood, threads=4) == tv_l1(f, 0.0464, neighborhood, threads=1)).all()
"""


@pytest.mark.slow
def test_bands_at_once_keep_out_of_one_anothers_way():
    """In a process of its own, because a race between bands made the solver run for ever."""
    subprocess.run([sys.executable, "-c", STRESS], check=True, timeout=1200)


def hard_images():
    random = np.random.default_rng(1)
    y, x = np.mgrid[:90, :80]
    return {
        "noise": random.integers(0, 256, y.shape).astype(np.uint8),
        "flat": np.full(y.shape, 7, np.uint8),
        "two values": np.where(random.random(y.shape) < 0.5, 3, 250).astype(np.uint8),
        "checks": ((x + y) % 2).astype(np.uint8),
        "ramp": x.astype(np.uint8),
        "fine ramp": (x * 80 + y).astype(np.uint16),
        "spiral": (np.hypot(x - 40, y - 45) + 3 * np.arctan2(y - 45, x - 40) / np.pi % 6 < 3).astype(
            np.uint8
        ),
    }


@pytest.mark.parametrize("name", hard_images())
@pytest.mark.parametrize("lam", [0.02, 0.5])
def test_hard_images_are_certified(name, lam):
    f = hard_images()[name]
    for neighborhood in NEIGHBORHOODS:
        solution = solve(f, lam, neighborhood)
        assert certify(f, solution.u, lam, neighborhood, solution.flow).optimal


@pytest.mark.parametrize("threads", [0, -1, 1.5, True, "2"])
def test_number_of_threads_out_of_range_is_refused(threads):
    with pytest.raises(OptionError, match="threads: expected an integer above 0"):
        tv_l1(np.zeros((3, 3)), 1, threads=threads)


@pytest.mark.parametrize("neighborhood", NEIGHBORHOODS)
@pytest.mark.parametrize("lam", [0.2, 0.8])
def test_equals_independent_cuts_per_threshold_on_a_photo(neighborhood, lam):
    f = data.astronaut()[80:144, 190:254, 1] // 8
    u = tv_l1(f, lam, neighborhood)
    for threshold in range(1, int(f.max()) + 1):
        above = smallest_cut(f >= threshold, lam, neighborhood)
        np.testing.assert_array_equal(u >= threshold, above, err_msg=f"threshold {threshold}")


def smallest_cut(binary, lam, neighborhood):
    """The smallest minimiser of the binary problem, by scipy's Dinic and a search from the source."""
    grid = Grid.of(neighborhood)
    weights = dict(zip(grid.steps, grid.weights, strict=True))
    n = binary.size
    source, sink = n, n + 1
    index = np.arange(n).reshape(binary.shape)
    height, width = binary.shape
    capacity = {}
    for dy, dx in grid.steps:
        left, right = max(-dx, 0), width - max(dx, 0)
        i = index[: height - dy, left:right].ravel()
        j = index[dy:, left + dx : right + dx].ravel()
        for a, b in ((i, j), (j, i)):
            capacity.update(zip(zip(a, b, strict=True), itertools.repeat(weights[dy, dx]), strict=False))
    for i, one in enumerate(binary.ravel()):
        capacity[(source, i) if one else (i, sink)] = grid.fidelity(lam)
    heads, tails = np.array(list(capacity), np.int32).T  # as older releases of SciPy want them
    graph = sparse.csr_array(
        (np.array(list(capacity.values()), np.int32), (heads, tails)), shape=(n + 2, n + 2)
    )
    residual = graph - maximum_flow(graph, source, sink).flow
    residual.eliminate_zeros()
    reached = breadth_first_order(residual, source, return_predecessors=False)
    result = np.zeros(n + 2, bool)
    result[reached] = True
    return result[:n].reshape(binary.shape)


@pytest.mark.parametrize("neighborhood", NEIGHBORHOODS)
@settings(max_examples=25, deadline=None)
@given(f=small_images, lam=lams, mapping=st.lists(st.integers(0, 60000), min_size=6, max_size=6, unique=True))
def test_contrast_invariance(neighborhood, f, lam, mapping):
    g = np.array(sorted(mapping), np.uint16)
    np.testing.assert_array_equal(tv_l1(g[f], lam, neighborhood), g[tv_l1(f, lam, neighborhood)])


@settings(max_examples=25, deadline=None)
@given(f=small_images, brighter=small_images, lam=lams)
def test_level_sets_are_monotone(f, brighter, lam):
    shape = tuple(np.minimum(f.shape, brighter.shape))
    f = f[: shape[0], : shape[1]]
    assert (tv_l1(f, lam) <= tv_l1(np.maximum(f, brighter[: shape[0], : shape[1]]), lam)).all()


@pytest.mark.parametrize("side", [3, 5, 8])
def test_squares_vanish_at_their_perimeter_over_area(side):
    f = np.zeros((20, 20), np.uint8)
    f[5 : 5 + side, 6 : 6 + side] = 9
    critical = 4 / side
    assert not tv_l1(f, critical * 0.99).any()
    np.testing.assert_array_equal(tv_l1(f, critical * 1.01)[6 : 4 + side, 7 : 5 + side], 9)


def test_large_lam_returns_the_image_and_small_lam_the_majority():
    f = data.astronaut()[:40, :40, 0]
    for neighborhood in NEIGHBORHOODS:
        np.testing.assert_array_equal(tv_l1(f, 1e12, neighborhood), f)
    mostly_dark = np.zeros((9, 9), np.uint8)
    mostly_dark[:, :4] = 7
    assert not tv_l1(mostly_dark, 1e-9).any()
    assert (tv_l1(7 - mostly_dark, 1e-9) == 7).all()


@pytest.mark.parametrize("lam", [0, -1, np.nan, np.inf])
def test_lam_out_of_range_is_refused(lam):
    with pytest.raises(OptionError, match="lam: expected a finite number above 0"):
        tv_l1(np.zeros((3, 3)), lam)


@pytest.mark.parametrize("neighborhood", [0, 5, "8", None])
def test_unknown_neighborhood_is_refused(neighborhood):
    with pytest.raises(OptionError, match="neighborhood: expected 4, 8 or 16"):
        tv_l1(np.zeros((3, 3)), 1, neighborhood)


@pytest.mark.parametrize(
    ("image", "message"),
    [
        (np.zeros((3, 3, 3)), "one channel"),
        (np.zeros((0, 3)), "one channel"),
        (np.full((3, 3), np.nan), "NaN"),
        (np.zeros((3, 3), complex), "integers or floats"),
        ([[1, 2]], "integers or floats, got list"),
    ],
)
def test_unusable_images_are_refused(image, message):
    with pytest.raises(ImageError, match=message):
        tv_l1(image, 1)
    with pytest.raises(ImageError, match=message):
        certify(image, image, 1)


@pytest.mark.parametrize("lam", [None, "0.2", True])
def test_lam_must_be_a_number(lam):
    with pytest.raises(OptionError, match="lam: expected a finite number"):
        tv_l1(np.zeros((3, 3)), lam)
