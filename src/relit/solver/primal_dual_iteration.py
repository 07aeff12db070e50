"""The over-relaxed primal-dual iteration of [1]_ and [2]_ for TV-L1, row by row, in bands.

The saddle point is that of ``Σ p·∇u + λ |u - f|`` over u, and over p with ``|p| ≤ w`` for every step of a
grid (anisotropic) or ``|(p₀, p₁)| ≤ 1`` at every pixel (isotropic).

Iterations are staggered: while the first of a batch is at row y, the next is at row ``y - reach``, and so on,
so that a batch passes through the memory once. Bands of rows carry as many rows of their neighbours with them
as a batch uses up, and are independent of one another until its end: bands do not change a bit of the result.

The kernels work on flat rows with a column of margin, and take unsigned indices: those cannot wrap around, so
that the compiler vectorises, and slices would cost as much as the arithmetic.

References
----------
.. [1] A. Chambolle, T. Pock, "A first-order primal-dual algorithm for convex problems with applications to
       imaging", J. Math. Imaging Vis. 40, 2011.
.. [2] L. Condat, "A primal-dual splitting method for convex optimization involving Lipschitzian, proximable
       and linear composite terms", J. Optim. Theory Appl. 158, 2013.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from relit.runtime.jit import compiled

if TYPE_CHECKING:
    from relit.runtime.threads import Run

Floats = NDArray[np.floating[Any]]
Index = np.uintp

_RELAXATION = np.float32(1.9)  # below 2, where the method still converges
_BATCH = 8  # iterations in one pass through the memory
_MARGIN = 1
_ONE = np.uintp(1)


class _Band(NamedTuple):
    """Some rows of f, of u, of its extrapolation, and of p for every step, with a margin before each row."""

    f: Floats
    u: Floats
    ahead: Floats
    p: Floats
    divergence: Floats
    nothing: Floats
    height: int
    stride: int

    @classmethod
    def of(cls, f: Floats, directions: int) -> _Band:
        height, width = f.shape
        stride = width + _MARGIN
        flat = np.zeros(height * stride + _MARGIN, f.dtype)
        flat[_MARGIN:].reshape(height, stride)[:, :width] = f
        ahead = flat.copy()
        ahead[stride::stride] = f[:, -1]
        p = np.zeros((directions, flat.size), f.dtype)
        scratch = np.zeros((2, width), f.dtype)
        return cls(flat, flat.copy(), ahead, p, scratch[0], scratch[1], height, stride)

    def rows(self, flat: Floats, first: int, last: int) -> Floats:
        """Return some of the rows in one of the arrays, with the margin behind them."""
        rows = flat[..., _MARGIN + first * self.stride : _MARGIN + last * self.stride]
        return rows.reshape(*flat.shape[:-1], last - first, self.stride)


class SaddlePoint:
    """An image's u and p on their way to the saddle point.

    Parameters
    ----------
    f : (H, W) float32 or float64 array
        Values in [0, 1]. Arithmetic is of its type, until refined.
    lam : float
        λ in px⁻¹.
    steps : sequence of (int, int)
        ``(dy, dx)`` of every difference.
    weights : sequence of float, optional
        Weight of every step; without them, the isotropic length of the steps ``(0, 1)`` and ``(1, 0)``.
    ratio : float
        Primal over dual step.
    rows : sequence of (int, int)
        Ranges of rows that cover the image in order: the bands to work on at once. Of several, none is
        shorter than what it lends to its neighbour, 8 rows for every row that the steps go down.
    run : Run
        Works on the bands.
    """

    def __init__(
        self,
        f: Floats,
        lam: float,
        steps: Sequence[tuple[int, int]],
        weights: Sequence[float] | None,
        *,
        ratio: float,
        rows: Sequence[tuple[int, int]],
        run: Run,
    ) -> None:
        norm = np.sqrt(4 * len(steps))  # at least that of the differences along all steps
        self._sizes = np.array([lam, ratio / norm, 1 / (ratio * norm)])
        self._steps = np.array(steps, np.int64)
        self._weights = np.array([] if weights is None else weights)
        self._reach = int(self._steps[:, 0].max())
        self._rows, self._run = rows, run
        halo = _BATCH * self._reach
        self._spans = [(max(first - halo, 0), min(last + halo, len(f))) for first, last in rows]
        self._bands = []
        for first, last in self._spans:
            self._bands.append(_Band.of(f[first:last], len(steps)))

    def advance(self, iterations: int) -> None:
        """Take some iterations."""
        for done in range(0, iterations, _BATCH):
            count = min(_BATCH, iterations - done)
            self._run(partial(self._advance_band, count), self._bands)
            self._share_rows()

    def refine(self, f: NDArray[np.float64]) -> None:
        """Go on from here in double precision, with f anew."""
        refined = []
        for band, (first, last) in zip(self._bands, self._spans, strict=True):
            state = {name: getattr(band, name).astype(np.float64) for name in ("u", "ahead", "p")}
            refined.append(_Band.of(f[first:last], len(self._steps))._replace(**state))
        self._bands = refined

    def _advance_band(self, count: int, band: _Band) -> None:
        weights, sizes = self._weights.astype(band.f.dtype), self._sizes.astype(band.f.dtype)
        _iterate(band, self._steps, weights, sizes, self._reach, count)

    @property
    def u(self) -> Floats:
        """The primal variable, (H, W)."""
        return self._gather([band.u for band in self._bands])

    @property
    def p(self) -> Floats:
        """The dual variable, (D/2, H, W); over-relaxed, and therefore beyond its bounds here and there."""
        return self._gather([band.p for band in self._bands])

    def _gather(self, parts: Sequence[Floats]) -> Floats:
        own = [
            band.rows(part, first - start, last - start)[..., :-_MARGIN]
            for band, part, (start, _), (first, last) in zip(
                self._bands, parts, self._spans, self._rows, strict=True
            )
        ]
        return np.concatenate(own, axis=-2)

    def _share_rows(self) -> None:
        """Give every band the rows of its neighbours anew."""
        for above in range(len(self._bands) - 1):
            below = above + 1
            border = self._rows[below][0]
            for source, target, first, last in (
                (above, below, self._spans[below][0], border),
                (below, above, border, self._spans[above][1]),
            ):
                theirs, ours = self._bands[source], self._bands[target]
                start, to = self._spans[source][0], self._spans[target][0]
                for name in ("u", "ahead", "p"):
                    new = theirs.rows(getattr(theirs, name), first - start, last - start)
                    ours.rows(getattr(ours, name), first - to, last - to)[:] = new


@compiled
def _iterate(
    band: _Band, steps: NDArray[np.int64], weights: Floats, sizes: Floats, reach: int, count: int
) -> None:
    """Take a batch of iterations. What its reach covers, from where the band was cut off, becomes wrong."""
    lam, tau, sigma = sizes
    height, stride = band.height, band.stride
    width = stride - _MARGIN
    f, u, ahead, across, down = band.f, band.u, band.ahead, band.p[0], band.p[1]
    divergence = band.divergence
    n = np.uintp(width)
    for front in range(height + reach * (count - 1)):
        for i in range(count):
            y = front - reach * i
            if not 0 <= y < height:
                continue
            row = _MARGIN + y * stride
            at = np.uintp(row)
            # Differences that leave the image are 0: the last row and column stand in for their neighbours.
            below = np.uintp(row + stride) if y + 1 < height else at
            if weights.size > 0:
                _step_axes(across, down, ahead, at, below, n, sigma, weights[0], weights[1])
            else:
                _step_axes_isotropic(across, down, ahead, at, below, n, sigma)
            if y > 0:
                _diverge(divergence, across, down, down, at, np.uintp(row - stride), n)
            else:
                _diverge(divergence, across, down, band.nothing, at, np.uintp(0), n)
            for k in range(2, len(steps)):
                dy, dx = steps[k]
                left, m = max(-dx, 0), np.uintp(width - abs(dx))
                p, start = band.p[k], row + left
                if y + dy < height:
                    _step(p, ahead, np.uintp(start), np.uintp(start + dy * stride + dx), m, sigma, weights[k])
                    _add(divergence, np.uintp(left), p, np.uintp(start), m)
                if y >= dy:
                    _subtract(divergence, np.uintp(left + dx), p, np.uintp(start - dy * stride), m)
            _step_primal(u, ahead, f, divergence, at, n, tau, tau * lam)
            ahead[row + width] = ahead[row + width - 1]


@compiled
def _step_axes(
    across: Floats,
    down: Floats,
    ahead: Floats,
    at: Index,
    below: Index,
    n: Index,
    sigma: float,
    first: float,
    second: float,
) -> None:
    for x in range(n):
        i = at + x
        here = ahead[i]
        a = min(max(across[i] + sigma * (ahead[i + _ONE] - here), -first), first)
        d = min(max(down[i] + sigma * (ahead[below + x] - here), -second), second)
        across[i] += _RELAXATION * (a - across[i])
        down[i] += _RELAXATION * (d - down[i])


@compiled
def _step_axes_isotropic(
    across: Floats, down: Floats, ahead: Floats, at: Index, below: Index, n: Index, sigma: float
) -> None:
    one = np.float32(1)
    for x in range(n):
        i = at + x
        here = ahead[i]
        a = across[i] + sigma * (ahead[i + _ONE] - here)
        d = down[i] + sigma * (ahead[below + x] - here)
        shrink = one / max(one, np.sqrt(a * a + d * d))
        across[i] += _RELAXATION * (a * shrink - across[i])
        down[i] += _RELAXATION * (d * shrink - down[i])


@compiled
def _step(p: Floats, ahead: Floats, at: Index, there: Index, n: Index, sigma: float, weight: float) -> None:
    for x in range(n):
        i = at + x
        stepped = min(max(p[i] + sigma * (ahead[there + x] - ahead[i]), -weight), weight)
        p[i] += _RELAXATION * (stepped - p[i])


@compiled
def _diverge(
    divergence: Floats, across: Floats, down: Floats, above: Floats, at: Index, before: Index, n: Index
) -> None:
    for x in range(n):
        i = at + x
        divergence[x] = across[i] - across[i - _ONE] + down[i] - above[before + x]


@compiled
def _add(divergence: Floats, to: Index, p: Floats, at: Index, n: Index) -> None:
    for x in range(n):
        divergence[to + x] += p[at + x]


@compiled
def _subtract(divergence: Floats, to: Index, p: Floats, at: Index, n: Index) -> None:
    for x in range(n):
        divergence[to + x] -= p[at + x]


@compiled
def _step_primal(
    u: Floats, ahead: Floats, f: Floats, divergence: Floats, at: Index, n: Index, tau: float, pull: float
) -> None:
    for x in range(n):
        i = at + x
        v = u[i] + tau * divergence[x]
        # The proximal step of τλ|u - f| pulls towards f by at most τλ.
        v += min(max(f[i] - v, -pull), pull)
        ahead[i] = v + v - u[i]
        u[i] += _RELAXATION * (v - u[i])
