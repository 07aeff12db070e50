"""The similarity of two faces: how far one is turned, how large it is, and where it lies."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray


@dataclass(frozen=True, eq=False)
class Similarity:
    """A rotation (or reflection-free turn), scaling and shift: ``x ↦ linear @ x + shift``."""

    linear: NDArray[np.float64]
    shift: NDArray[np.float64]

    def __call__(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the images of (n, 2) points."""
        return np.asarray(points @ self.linear.T + self.shift)

    @property
    def scale(self) -> float:
        """Factor by which lengths grow."""
        return float(np.sqrt(np.linalg.det(self.linear)))


def fit_similarity(source: NDArray[np.float64], destination: NDArray[np.float64]) -> Similarity:
    """Return the similarity that takes (n, 2) points nearest to their partners, in least squares.

    In complex numbers it is ``z ↦ a z + b``, so the fit is a linear regression.

    Examples
    --------
    >>> import numpy as np
    >>> square = np.array([[0.0, 0], [1, 0], [1, 1], [0, 1]])
    >>> turn = fit_similarity(square, square @ [[0, 2], [-2, 0]] + [5, 5])
    >>> turn.scale, turn(np.array([[1.0, 0]])).round(6).tolist()
    (2.0, [[5.0, 7.0]])
    """
    z, w = (points[:, 0] + 1j * points[:, 1] for points in (source, destination))
    a = np.vdot(z - z.mean(), w - w.mean()) / np.vdot(z - z.mean(), z - z.mean())
    b = w.mean() - a * z.mean()
    return Similarity(np.array([[a.real, -a.imag], [a.imag, a.real]]), np.array([b.real, b.imag]))
