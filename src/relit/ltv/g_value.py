r"""The scale of shapes: at which λ they leave u, and the λ that suits a face (Sect. 5 of the paper).

A shape Ω of contrast leaves u as soon as λ ≤ 1/G, where ``1/G = min Per(S) / (|S ∩ Ω| - |S \ Ω|)`` over all
sets S of pixels, and Per is the perimeter that the neighbourhood measures. (G is the G-value, after Meyer's
norm [1]_.) The minimum of the ratio is found by Dinkelbach's method: for the best ratio so far, a cut finds
the set that is best by how far it exceeds it, and the ratio of that set is the next.

References
----------
.. [1] W. Yin, D. Goldfarb, S. Osher, "The total variation regularized L1 model for multiscale decomposition",
       Multiscale Model. Simul. 6(1), 2007.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from typing import TYPE_CHECKING, Any

import numpy as np

from relit.errors import ImageError, LandmarkError
from relit.face.outline import drawn, feature_hulls
from relit.ltv.decomposition import FACE_SCALE
from relit.solver.neighborhoods import UNIT, Grid, Neighborhood, paired

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from relit.face.landmarks import Landmarks
    from relit.settings.options import TransferOptions

#: "Slightly smaller than 1/G of the facial features' mask", says the paper.
_SLIGHTLY_SMALLER = 0.95
_LEAST_LAM = 1e-12  # as good as 0, and 1/λ does not overflow

_FEATURES = ("brows", "eyes", "nose", "mouth")


@dataclass(frozen=True, eq=False)
class Scale:
    """At which λ a shape leaves u.

    Attributes
    ----------
    critical_lam : float
        1/G, in px⁻¹: nothing of the shape is in u below it, and `core` is in u above it.
    core : (H, W) bool array
        The set whose ratio that is: what stays longest.
    """

    critical_lam: float
    core: NDArray[np.bool_]

    @property
    def g_value(self) -> float:
        """G, in px: half the radius of a disc, a quarter of the side of a square."""
        return 1 / self.critical_lam


def scale_of(mask: NDArray[Any], neighborhood: Neighborhood = 4) -> Scale:
    """Return the scale of a shape, an (H, W) array of booleans; of several shapes, the largest scale.

    The neighbourhood measures the perimeter. The scale is exact to the 2⁻²⁰ px⁻¹ of the solver's λ.

    Raises
    ------
    ImageError
        If the mask is not a two-dimensional array of booleans with a pixel in it.

    Examples
    --------
    >>> import numpy as np
    >>> square = np.zeros((20, 20), bool)
    >>> square[5:13, 5:13] = True
    >>> scale_of(square).g_value  # 64 px over a perimeter of 32
    2.0
    """
    if not isinstance(mask, np.ndarray) or mask.ndim != 2 or mask.dtype != np.bool_:
        raise ImageError("mask: expected a two-dimensional array of booleans")
    if not mask.any():
        raise ImageError("mask: has no pixel set; draw a shape into it")
    from relit.solver.exact import tv_l1  # which brings a compiler along, and only λ "auto" needs it

    grid = Grid.of(neighborhood)
    # The frame of an image is no boundary. Farther than G from the shape no set gains by touching it, and G
    # is largest for a disc: less than half the root of its area.
    room = int(np.sqrt(mask.sum()) / 2) + 2
    shape = np.pad(mask, room)
    core, best = shape, _ratio(shape, shape, grid)
    while True:
        # The least λ of the solver at which the best set so far would still stay.
        fidelity = int(best) + 1
        candidate = tv_l1(shape.astype(np.uint8), fidelity / UNIT, neighborhood) > 0
        if not candidate.any():
            break
        ratio = _ratio(candidate, shape, grid)
        if ratio >= best:
            break
        core, best = candidate, ratio
    return Scale(float(best / UNIT), core[room:-room, room:-room])


def _ratio(candidate: NDArray[np.bool_], mask: NDArray[np.bool_], grid: Grid) -> Fraction:
    perimeter = 0
    for step, weight in zip(grid.steps, grid.weights, strict=True):
        here, there = paired(mask.shape, step)
        perimeter += weight * int(np.count_nonzero(candidate[here] != candidate[there]))
    inside = int(np.count_nonzero(candidate & mask)) - int(np.count_nonzero(candidate & ~mask))
    return Fraction(perimeter, inside)


def feature_mask(landmarks: Landmarks) -> NDArray[np.bool_]:
    """Return the brows, eyes, nose and mouth of a face, filled, on a face whose eyes are 100 px apart.

    Raises
    ------
    LandmarkError
        If the landmarks' scheme does not say which points these are.
    """
    if not all(name in landmarks.groups for name in _FEATURES):
        raise LandmarkError(
            f"landmarks: expected a scheme that names {', '.join(_FEATURES)}, got {landmarks.scheme}; give "
            "λ as a number"
        )
    hulls = feature_hulls(landmarks, _FEATURES)
    points = np.vstack(hulls)
    grow, room = FACE_SCALE / landmarks.interocular_distance, FACE_SCALE / 4
    corner = points.min(axis=0) * grow - room
    width, height = np.ceil(points.max(axis=0) * grow - corner + room).astype(int).tolist()
    return drawn([hull * grow - corner for hull in hulls], (height, width))


def automatic_lam(landmarks: Landmarks, neighborhood: Neighborhood = 4) -> float:
    """Return the λ slightly smaller than 1/G of a face's features, for a face whose eyes are 100 px apart.

    At a larger one the largest of the features would go over to u, and be lost to the person.

    Examples
    --------
    >>> from relit import detect_landmarks, read_image, sample
    >>> face = detect_landmarks(read_image(sample("target")).pixels)
    >>> 0.02 < automatic_lam(face) < 0.3
    True
    """
    return _SLIGHTLY_SMALLER * scale_of(feature_mask(landmarks), neighborhood).critical_lam


def lam_for(landmarks: Landmarks, options: TransferOptions) -> float:
    """Return the λ that options mean for a face, for one whose eyes are 100 px apart."""
    if options.lam != "auto":
        return max(float(options.lam), _LEAST_LAM)
    # The isotropic length is nearest to that over 16 neighbours.
    neighborhood = 16 if options.neighborhood == "isotropic" else options.neighborhood
    return automatic_lam(landmarks, neighborhood)
