"""The interpolant against scipy's, its own conditions, and the affine maps that it must reproduce."""

from decimal import Decimal, localcontext

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.interpolate import RBFInterpolator

from relit.errors import LandmarkError, OptionError
from relit.warp.rbf import fit_rbf

KERNELS = ("thin_plate_spline", "multiquadric", "gaussian")


def scattered(seed, n=40, size=200.0):
    rng = np.random.default_rng(seed)
    points = rng.random((n, 2)) * size
    return points, points + rng.standard_normal((n, 2)) * 5, rng.random((300, 2)) * size


@pytest.mark.parametrize("affine", [True, False])
@pytest.mark.parametrize("kernel", KERNELS)
def test_agrees_with_scipy(kernel, affine):
    x, y, places = scattered(1)
    ours = fit_rbf(x, y, kernel=kernel, affine=affine, radius=25.0)
    epsilon = 1.0 if kernel == "thin_plate_spline" else 1 / 25.0
    theirs = RBFInterpolator(x, y, kernel=kernel, degree=1 if affine else -1, epsilon=epsilon)
    np.testing.assert_allclose(ours(places), theirs(places), atol=1e-6)


@pytest.mark.parametrize("smoothing", [1e-3, 0.1])
def test_smoothing_agrees_with_scipy_in_the_unit_of_the_points_spread(smoothing):
    x, y, places = scattered(1)
    spread = np.sqrt(((x - x.mean(axis=0)) ** 2).sum(axis=1).mean())
    for kernel in KERNELS:
        ours = fit_rbf(x, y, kernel=kernel, smoothing=smoothing, radius=25.0)
        epsilon = 1.0 if kernel == "thin_plate_spline" else spread / 25.0
        # scipy's multiquadric is in units of its radius.
        theirs_too = smoothing * (epsilon if kernel == "multiquadric" else 1)
        theirs = RBFInterpolator(
            x / spread, y, kernel=kernel, smoothing=theirs_too, epsilon=epsilon, degree=1
        )
        np.testing.assert_allclose(ours(places), theirs(places / spread), atol=1e-6)


@pytest.mark.parametrize("affine", [True, False])
@pytest.mark.parametrize("kernel", KERNELS)
def test_meets_its_values_also_at_near_duplicate_points(kernel, affine):
    x, y, _ = scattered(2, n=120)
    for distance in (1.0, 1e-2, 1e-4):
        twins = x[:6] + distance * np.array([0.6, -0.8])
        centers, values = np.vstack([x, twins]), np.vstack([y, y[:6] + 0.5 * distance])
        fitted = fit_rbf(centers, values, kernel=kernel, affine=affine)
        assert np.abs(fitted(centers) - values).max() < 1e-6


def solved_in_50_digits(x, y, places, kernel, affine, radius):
    """The interpolant by Gaussian elimination in decimals, in px throughout."""

    def decimals(array):
        return [[Decimal(float(entry)) for entry in row] for row in array]

    def terms(points):
        for p in points:
            squares = [(p[0] - q[0]) ** 2 + (p[1] - q[1]) ** 2 for q in centers]
            yield [phi(square) for square in squares] + ([Decimal(1), *p] if affine else [])

    with localcontext(prec=50):
        shape = Decimal(float(radius)) ** 2
        phi = {
            "thin_plate_spline": lambda s: s * s.ln() / 2 if s else s,
            "multiquadric": lambda s: -(s + shape).sqrt(),
            "gaussian": lambda s: (-s / shape).exp(),
        }[kernel]
        centers, n = decimals(x), len(x)
        rows = list(terms(centers))
        rows += [[row[n + k] for row in rows] + [Decimal(0)] * 3 for k in range(3 if affine else 0)]
        system = np.array(rows)
        right = np.array(decimals(y) + [[Decimal(0)] * 2] * (len(system) - n))
        for k in range(len(system)):
            swap = [k, k + np.abs(system[k:, k]).argmax()]
            system[swap], right[swap] = system[swap[::-1]], right[swap[::-1]]
            others = np.arange(len(system)) != k
            factors = system[others, k] / system[k, k]
            system[others] -= np.outer(factors, system[k])
            right[others] -= np.outer(factors, right[k])
        solution = right / np.diag(system)[:, None]
        return (np.array(list(terms(decimals(places)))) @ solution).astype(float)


@settings(max_examples=40, deadline=None)
@given(
    seed=st.integers(0, 1000),
    distance=st.floats(-6, -2).map(lambda exponent: 10**exponent),
    kernel=st.sampled_from(KERNELS),
    affine=st.booleans(),
)
def test_near_duplicate_points_give_the_interpolant_of_exact_arithmetic(seed, distance, kernel, affine):
    x, y, places = scattered(seed, n=8)
    rng = np.random.default_rng(seed)
    twins = x[:2] + distance * rng.standard_normal((2, 2))
    x, y = np.vstack([x, twins]), np.vstack([y, y[:2] + distance * rng.standard_normal((2, 2))])
    order = rng.permutation(len(x))
    try:
        fitted = fit_rbf(x[order], y[order], kernel=kernel, affine=affine, radius=25.0)
    except LandmarkError:
        assert distance < 3e-4  # below, the coefficients' own rounding may be more than 1e-6 px
        return
    exact = solved_in_50_digits(x, y, places[:10], kernel, affine, 25.0)
    np.testing.assert_allclose(fitted(places[:10]), exact, atol=1e-3)


