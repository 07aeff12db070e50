"""Two baselines that know no light: planes take on the reference's mean and spread, or its histogram.

They work in the colour space that is chosen; that of [1]_ is lαβ, to which YCbCr comes nearest here.

References
----------
.. [1] E. Reinhard, M. Ashikhmin, B. Gooch, P. Shirley, "Color transfer between images", IEEE CG&A 21(5),
       2001.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from relit.methods.scene import Relit, Scene, as_planes, stacked
from relit.photo.pixels import to_unit

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray


def match_moments(scene: Scene) -> Relit:
    """Give the target the reference's mean and standard deviation."""

    def match(plane: NDArray[Any], ours: NDArray[Any], theirs: NDArray[Any]) -> NDArray[Any]:
        spread = float(ours.std())
        scale = float(theirs.std()) / spread if spread > 0 else 1.0
        return np.asarray((plane - ours.mean()) * scale + theirs.mean())

    return _by_planes(scene, match)


def match_histogram(scene: Scene) -> Relit:
    """Give the target the reference's distribution of values."""

    def match(plane: NDArray[Any], ours: NDArray[Any], theirs: NDArray[Any]) -> NDArray[Any]:
        (values, share), (their_values, their_share) = _distribution(ours), _distribution(theirs)
        return np.asarray(np.interp(plane, values, np.interp(share, their_share, their_values)))

    return _by_planes(scene, match)


def _distribution(values: NDArray[Any]) -> tuple[NDArray[Any], NDArray[np.float64]]:
    """Return the values that occur, and the share of pixels below each and half of those that have it."""
    distinct, counts = np.unique(values, return_counts=True)
    return distinct, (np.cumsum(counts) - counts / 2) / values.size


def _by_planes(
    scene: Scene, match: Callable[[NDArray[Any], NDArray[Any], NDArray[Any]], NDArray[Any]]
) -> Relit:
    targets = as_planes(to_unit(scene.target).astype(np.float64))
    references = as_planes(to_unit(scene.reference).astype(np.float64))
    matched = [
        match(plane, plane[scene.face.interior], reference[scene.face.interior])
        for plane, reference in zip(targets * (len(references) // len(targets)), references, strict=True)
    ]
    return Relit(np.clip(stacked(matched), 0, 1))
