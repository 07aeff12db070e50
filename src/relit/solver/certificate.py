"""Certificates of optimality: what a flow proves about any candidate for the minimiser of TV-L1."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from relit.errors import ImageError, OptionError
from relit.solver.exact import solve
from relit.solver.neighborhoods import Grid, Neighborhood, check_plane, paired

if TYPE_CHECKING:
    from numpy.typing import NDArray


@dataclass(frozen=True)
class Certificate:
    """What a flow says about an image `u`.

    Attributes
    ----------
    optimal : bool
        True where the flow is feasible and the energies agree: then `u` is a minimiser, whoever made it.
    feasible : bool
        Whether ``|flow| ≤ w`` on every arc and ``|div flow| ≤ λ`` at every pixel.
    primal, dual : int or float
        ``TV(u) + λ‖f - u‖₁`` and ``Σ f·div flow``, in `UNIT` times the image's unit of intensity; ints for
        integer images.
    """

    optimal: bool
    feasible: bool
    primal: float
    dual: float

    @property
    def gap(self) -> float:
        """``primal - dual``: how far at most `u` is from the optimum, where the flow is feasible."""
        return self.primal - self.dual


def certify(
    image: NDArray[Any],
    u: NDArray[Any],
    lam: float,
    neighborhood: Neighborhood = 4,
    flow: NDArray[np.int32] | None = None,
) -> Certificate:
    """Prove or refute that `u` minimises anisotropic TV-L1.

    Any flow with ``|flow| ≤ w`` and ``|div flow| ≤ λ`` bounds the energy of every image from below by
    ``Σ f·div flow``; an image whose energy equals the bound is a minimiser. The check is arithmetic on whole
    arrays and shares nothing with the solver but the grid's weights.

    Parameters
    ----------
    image : (H, W) array
        f. Integers are summed exactly; floats to rounding.
    u : (H, W) array
        The image in question, from any solver.
    lam, neighborhood
        As for `tv_l1`.
    flow : (D/2, H, W) int array, optional
        A dual solution, from `solve`; by default, one is computed.

    Returns
    -------
    Certificate

    Raises
    ------
    ImageError
        If the shapes do not agree or an image is not finite.
    OptionError
        If λ or the neighbourhood is out of range.

    Examples
    --------
    >>> import numpy as np
    >>> from relit.solver.exact import tv_l1
    >>> f = np.zeros((7, 7), np.uint8)
    >>> f[3, 3] = 9
    >>> certify(f, tv_l1(f, 0.5), 0.5).optimal, certify(f, f, 0.5).optimal
    (True, False)
    """
    check_plane(image)
    check_plane(u, "u")
    if u.shape != image.shape:
        raise ImageError(f"u: expected the image's shape {image.shape}, got {u.shape}")
    grid = Grid.of(neighborhood)
    fidelity = grid.fidelity(lam)
    if flow is None:
        flow = solve(image, lam, neighborhood).flow
    if flow.shape != (len(grid.steps), *image.shape):
        raise OptionError(f"flow: expected shape {(len(grid.steps), *image.shape)}, got {flow.shape}")

    f_, u_ = _as_summable(image, u, grid)
    primal = fidelity * np.abs(f_ - u_).sum()
    divergence = np.zeros(image.shape, np.int64)
    feasible = True
    for step, weight, along in zip(grid.steps, grid.weights, flow, strict=True):
        here, there = paired(image.shape, step)
        sent = along[here].astype(np.int64)
        primal += weight * np.abs(u_[here] - u_[there]).sum()
        divergence[here] += sent
        divergence[there] -= sent
        feasible &= bool((np.abs(sent) <= weight).all() and np.count_nonzero(along) == np.count_nonzero(sent))
    feasible &= bool((np.abs(divergence) <= fidelity).all())
    dual = (f_ * divergence).sum()
    exact = f_.dtype.kind != "f"
    agree = bool(primal == dual if exact else np.isclose(primal, dual, rtol=1e-9, atol=0))
    number: Any = int if exact else float
    return Certificate(feasible and agree, feasible, number(primal), number(dual))


def _as_summable(image: NDArray[Any], u: NDArray[Any], grid: Grid) -> list[NDArray[Any]]:
    """Return both, less the least value, as floats or integers that add up: Python's where 64 bits fail.

    The flow's divergences add up to 0, so that a common shift changes neither energy.
    """
    both = (image, u)
    if any(plane.dtype.kind == "f" for plane in both):
        return [plane.astype(np.float64) - min(image.min(), u.min()) for plane in both]
    least, most = min(int(plane.min()) for plane in both), max(int(plane.max()) for plane in both)
    terms = image.size * (len(grid.steps) + 1)
    kind = np.int64 if (most - least) * terms * 2 * sum(grid.weights) < 2**62 else object
    return [(plane.astype(object) - least).astype(kind) for plane in both]
