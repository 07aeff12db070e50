"""Radial basis function interpolants of scattered points in the plane.

    s(x) = Σᵢ cᵢ φ(|x - xᵢ|)  [+ a₀ + A x],   s(xᵢ) = yᵢ

This is Eq. (1)-(3) of Li, Yin and Deng (2009); the affine part in brackets, with ``Σ cᵢ = 0`` and
``Σ cᵢ xᵢ = 0``, is what makes it reproduce affine maps, and the thin-plate spline bend least [1]_.

References
----------
.. [1] F. L. Bookstein, "Principal warps: thin-plate splines and the decomposition of deformations", IEEE PAMI
       11(6), 1989.
.. [2] R. L. Hardy, "Multiquadric equations of topography and other irregular surfaces", J. Geophys. Res. 76,
       1971.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, Literal, get_args

import numpy as np

from relit.errors import LandmarkError, OptionError
from relit.photo.channels import squared_distances
from relit.runtime.threads import available, one_blas_thread, pool
from relit.warp.grid_spline import GridSpline
from relit.warp.radial_basis import Basis

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import ArrayLike, NDArray

KernelName = Literal["thin_plate_spline", "multiquadric", "gaussian"]

#: How far, in px, an interpolant without smoothing may miss its values.
EXACT = 1e-6

_COARSEST_STEP = 32
_AT_ONCE = 2**15  # distances held at a time by a thread, which fit a processor's cache
_OF_A_THREAD = 2**21  # distances, about 5 ms; for fewer, a thread does not pay
_FEW = 16  # probes for one that is looked at first
_PROBE_CELL = 4  # px
_NEARLY = np.sqrt(np.finfo(float).eps)  # of a solution: a correction after which the next one is rounding


@dataclass(frozen=True, eq=False)
class RBF:
    """A fitted interpolant; call it to evaluate it.

    Attributes
    ----------
    centers : (n, 2) float64 array
        Where the data were given, ``(x, y)``.
    coefficients : (n, m) float64 array
        cᵢ, for distances in units of `scale`.
    polynomial : (3, m) float64 array or None
        a₀ and A, for positions in units of `scale` from the centroid; None without the affine part.
    kernel : str
    radius : float
        Shape parameter of the multiquadric and Gaussian kernels, in px.
    scale : float
        Unit of distance, in px.
    """

    centers: NDArray[np.float64]
    coefficients: NDArray[np.float64]
    polynomial: NDArray[np.float64] | None
    kernel: KernelName
    radius: float
    scale: float

    def __call__(self, points: ArrayLike) -> NDArray[np.float64]:
        """Return the values at `points`.

        Parameters
        ----------
        points : (..., 2) array_like
            Positions ``(x, y)`` in px.

        Returns
        -------
        (..., m) float64 array
        """
        array = np.asarray(points, np.float64)
        flat = array.reshape(-1, 2)

        def values(part: slice) -> NDArray[np.float64]:
            return self._basis(flat[part]) @ self._weights

        return (self._in_parts(values, len(flat), 1) + self._plane(flat)).reshape(*array.shape[:-1], -1)

    def on_lattice(self, x: NDArray[Any], y: NDArray[Any]) -> NDArray[np.float64]:
        """Return the values at each ``(x, y)`` of a lattice, (len(y), len(x), m)."""
        return self._over_lattice(lambda basis: basis @ self._weights, x, y) + self._plane(_lattice(x, y))

    def terms(self, x: NDArray[Any], y: NDArray[Any]) -> NDArray[np.float64]:
        """Return what the values on a lattice are combined from, (len(y), len(x), n).

        It depends on no value: interpolants of other values at the same centers have the same.
        """
        return self._over_lattice(lambda basis: basis, x, y)

    def of_terms(self, terms: NDArray[np.float64], x: NDArray[Any], y: NDArray[Any]) -> NDArray[np.float64]:
        """Return the values on a lattice, whose terms are known: as `on_lattice` does."""
        with one_blas_thread():
            return terms @ self._weights + self._plane(_lattice(x, y))

    def _over_lattice(
        self, made_of: Callable[[NDArray[np.float64]], NDArray[np.float64]], x: NDArray[Any], y: NDArray[Any]
    ) -> NDArray[np.float64]:
        """Return what is made of the functions of `_basis` at a lattice's points, (len(y), len(x), ...)."""
        points, (across, down) = _lattice(x, y), (self._basis.squares(x, 0), self._basis.squares(y, 1))

        def values(rows: slice) -> NDArray[np.float64]:
            square = (down[rows, None] + across).reshape(-1, len(self.centers))
            return made_of(self._basis.of_squares(square, points[rows].reshape(-1, 2)))

        return self._in_parts(values, len(y), len(x)).reshape(*points.shape[:2], -1)

    def _in_parts(
        self, values: Callable[[slice], NDArray[np.float64]], count: int, points: int
    ) -> NDArray[np.float64]:
        """Return values of so many rows of points, a few rows at a time."""
        distances = points * len(self.centers)
        rows = max(_AT_ONCE // distances, 1)
        parts = [slice(first, first + rows) for first in range(0, max(count, 1), rows)]
        threads = min(available(), count * distances // _OF_A_THREAD + 1)
        with one_blas_thread(), pool(threads) as run:
            return np.concatenate(run(values, parts))

    def _plane(self, points: NDArray[Any]) -> NDArray[np.float64] | float:
        """Return the affine part at (..., 2) points."""
        if self.polynomial is None:
            return 0.0
        return _affine_terms(points, self.centers, self.scale) @ self.polynomial

    def on_grid(self, height: int, width: int, *, tolerance: float = 0.05) -> NDArray[np.float32]:
        """Return the values at every pixel of an image, to within `tolerance`.

        The interpolant is evaluated on a coarse grid and carried to the pixels by a bicubic spline. Its error
        is greatest at the centers, where the thin-plate spline's second derivative is unbounded; so the
        error is measured on a lattice round each of them, and over the image, and the grid is refined until
        no more than half the tolerance is found.

        Parameters
        ----------
        height, width : int
            Size of the image in px.
        tolerance : float
            Largest error of a value, in the values' unit (px).

        Returns
        -------
        (height, width, m) float32 array
            The value at pixel ``(x, y)`` is ``[y, x]``. float32 rounds positions below 4096 px to 2.5e-4 px.
        """
        probes = _probes(self.centers, height, width)
        exact = self(probes)
        some = (np.s_[::_FEW], np.s_[:])  # of a grid that is too coarse, a few tell
        step, nodes = _COARSEST_STEP, None
        while step > 1:
            x, y = (np.arange(0, max(n, 4 * step) + step, step) for n in (width, height))
            nodes = self._at_nodes(x, y, nodes)
            spline = GridSpline(nodes, step)
            if all(np.abs(spline.at(probes[few]) - exact[few]).max() <= tolerance / 2 for few in some):
                return spline.on_pixels(height, width).astype(np.float32, order="C")
            step //= 2
        return self._at_nodes(np.arange(width), np.arange(height), nodes).astype(np.float32)

    def _at_nodes(
        self, x: NDArray[np.intp], y: NDArray[np.intp], coarser: NDArray[np.float64] | None
    ) -> NDArray[np.float64]:
        """Return the values on a grid, (len(y), len(x), m), those at every second node being known."""
        if coarser is None:
            return self.on_lattice(x, y)
        values = np.empty((len(y), len(x), coarser.shape[2]))
        even = values[::2, ::2]
        even[:] = coarser[: len(even), : even.shape[1]]
        for row, column in ((0, 1), (1, 0), (1, 1)):
            values[row::2, column::2] = self.on_lattice(x[column::2], y[row::2])
        return values

    @property
    def bending_energy(self) -> NDArray[np.float64]:
        """``∫ s_xx² + 2 s_xy² + s_yy²`` over the plane, for each of the m values; 0 for an affine map.

        Raises
        ------
        OptionError
            For any but a thin-plate spline with its affine part, whose integral alone is finite.
        """
        if self.kernel != "thin_plate_spline" or self.polynomial is None:
            raise OptionError("bending_energy: only a thin-plate spline with its affine part has one")
        basis = self._basis(self.centers)
        of_basis = self._basis.of_differences(self.coefficients)
        energy = np.einsum("im,ij,jm->m", self.coefficients, basis, of_basis)
        # r² log r is 8π times the biharmonic Green's function.
        return np.asarray(8 * np.pi * energy / self.scale**2)

    @cached_property
    def _weights(self) -> NDArray[np.float64]:
        """What the functions of `_basis` are combined by."""
        return self._basis.of_differences(self.coefficients)

    @cached_property
    def _basis(self) -> Basis:
        # Without the affine part the unit of r matters, and the paper's is the pixel.
        unit = 1.0 if self.polynomial is not None else self.scale
        return Basis(self.centers, self.kernel, self.radius, self.scale, unit)


def fit_rbf(
    centers: ArrayLike,
    values: ArrayLike,
    *,
    kernel: KernelName = "thin_plate_spline",
    affine: bool = True,
    smoothing: float = 0.0,
    radius: float | None = None,
    scale: float | None = None,
) -> RBF:
    """Fit an interpolant, or with smoothing an approximant, to scattered data.

    Parameters
    ----------
    centers : (n, 2) array_like
        Positions ``(x, y)`` in px, n ≥ 3 and not all on one line.
    values : (n, m) array_like
        Values at the centers.
    kernel : {"thin_plate_spline", "multiquadric", "gaussian"}
        ``r² log r``, ``-√(r² + radius²)`` [2]_ or ``exp(-r² / radius²)``; the sign makes each positive
        definite on what the affine part leaves, so that smoothing smooths.
    affine : bool
        Whether to include the affine part.
    smoothing : float
        0 interpolates. Above, ``Σ |s(xᵢ) - yᵢ|²`` is traded against the roughness of s, with distances in
        units of `scale`, so that a value means the same at any image size.
    radius : float, optional
        Shape parameter in px; by default `spacing_of` the centers.
    scale : float, optional
        Unit of distance in px; by default `spread_of` the centers.

    Returns
    -------
    RBF

    Raises
    ------
    OptionError
        If an option is out of range.
    LandmarkError
        If, without smoothing, the values cannot be met to 1e-6 px, because points nearly coincide while
        their values differ, or lie on one line.

    Examples
    --------
    >>> import numpy as np
    >>> corners = np.array([[0, 0], [9, 0], [0, 9], [9, 9], [4, 5]])
    >>> warp = fit_rbf(corners, corners * [2, 1] + [5, 0])
    >>> [round(float(value), 6) for value in warp([3, 7])]
    [11.0, 7.0]
    """
    if kernel not in get_args(KernelName):
        raise OptionError(f"kernel: expected one of {', '.join(get_args(KernelName))}, got {kernel!r}")
    if not (np.isfinite(smoothing) and smoothing >= 0):
        raise OptionError(f"smoothing: expected a finite number, 0 or above, got {smoothing!r}")
    x = np.asarray(centers, np.float64)
    y = np.asarray(values, np.float64)
    scale = spread_of(x) if scale is None else scale
    radius = spacing_of(x) or scale if radius is None else radius
    for name, length in (("radius", radius), ("scale", scale)):
        if not (np.isfinite(length) and length > 0):
            raise OptionError(f"{name}: expected a number of px above 0, got {length!r}")

    n, m = y.shape
    blank = RBF(x, np.zeros((n, m)), np.zeros((3, m)) if affine else None, kernel, radius, scale)
    basis = blank._basis
    system = basis(x) + smoothing * basis.differences
    if affine:
        terms = _affine_terms(x, x, scale)
        if np.linalg.matrix_rank(terms) < 3:
            raise LandmarkError(
                "landmarks: all points lie on one line, or fewer than 3 are apart; a map with an affine part "
                "needs 3 points off a line"
            )
        system = np.block([[system, terms], [terms.T @ basis.differences, np.zeros((3, 3))]])
    right = np.vstack([y, np.zeros((len(system) - n, m))])
    with one_blas_thread():
        solution = _solve_refined(system, right)
        coefficients = basis.differences @ solution[:n]
    fitted = RBF(x, coefficients, solution[n:] if affine else None, kernel, radius, scale)
    # Coefficients so large that their rounding shows at the centers err as much elsewhere.
    if smoothing == 0 and not np.abs(fitted(x) - y).max() <= EXACT:
        first, second = np.divmod(np.argmin(squared_distances(x, x) + np.diag(np.full(n, np.inf))), n)
        raise LandmarkError(
            f"landmarks: no {kernel} meets all points to {EXACT:g} px; the closest are {first} and {second}: "
            "remove one of them, or use smoothing above 0"
        )
    return fitted


def spread_of(points: NDArray[np.float64]) -> float:
    """Return the root mean square distance of (n, 2) points from their centroid."""
    return float(np.sqrt(((points - points.mean(axis=0)) ** 2).sum(axis=1).mean()))


def spacing_of(points: NDArray[np.float64]) -> float:
    """Return about how far (n, 2) points are apart: the side of the square that each has to itself."""
    return float(np.sqrt(np.prod(np.ptp(points, axis=0)) / len(points)))


def _lattice(x: NDArray[Any], y: NDArray[Any]) -> NDArray[Any]:
    """Return the points ``(x, y)`` of a lattice, (len(y), len(x), 2)."""
    return np.stack(np.meshgrid(x, y), axis=-1)


def _affine_terms(points: NDArray[Any], centers: NDArray[np.float64], scale: float) -> NDArray[np.float64]:
    places = (points - centers.mean(axis=0)) / scale
    return np.concatenate([np.ones((*places.shape[:-1], 1)), places], axis=-1)


def _solve_refined(system: NDArray[np.float64], right: NDArray[np.float64]) -> NDArray[np.float64]:
    """Solve by LU with iterative refinement, its residuals in extended precision where the machine has it.

    Smooth kernels make ill-conditioned systems; plain LU then misses the values.
    """
    try:
        solution = np.linalg.solve(system, right)
    except np.linalg.LinAlgError:
        raise LandmarkError(
            "landmarks: points coincide, so that no map is defined; remove the duplicates, or use smoothing "
            "above 0"
        ) from None
    exact_system, exact_right = system.astype(np.longdouble), right.astype(np.longdouble)
    for _ in range(4):
        residual = exact_right - exact_system @ solution
        correction = np.linalg.solve(system, residual.astype(np.float64))
        solution = solution + correction
        if np.abs(correction).max() <= _NEARLY * np.abs(solution).max():
            break
    return np.asarray(solution)


def _probes(centers: NDArray[np.float64], height: int, width: int) -> NDArray[np.float64]:
    """Return positions inside the image where a coarse grid may err most, and some over the whole image."""
    offsets = np.stack(np.meshgrid(*2 * [np.arange(-10, 11, 5.0)]), axis=-1).reshape(-1, 2)
    near = (centers[:, None] + offsets).reshape(-1, 2)
    over = np.random.default_rng(0).random((1024, 2)) * [width - 1, height - 1]
    inside = ((near >= 0) & (near <= [width - 1, height - 1])).all(axis=1)
    probes = np.vstack([near[inside], over])
    # Where centers are dense their lattices overlap: one position of a cell will do.
    across, down = np.floor(probes / _PROBE_CELL).astype(int).T
    return probes[np.unique(down * (width + 1) + across, return_index=True)[1]]