@settings(max_examples=30, deadline=None)
@given(
    seed=st.integers(0, 1000),
    linear=st.lists(st.floats(-3, 3), min_size=4, max_size=4),
    kernel=st.sampled_from(KERNELS),
    smoothing=st.sampled_from([0.0, 0.1, 10.0]),
)
def test_affine_maps_are_reproduced_whatever_the_smoothing(seed, linear, kernel, smoothing):
    x, _, places = scattered(seed, n=12)
    matrix = np.array(linear).reshape(2, 2)
    fitted = fit_rbf(x, x @ matrix + [7, -3], kernel=kernel, smoothing=smoothing)
    np.testing.assert_allclose(fitted(places), places @ matrix + [7, -3], atol=1e-6)
    if kernel == "thin_plate_spline":
        np.testing.assert_allclose(fitted.bending_energy, 0, atol=1e-9)


def test_scale_of_the_photo_does_not_matter():
    x, y, places = scattered(3)
    for kernel in KERNELS:
        small = fit_rbf(x, y, kernel=kernel, smoothing=0.02)
        large = fit_rbf(10 * x, 10 * y, kernel=kernel, smoothing=0.02)
        np.testing.assert_allclose(10 * small(places), large(10 * places), atol=1e-6)


def test_bending_energy_is_the_integral_of_the_second_derivatives():
    # An alternating square: second derivatives fall off as r⁻², and a window of 12 holds 99 % of the energy.
    x = np.array([[1.0, 0], [0, 1], [-1, 0], [0, -1]])
    fitted = fit_rbf(x, np.array([[1.0], [-1], [1], [-1]]))
    h = 0.02
    axis = np.arange(-12, 12, h)
    s = fitted(np.stack(np.meshgrid(axis, axis), axis=-1))[..., 0]
    along_y, along_x = np.gradient(s, h)
    xy, xx = np.gradient(along_x, h)
    yy, _ = np.gradient(along_y, h)
    integral = (xx**2 + 2 * xy**2 + yy**2)[2:-2, 2:-2].sum() * h**2
    assert integral < fitted.bending_energy[0] < 1.015 * integral


def test_smoothing_bends_less_and_misses_more():
    x, y, _ = scattered(4)
    energies, misses = [], []
    for smoothing in (0.0, 1e-3, 1e-1, 10.0):
        fitted = fit_rbf(x, y, smoothing=smoothing)
        energies.append(fitted.bending_energy.sum())
        misses.append(np.abs(fitted(x) - y).max())
    assert energies == sorted(energies, reverse=True)
    assert misses == sorted(misses)


@pytest.mark.parametrize("size", [64, 700, 4096])
@pytest.mark.parametrize("kernel", KERNELS)
def test_grid_evaluation_keeps_its_bound(face_points, kernel, size):
    rng = np.random.default_rng(5)
    x = face_points * size / 120
    y = x * 1.1 + rng.standard_normal(x.shape) * size / 1000  # the noise of a detector, undamped
    fitted = fit_rbf(x, y, kernel=kernel)
    grid = fitted.on_grid(size, size, tolerance=0.05)
    assert grid.shape == (size, size, 2)
    pixels = rng.integers(0, size, (20_000, 2))
    ring = np.stack(np.meshgrid(np.arange(-10, 11), np.arange(-10, 11)), axis=-1).reshape(-1, 2)
    near = (np.rint(x[:, None]).astype(int) + ring).reshape(-1, 2)
    pixels = np.vstack([pixels, near[((near >= 0) & (near < size)).all(axis=1)]])
    error = np.abs(grid[pixels[:, 1], pixels[:, 0]] - fitted(pixels))
    assert error.max() <= 0.05


def test_narrow_images_can_be_evaluated():
    x, y, _ = scattered(6)
    fitted = fit_rbf(x, y)
    grid = fitted.on_grid(1, 9)
    np.testing.assert_allclose(grid[0], fitted(np.column_stack([np.arange(9), np.zeros(9)])), atol=0.05)


@pytest.mark.parametrize("affine", [True, False])
@pytest.mark.parametrize("kernel", KERNELS)
def test_a_lattice_has_the_values_of_its_points(kernel, affine):
    x, y, _ = scattered(9)
    x[11], y[11] = x[30] + 1e-5, y[30] + 1e-5  # twins
    fitted = fit_rbf(x, y, kernel=kernel, affine=affine, smoothing=0.01)
    across, down = np.linspace(-5, 120, 300), np.arange(40)
    values = fitted.on_lattice(across, down)
    np.testing.assert_allclose(values, fitted(np.stack(np.meshgrid(across, down), axis=-1)), atol=1e-8)
    again = fitted.of_terms(fitted.terms(across, down), across, down)
    np.testing.assert_allclose(again, values, atol=1e-8)


def test_hopeless_points_are_named():
    x, y, _ = scattered(7)
    x[11] = x[30] + 1e-9
    with pytest.raises(LandmarkError, match=r"closest are (11 and 30|30 and 11)|points coincide"):
        fit_rbf(x, y)


def test_collinear_points_are_refused():
    with pytest.raises(LandmarkError, match="one line"):
        fit_rbf([[0, 0], [1, 1], [2, 2], [3, 3]], np.eye(4))


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"kernel": "cubic"}, "kernel: expected one of thin_plate_spline"),
        ({"smoothing": -1}, "smoothing"),
        ({"smoothing": np.nan}, "smoothing"),
        ({"radius": 0}, "radius"),
    ],
)
def test_options_out_of_range_are_refused(options, message):
    x, y, _ = scattered(8)
    with pytest.raises(OptionError, match=message):
        fit_rbf(x, y, **options)


def test_only_thin_plate_splines_have_a_bending_energy():
    x, y, _ = scattered(9)
    for options in ({"kernel": "gaussian"}, {"affine": False}):
        with pytest.raises(OptionError, match="bending_energy"):
            _ = fit_rbf(x, y, **options).bending_energy
