"""The over-relaxed primal-dual iteration of [1]_ and [2]_ for TV-L1, row by row, in bands.

The saddle point is that of ``Σ p·∇u + λ |u - f|`` over u, and over p with ``|p| ≤ w`` for every step of a
grid (anisotropic) or ``|(p₀, p₁)| ≤ 1`` at every pixel (isotropic).

Iterations are staggered: while the first of a batch is at row y, the next is at row ``y - reach``, and so on,
so that a batch passes through the memory once. Bands of rows carry as many rows of their neighbours with them
as a batch uses up, and are independent of one another until its end: bands do not change a bit of the result.

The kernels work on flat rows with a margin of zeros, and take unsigned indices: those cannot wrap around, so
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
_STATE = ("u", "ahead", "p")  # what goes on from one iteration to the next
_ONE = np.uintp(1)


class _Band(NamedTuple):
    """Rows `first` to `last` of f, of u, of its extrapolation, and of p for every step.

    Pixel x of row y is at ``margin + (y - first) * stride + x``; a 0 lies between any two rows, and as many
    rows of zeros above as the steps go down.
    """

    f: Floats
    u: Floats
    ahead: Floats
    p: Floats
    divergence: Floats
    first: int
    last: int
    margin: int
    stride: int

    @classmethod
    def of(cls, f: Floats, first: int, last: int, steps: NDArray[np.int64]) -> _Band:
        width = f.shape[1]
        stride = width + 1
        margin = 1 + int(steps[:, 0].max()) * stride
        empty = np.zeros(margin + (last - first) * stride, f.dtype)
        p, divergence = np.zeros((len(steps), empty.size), f.dtype), np.zeros(width, f.dtype)
        band = cls(empty, empty, empty, p, divergence, first, last, margin, stride)
        band.rows(empty, first, last)[:, :-1] = f[first:last]
        ahead = empty.copy()
        band.rows(ahead, first, last)[:, -1] = f[first:last, -1]
        return band._replace(u=empty.copy(), ahead=ahead)

    def rows(self, flat: Floats, first: int, last: int) -> Floats:
        """Return some rows of one of the arrays, with the margin behind them."""
        start, stop = ((row - self.first) * self.stride + self.margin for row in (first, last))
        return flat[..., start:stop].reshape(*flat.shape[:-1], last - first, self.stride)


class SaddlePoint:
    """An image's u and p on their way to the saddle point.

    f is of values in [0, 1]; arithmetic is of its type, until refined. The steps are ``(dy, dx)``, ``(0, 1)``
    and ``(1, 0)`` first; without weights, the isotropic length of these two counts. `ratio` is primal over
    dual step. The ranges of rows cover the image in order: the bands that `run` works on at once. Of several,
    none is shorter than what it shares with its neighbour, 8 rows for every row that the steps go down.
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
        self._rows, self._run = rows, run
        halo = _BATCH * int(self._steps[:, 0].max())
        spans = [(max(first - halo, 0), min(last + halo, len(f))) for first, last in rows]
        self._bands = [_Band.of(f, *span, self._steps) for span in spans]

    def start(self, u: Floats, p: Floats) -> None:
        """Begin at some u, (H, W), and p, (D/2, H, W), which is 0 where a step leaves the image."""
        for band in self._bands:
            span = band.first, band.last
            band.rows(band.u, *span)[:, :-1] = u[slice(*span)]
            ahead = band.rows(band.ahead, *span)
            ahead[:, :-1], ahead[:, -1] = u[slice(*span)], u[slice(*span), -1]
            band.rows(band.p, *span)[..., :-1] = p[:, slice(*span)]

    def advance(self, iterations: int) -> None:
        """Take some iterations."""
        for done in range(0, iterations, _BATCH):
            count = min(_BATCH, iterations - done)
            self._run(partial(self._advance_band, count), self._bands)
            self._share_rows()

    def refine(self, f: NDArray[np.float64]) -> None:
        """Go on from here in double precision, with f anew."""
        for k, band in enumerate(self._bands):
            state = {name: getattr(band, name).astype(np.float64) for name in _STATE}
            self._bands[k] = _Band.of(f, band.first, band.last, self._steps)._replace(**state)

    @property
    def u(self) -> Floats:
        """The primal variable, (H, W)."""
        return self._gather("u")

    @property
    def p(self) -> Floats:
        """The dual variable, (D/2, H, W); over-relaxed, and therefore beyond its bounds here and there."""
        return self._gather("p")

    def _gather(self, name: str) -> Floats:
        own = zip(self._bands, self._rows, strict=True)
        return np.concatenate(
            [band.rows(getattr(band, name), *rows)[..., :-1] for band, rows in own], axis=-2
        )

    def _advance_band(self, count: int, band: _Band) -> None:
        weights, sizes = (numbers.astype(band.f.dtype) for numbers in (self._weights, self._sizes))
        _iterate(band, self._steps, weights, sizes, count)

    def _share_rows(self) -> None:
        """Give every band the rows of its neighbours anew."""
        for above, below, (border, _) in zip(self._bands, self._bands[1:], self._rows[1:], strict=False):
            for theirs, ours, first, last in (
                (above, below, below.first, border),
                (below, above, border, above.last),
            ):
                for name in _STATE:
                    new = theirs.rows(getattr(theirs, name), first, last)
                    ours.rows(getattr(ours, name), first, last)[:] = new


