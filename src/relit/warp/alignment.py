"""Warp the reference onto the target through their landmarks (Sect. 3 of Li, Yin and Deng, 2009).

The map runs *backward*, from every pixel of the target to a place in the reference, so that every pixel gets
a value. Far from the face it is held by frame anchors: points round the image that go where the best
similarity of the two faces takes them.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from relit.errors import OptionError
from relit.face.landmarks import Landmarks, as_landmarks, check_inside, check_pair, control_rows
from relit.photo.filters import gaussian, spline_at_places
from relit.photo.foreign_images import pixels_of
from relit.photo.pixels import check_samples, from_unit, size_and_dtype, to_unit
from relit.photo.resampling import blurred
from relit.runtime.memo import remembered
from relit.warp.rbf import RBF, KernelName, fit_rbf, spacing_of, spread_of
from relit.warp.similarity import fit_similarity

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import ArrayLike, DTypeLike, NDArray

    from relit.photo.foreign_images import AnyImage

    _Lattice = tuple[NDArray[np.float64], NDArray[np.float64]]

#: What smoothing None tries, in turn, until the map no longer folds: detected points are noisy, and an exact
#: spline through dense noise can turn over.
SMOOTHING_LADDER = (1e-3, 1e-2, 1e-1, 1.0)

#: Error of the map, in px, that its evaluation on a coarse grid may add.
MAP_TOLERANCE = 0.05

#: σ in px above which the reference is blurred on a coarser grid: no blur takes more work than this one, and
#: an edge, which the target's px hold but a few times, is off by 1 %.
_WIDE = 8

_LEAST_CELL = 2  # px
_ANCHOR_MARGIN = 0.5  # of the interocular distance, between the face and the nearest anchor


@dataclass(frozen=True, eq=False)
class Alignment:
    """The reference, laid over the target.

    Attributes
    ----------
    warped : (H, W) or (H, W, 3) array
        The reference on the target's pixel grid, in the dtype that was asked for. Beyond the edge of the
        reference its edge is repeated.
    map : (H, W, 2) float32 array
        Where in the reference, ``(x, y)`` in px, each target pixel looks.
    inside : (H, W) bool array
        Where that place is on the reference.
    folded : float
        Share of the frame, or of the landmarks' box if that is larger, where the map turns over
        (Jacobian ≤ 0); 0 for a map that can be trusted.
    interpolant : RBF
        The map as it was fitted.
    smoothing : float
        The smoothing that it was fitted with.
    scale : float
        How large the reference is, the target being 1.
    """

    warped: NDArray[Any]
    map: NDArray[np.float32]
    inside: NDArray[np.bool_]
    folded: float
    interpolant: RBF
    smoothing: float
    scale: float

    def __repr__(self) -> str:
        """Return size and dtype of the warped reference, and how it was laid."""
        fit = f"folded={self.folded:.3g}, smoothing={self.smoothing:.3g}, scale={self.scale:.3g}"
        return f"Alignment({size_and_dtype(self.warped)}, {fit})"

    def lay(self, image: NDArray[Any]) -> NDArray[np.float32]:
        """Return what else is of the reference's shape, in [0, 1], laid as the reference is.

        Examples
        --------
        >>> points = Landmarks([[8, 8], [24, 8], [16, 16], [16, 24]])
        >>> reference = np.tile(np.arange(32, dtype=np.uint8), (32, 1))
        >>> alignment = align(reference, points.shifted(3, 0), points, (32, 32))
        >>> round(255 * float(alignment.lay(reference)[16, 10]))
        13
        """
        return _sample(image, self.map, self.scale)


def align(
    reference: AnyImage,
    reference_landmarks: Landmarks | ArrayLike,
    target_landmarks: Landmarks | ArrayLike,
    shape: tuple[int, ...],
    *,
    kernel: KernelName = "thin_plate_spline",
    affine: bool = True,
    smoothing: float | None = None,
    dtype: DTypeLike | None = None,
) -> Alignment:
    """Warp a reference onto the frame of a target.

    Parameters
    ----------
    reference : array, Photo, PIL image, torch tensor, or path
        As of `relit.transfer`; alpha is left out.
    reference_landmarks, target_landmarks : Landmarks or (n, 2) or (n, 3) array_like
        Paired row by row. Of a mesh, well-spread points on the features' outlines are used; irises and inner
        lips are left out, since they follow gaze and speech.
    shape : tuple of int
        ``(H, W, ...)`` of the target.
    kernel, affine
        As for `fit_rbf`.
    smoothing : float, optional
        As for `fit_rbf`; 0 takes every landmark exactly to its partner. By default the least of 0.001, 0.01,
        0.1 and 1 whose map does not fold; without the affine part, 0.
    dtype : dtype, optional
        Of the warped image; by default the reference's.

    Returns
    -------
    Alignment

    Raises
    ------
    ImageError
        If the reference is not a photo's pixels.
    LandmarkError
        If the landmarks do not pair up, do not fit their images, or admit no map.
    OptionError
        If an option is out of range.

    Examples
    --------
    >>> import numpy as np
    >>> points = Landmarks([[8, 8], [24, 8], [16, 16], [16, 24]])
    >>> reference = np.tile(np.arange(32, dtype=np.uint8), (32, 1))
    >>> alignment = align(reference, points.shifted(3, 0), points, (32, 32))
    >>> int(alignment.warped[16, 10]), alignment.folded
    (13, 0.0)
    """
    image = pixels_of(reference, "reference")
    check_samples(image, "reference")
    reference_landmarks = as_landmarks(reference_landmarks, "reference_landmarks")
    target_landmarks = as_landmarks(target_landmarks, "target_landmarks")
    if len(shape) < 2 or min(shape[:2]) < 1:
        raise OptionError(f"shape: expected (H, W, ...) of the target, got {shape!r}")
    check_pair(target_landmarks, reference_landmarks)
    check_inside(target_landmarks, shape, "target_landmarks")
    check_inside(reference_landmarks, image.shape, "reference_landmarks")
    return lay_over(
        image,
        reference_landmarks,
        target_landmarks,
        shape,
        kernel=kernel,
        affine=affine,
        smoothing=smoothing,
        dtype=dtype,
    )


@remembered
def lay_over(
    reference: NDArray[Any],
    reference_landmarks: Landmarks,
    target_landmarks: Landmarks,
    shape: tuple[int, ...],
    *,
    kernel: KernelName = "thin_plate_spline",
    affine: bool = True,
    smoothing: float | None = None,
    dtype: DTypeLike | None = None,
    tolerance: float = MAP_TOLERANCE,
) -> Alignment:
    """Do what `align` does, of photos and landmarks that have been checked; the map to `tolerance` px."""
    height, width = shape[:2]
    rows = control_rows(target_landmarks)
    here, there = target_landmarks.xy[rows], reference_landmarks.xy[rows]
    similarity = fit_similarity(here, there)
    anchors = _anchors(here, height, width, _ANCHOR_MARGIN * target_landmarks.interocular_distance)
    # Where landmarks are, the map bends much; of 163 pairs whose landmarks were moved, all folds were found.
    lattices = [
        _lattice(np.zeros(2), np.array([width - 1.0, height - 1.0]), 32),
        _lattice(here.min(axis=0), here.max(axis=0), 64),
    ]
    # Without the affine part, smoothing would draw the map to a point instead of a plane.
    ladder = (smoothing,) if smoothing is not None else SMOOTHING_LADDER if affine else (0.0,)
    # The face sets the lengths, not the frame, however far that is.
    fit = partial(
        fit_rbf,
        np.vstack([here, anchors]),
        np.vstack([there, similarity(anchors)]),
        kernel=kernel,
        affine=affine,
        radius=spacing_of(here),
        scale=spread_of(here),
    )
    interpolant, used, folded = _least_folded(fit, ladder, lattices)

    places = interpolant.on_grid(height, width, tolerance=tolerance)
    limits = np.array(reference.shape[1::-1]) - 0.5
    inside = np.asarray(((places >= -0.5) & (places <= limits)).all(axis=-1))
    warped = _sample(reference, places, similarity.scale)
    return Alignment(
        from_unit(warped, reference.dtype if dtype is None else dtype),
        places,
        inside,
        folded,
        interpolant,
        used,
        similarity.scale,
    )


def _least_folded(
    fit: Callable[..., RBF], ladder: tuple[float, ...], lattices: list[_Lattice]
) -> tuple[RBF, float, float]:
    """Return the map of least smoothing that does not fold, or the last; its smoothing, and its folds."""
    terms: list[NDArray[np.float64]] = []
    for smoothing in ladder:
        interpolant = fit(smoothing=smoothing)
        terms = terms or [interpolant.terms(*lattice) for lattice in lattices]
        folded = max(
            _folded_share(interpolant.of_terms(known, *lattice))
            for known, lattice in zip(terms, lattices, strict=True)
        )
        if folded == 0:
            break
    return interpolant, smoothing, folded


def _anchors(face: NDArray[np.float64], height: int, width: int, margin: float) -> NDArray[np.float64]:
    """Return the corners and mid-edges of the frame, moved out where the face comes near it."""
    left, top = np.minimum([0, 0], face.min(axis=0) - margin)
    right, bottom = np.maximum([width - 1, height - 1], face.max(axis=0) + margin)
    x, y = np.meshgrid(np.linspace(left, right, 3), np.linspace(top, bottom, 3))
    ring = np.arange(9) != 4
    return np.column_stack([x.ravel()[ring], y.ravel()[ring]])


def _lattice(low: NDArray[np.float64], high: NDArray[np.float64], cells: int) -> _Lattice:
    """Return x and y of a lattice of so many cells along the sides of a box; fewer, if finer than 2 px."""
    sides = np.clip((high - low) / _LEAST_CELL, 8, cells).astype(int) + 1
    x, y = (np.linspace(low[axis], high[axis], sides[axis]) for axis in (0, 1))
    return x, y


def _folded_share(places: NDArray[np.float64]) -> float:
    """Return the share of a lattice where the map, which takes it to these places, turns over."""
    across, down = np.diff(places, axis=1)[:-1], np.diff(places, axis=0)[:, :-1]
    jacobian = across[..., 0] * down[..., 1] - across[..., 1] * down[..., 0]
    return float((jacobian <= 0).mean())


def _sample(image: NDArray[Any], places: NDArray[np.float32], scale: float) -> NDArray[np.float32]:
    """Return `image` in [0, 1] at `places`, bicubically; blurred first where the map shrinks it."""
    blur = 0.5 * np.sqrt(max(scale**2 - 1, 0.0))  # brings the pixel's own σ of about ½ to the target's
    # Only the part that is looked at, and what the blur and the spline need around it.
    around = int(np.ceil(4 * blur)) + 16
    limits = np.array(image.shape[1::-1])
    first, last = _ends(places)
    left, top = np.clip(np.floor(first).astype(int) - around, 0, limits - 1)
    right, bottom = np.clip(np.ceil(last).astype(int) + around + 1, 1, limits)
    planes = np.atleast_3d(to_unit(image[top:bottom, left:right]))
    planes = blurred(planes, blur) if blur > _WIDE else gaussian(planes, blur, edge="repeated")
    sampled = spline_at_places(planes, places[..., 0] - left, places[..., 1] - top)
    # Cubic splines overshoot at edges; light does not.
    np.clip(sampled, *_ends(planes), out=sampled)
    return sampled[..., 0] if image.ndim == 2 else sampled


def _ends(planes: NDArray[Any]) -> tuple[NDArray[Any], NDArray[Any]]:
    """Return the least and the greatest value of each plane of (H, W, k)."""
    # Of all planes at once, NumPy takes twenty times as long.
    each = [planes[..., k] for k in range(planes.shape[2])]
    return np.array([plane.min() for plane in each]), np.array([plane.max() for plane in each])
