"""Two baselines that take a second reference: the reference's face in the target's own light.

For two people of like shape ``target / second`` is the quotient of their albedos, whatever the light [1]_, so
that ``target · reference / second`` is the relit face. The same ratio of two expressions of one face carries
the wrinkles of the second to the target [2]_; there it is smoothed where target and second reference do not
correlate, which is where they are misaligned.

References
----------
.. [1] A. Shashua, T. Riklin-Raviv, "The quotient image: class-based re-rendering and recognition with varying
       illuminations", IEEE PAMI 23(2), 2001.
.. [2] Z. Liu, Y. Shan, Z. Zhang, "Expressive expression mapping with ratio images", SIGGRAPH 2001.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from relit.methods.scene import Relit, Scene, as_planes, stacked
from relit.photo.doubles import gaussian
from relit.photo.pixels import DARKEST, to_unit

if TYPE_CHECKING:
    from numpy.typing import NDArray

_WINDOW = 0.05  # in interocular distances: how far round a pixel faces are correlated, and smoothed


def quotient(scene: Scene) -> Relit:
    """Return target · reference / second reference."""
    return Relit(stacked([np.exp(target + new - old) for target, old, new in _log_planes(scene)]))


def expression_ratio(scene: Scene) -> Relit:
    """Return the same, the ratio smoothed where target and second reference do not correlate."""
    radius = _WINDOW * scene.face.interocular_distance
    relit = []
    for target, old, new in _log_planes(scene):
        alike = np.clip(correlation(target, old, radius), 0, 1)
        ratio = new - old
        relit.append(np.exp(target + alike * ratio + (1 - alike) * gaussian(ratio, radius)))
    return Relit(stacked(relit))


def correlation(a: NDArray[np.float64], b: NDArray[np.float64], radius: float) -> NDArray[np.float64]:
    """Return the normalised correlation of two planes in Gaussian windows; 0 where one of them is flat."""

    def mean(plane: NDArray[np.float64]) -> NDArray[np.float64]:
        return gaussian(plane, radius)

    of_a, of_b = mean(a), mean(b)
    power = (mean(a * a) - of_a**2) * (mean(b * b) - of_b**2)
    return np.asarray((mean(a * b) - of_a * of_b) / np.sqrt(np.maximum(power, 1e-12)))


def _log_planes(scene: Scene) -> list[tuple[NDArray[np.float64], ...]]:
    """Return, plane by plane, the logarithms of target, second reference and reference."""
    targets, references = _logs(scene.target), _logs(scene.reference)
    targets *= len(references) // len(targets)
    return list(zip(targets, _logs(scene.second), references, strict=True))


def _logs(image: NDArray[Any] | None) -> list[NDArray[np.float64]]:
    assert image is not None, "`transfer` sees to it that there is a second reference"
    return as_planes(np.log(np.maximum(to_unit(image).astype(np.float64), DARKEST)))