@compiled
def _iterate(band: _Band, steps: NDArray[np.int64], weights: Floats, sizes: Floats, count: int) -> None:
    """Take a batch of iterations. What its reach covers, from where the band was cut off, becomes wrong."""
    lam, tau, sigma = sizes
    height, stride, ahead, divergence = band.last - band.first, band.stride, band.ahead, band.divergence
    width, reach = stride - 1, steps[:, 0].max()
    for front in range(height + reach * (count - 1)):
        for i in range(count):
            y = front - reach * i
            if not 0 <= y < height:
                continue
            row = band.margin + y * stride
            at, n = np.uintp(row), np.uintp(width)
            # Differences that leave the image are 0.
            if weights.size == 0:
                below = np.uintp(row + stride) if y + 1 < height else at
                _step_isotropic(band.p[0], band.p[1], ahead, at, below, n, sigma)
            for k in range(weights.size):
                dy, dx = steps[k]
                if y + dy < height:
                    start = row + max(-dx, 0)
                    there, m = np.uintp(start + dy * stride + dx), np.uintp(max(width - abs(dx), 0))
                    _step(band.p[k], ahead, np.uintp(start), there, m, sigma, weights[k])
            _diverge_axes(divergence, band.p[0], band.p[1], at, np.uintp(row - stride), n)
            for k in range(2, len(steps)):
                dy, dx = steps[k]
                _diverge(divergence, band.p[k], at, np.uintp(row - dy * stride - dx), n)
            _step_primal(band, at, n, tau, tau * lam)
            ahead[row + width] = ahead[row + width - 1]


@compiled
def _step_isotropic(
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
def _diverge_axes(
    divergence: Floats, across: Floats, down: Floats, at: Index, above: Index, n: Index
) -> None:
    for x in range(n):
        i = at + x
        divergence[x] = across[i] - across[i - _ONE] + down[i] - down[above + x]


@compiled
def _diverge(divergence: Floats, p: Floats, at: Index, before: Index, n: Index) -> None:
    for x in range(n):
        divergence[x] = divergence[x] + p[at + x] - p[before + x]


@compiled
def _step_primal(band: _Band, at: Index, n: Index, tau: float, pull: float) -> None:
    u, ahead, f, divergence = band.u, band.ahead, band.f, band.divergence
    for x in range(n):
        i = at + x
        v = u[i] + tau * divergence[x]
        # The proximal step of τλ|u - f| pulls towards f by at most τλ.
        v += min(max(f[i] - v, -pull), pull)
        ahead[i] = v + v - u[i]
        u[i] += _RELAXATION * (v - u[i])
