"""The bicubic spline through values on a grid, with not-a-knot ends [1]_.

It is that of SciPy's `RectBivariateSpline`, whose import takes longer than all maps of a transfer.

References
----------
.. [1] C. de Boor, "A Practical Guide to Splines", Springer, 1978, chapter IV.
"""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Floats = NDArray[np.float64]


class GridSpline:
    """The spline through `values`, (h, w, m) with h and w above 3, which lie at every `step` px from (0, 0).

    Examples
    --------
    >>> cubes = np.arange(0, 11.0, 2)[:, None, None] ** 3 * np.ones((6, 1))
    >>> spline = GridSpline(cubes, 2)
    >>> spline.at(np.array([[4.2, 5.0]])).round(9).tolist()
    [[125.0]]
    >>> spline.on_pixels(4, 2)[..., 0].round(9).tolist()
    [[0.0, 0.0], [1.0, 1.0], [8.0, 8.0], [27.0, 27.0]]
    """

    def __init__(self, values: Floats, step: int) -> None:
        self._values, self._step = values, step

    def at(self, points: Floats) -> Floats:
        """Return the values, (k, m), at (k, 2) places ``(x, y)`` in px."""
        cells = np.minimum(points // self._step, np.array(self._values.shape[1::-1]) - 2)
        of_x, of_y = _weights((points / self._step - cells).T).transpose(2, 0, 1, 3)
        column, row = cells.astype(int).T
        width, count = self._values.shape[1:]
        values = np.zeros((len(points), count))
        for right in (0, 1):
            for below in (0, 1):
                corners = self._parts.take((row + below) * width + column + right, axis=0)
                weights = of_x[right][:, None] * of_y[below]
                values += np.einsum("kpm,pk->km", corners, weights.reshape(4, -1))
        return values

    @cached_property
    def _parts(self) -> Floats:
        """At each node the value, its bend down, that across, and that of both: (h · w, 4, m)."""
        down = np.stack([self._values, _bends(self._values)], axis=2)
        across = _bends(down.swapaxes(0, 1)).swapaxes(0, 1)
        both = np.concatenate([down, across], axis=2)
        return both.reshape(-1, *both.shape[2:])

    def on_pixels(self, height: int, width: int) -> Floats:
        """Return the values at every pixel, (height, width, m)."""
        return self._filled(self._filled(self._values, height).swapaxes(0, 1), width).swapaxes(0, 1)

    def _filled(self, values: Floats, size: int) -> Floats:
        """Return the first `size` of values along the first axis, with those between the nodes."""
        bends = _bends(values)
        parts = np.stack([values[:-1], bends[:-1], values[1:], bends[1:]], axis=1)
        weights = _weights(np.arange(self._step) / self._step).reshape(4, -1).T
        made = weights @ parts.reshape(*parts.shape[:2], -1)
        return made.reshape(-1, *values.shape[1:])[:size]


def _weights(place: Floats) -> Floats:
    """Return the weights of both ends of a cell, of the value and of the bend each: (2, 2, ...)."""
    ends = np.stack([1 - place, place])
    return np.stack([ends, (ends**3 - ends) / 6], axis=1)


def _bends(values: Floats) -> Floats:
    """Return the second derivatives along the first axis, in units of a step, of the spline at its nodes."""
    bends = np.empty(values.shape)
    bends[1:-1] = np.diff(np.ascontiguousarray(values), 2, axis=0)  # that is all at a not-a-knot
    bends[2:-2] *= 6
    inner = range(2, len(values) - 2)
    shares = [0.0, 0.0]
    for i in inner:  # m[i - 1] + 4 m[i] + m[i + 1] = 6 differences, by elimination
        shares.append(1 / (4 - shares[-1]))
        bends[i] -= bends[i - 1]
        bends[i] *= shares[i]
    for i in reversed(inner):
        bends[i] -= shares[i] * bends[i + 1]
    bends[0] = 2 * bends[1] - bends[2]
    bends[-1] = 2 * bends[-2] - bends[-3]
    return bends
