"""Filters of planes: Gaussians, windows, distances and places between pixels, by OpenCV.

Planes are (H, W), or (H, W, k) where it is said, and are worked on as float32. Beyond their ends they are
mirrored, unless said otherwise.
"""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING, Any, Literal

import cv2
import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Plane = NDArray[np.float32]

_REACH = 4.0  # standard deviations to which a Gaussian goes: 6e-5 of it is left off
_BORDERS = {"mirrored": cv2.BORDER_REFLECT, "repeated": cv2.BORDER_REPLICATE, "black": cv2.BORDER_CONSTANT}
_PAD = 12  # px: as far as a spline feels its ends
# What takes samples to the coefficients of the cubic B-spline through them [1]_, as far as float32 sees it.
#
# .. [1] M. Unser, "Splines: a perfect fit for signal and image processing", IEEE Signal Processing Magazine
#        16(6), 1999.
_TO_SPLINE = np.sqrt(3) * (np.sqrt(3) - 2) ** np.abs(np.arange(-_PAD, _PAD + 1))
#: px of a square whose places are told from one corner: of those of a large photo, float32 keeps too little.
_TILE = 48
_FAR = 1e7  # px: what has nothing in reach is so far from it


def gaussian(
    planes: NDArray[Any], sigma: float, *, edge: Literal["mirrored", "repeated"] = "mirrored"
) -> Plane:
    """Return planes, (H, W) or (H, W, k), blurred by a Gaussian of `sigma` px.

    Parameters
    ----------
    planes : array
    sigma : float
        0 leaves them as they are.
    edge : {"mirrored", "repeated"}
        What is beyond their ends.

    Examples
    --------
    >>> point = np.zeros((9, 9))
    >>> point[4, 4] = 1
    >>> blurred = gaussian(point, 1.0)
    >>> round(float(blurred.sum()), 6), bool(np.isclose(blurred[4, 5] / blurred[4, 4], np.exp(-0.5)))
    (1.0, True)
    """
    given = np.ascontiguousarray(planes, np.float32)
    radius = int(_REACH * sigma + 0.5)
    if radius == 0:
        return given.copy()
    weights = _weights(sigma, radius)
    made = cv2.sepFilter2D(given, cv2.CV_32F, weights, weights, borderType=_BORDERS[edge])
    return _as_shaped(made, given)


@lru_cache(maxsize=256)
def _weights(sigma: float, radius: int) -> Plane:
    weights = np.exp(-0.5 * (np.arange(-radius, radius + 1) / sigma) ** 2)
    return np.asarray(weights / weights.sum(), np.float32)


def dilated(plane: NDArray[Any], size: int) -> Plane:
    """Return the greatest value in the window of `size` px, an odd number, round each pixel."""
    return _in_window(cv2.MORPH_DILATE, plane, size)


def eroded(plane: NDArray[Any], size: int) -> Plane:
    """Return the least value in the window of `size` px round each pixel."""
    return _in_window(cv2.MORPH_ERODE, plane, size)


def closed(plane: NDArray[Any], size: int) -> Plane:
    """Return a plane without dark spots narrower than `size` px, an odd number: dilated, then eroded.

    Examples
    --------
    >>> closed(np.array([[5, 1, 5, 5, 1, 1, 1]]), 3).tolist()
    [[5.0, 5.0, 5.0, 5.0, 1.0, 1.0, 1.0]]
    """
    return _in_window(cv2.MORPH_CLOSE, plane, size)


def opened(plane: NDArray[Any], size: int) -> Plane:
    """Return a plane without light spots narrower than `size` px, an odd number: eroded, then dilated.

    Examples
    --------
    >>> opened(np.array([[1, 5, 1, 1, 5, 5, 5]]), 3).tolist()
    [[1.0, 1.0, 1.0, 1.0, 5.0, 5.0, 5.0]]
    """
    return _in_window(cv2.MORPH_OPEN, plane, size)


def _in_window(way: int, plane: NDArray[Any], size: int) -> Plane:
    given = np.ascontiguousarray(plane, np.float32)
    window = np.ones((size, size), np.uint8)
    return _as_shaped(cv2.morphologyEx(given, way, window, borderType=cv2.BORDER_REFLECT), given)


def distance_from(mask: NDArray[np.bool_]) -> Plane:
    """Return how far each pixel is from the nearest one of a mask, in px; 10⁷ if there is none.

    Examples
    --------
    >>> distance_from(np.array([[True, False, False]])).tolist()
    [[0.0, 1.0, 2.0]]
    """
    if not mask.any():
        return np.full(mask.shape, _FAR, np.float32)
    away = np.zeros(mask.shape, np.float32)
    beyond = ~mask
    if beyond.any():
        part = box_round(beyond, 1)  # the way out of it ends beside it
        given = np.ascontiguousarray(beyond[part]).view(np.uint8)
        away[part] = cv2.distanceTransform(given, cv2.DIST_L2, cv2.DIST_MASK_PRECISE)
    return away


def close_to(mask: NDArray[np.bool_], reach: float) -> NDArray[np.bool_]:
    """Return where a pixel of a mask is less than `reach` px away.

    Examples
    --------
    >>> close_to(np.array([[False, True, False, False]]), 2).tolist()
    [[True, True, True, False]]
    """
    found = np.zeros_like(mask)
    if mask.any():
        part = box_round(mask, int(np.ceil(reach)))
        found[part] = distance_from(mask[part]) < reach
    return found


def box_round(mask: NDArray[np.bool_], around: int) -> tuple[slice, slice]:
    """Return the rows and columns of a mask, not empty, and so many more on each side."""
    rows, columns = (np.flatnonzero(mask.any(axis=axis)).tolist() for axis in (1, 0))
    return (
        slice(max(rows[0] - around, 0), rows[-1] + around + 1),
        slice(max(columns[0] - around, 0), columns[-1] + around + 1),
    )


def at_places(
    planes: NDArray[Any],
    x: NDArray[Any],
    y: NDArray[Any],
    *,
    edge: Literal["repeated", "black"] = "repeated",
) -> Plane:
    """Return what planes, (H, W) or (H, W, k), show between their pixels, linearly.

    Parameters
    ----------
    planes : array
    x, y : (h, w) array
        In px.
    edge : {"repeated", "black"}
        What is beyond their ends.

    Examples
    --------
    >>> ramp = np.array([[0, 1, 2, 3]], np.float32)
    >>> at_places(ramp, np.array([[0.5, 9.0]]), np.zeros((1, 2))).tolist()
    [[0.5, 3.0]]
    """
    given = np.ascontiguousarray(planes, np.float32)
    x, y = (np.ascontiguousarray(one, np.float32) for one in (x, y))
    made = cv2.remap(given, x, y, cv2.INTER_LINEAR, borderMode=_BORDERS[edge], borderValue=0)
    return np.asarray(made, np.float32).reshape(*x.shape, *given.shape[2:])


def spline_at_places(planes: NDArray[Any], x: NDArray[Any], y: NDArray[Any]) -> Plane:
    """Return what a cubic spline through planes, (H, W) or (H, W, k), has between their pixels.

    As SciPy's `map_coordinates` does to 2e-6, in a third of its time: where it lies between four of its
    coefficients, a cubic B-spline is a mean of two places between two of them each [1]_.

    Parameters
    ----------
    planes : array
    x, y : (h, w) array
        In px; beyond the ends, these are repeated.

    References
    ----------
    .. [1] C. Sigg and M. Hadwiger, "Fast third-order texture filtering", GPU Gems 2, 2005.

    Examples
    --------
    >>> squares = np.arange(9.0) ** 2 * np.ones((9, 1))
    >>> round(spline_at_places(squares, np.array([[4.5]]), np.array([[4.0]])).item(), 1)
    20.2
    """
    # Padded, since a spline's coefficients beyond the ends are not those at the ends.
    around = ((_PAD, _PAD), (_PAD, _PAD), *((0, 0),) * (planes.ndim - 2))
    given = np.pad(np.asarray(planes, np.float32), around, mode="edge")
    knots = cv2.sepFilter2D(given, cv2.CV_32F, _TO_SPLINE, _TO_SPLINE, borderType=cv2.BORDER_REFLECT_101)
    knots = _as_shaped(knots, given)
    made = np.empty((*x.shape, *planes.shape[2:]), np.float32)
    for top in range(0, x.shape[0], _TILE):
        for left in range(0, x.shape[1], _TILE):
            tile = np.s_[top : top + _TILE, left : left + _TILE]
            made[tile] = _between_knots(knots, x[tile], y[tile])
    return made


def _between_knots(knots: Plane, x: NDArray[Any], y: NDArray[Any]) -> Plane:
    """Return a spline at a few places: told from a corner near them, they lose nothing as float32."""
    (x0, x1, at_x, columns), (y0, y1, at_y, rows) = (
        _pairs(np.clip(np.asarray(place, np.float64), 2 - _PAD, size - _PAD - 3) + _PAD)
        for place, size in ((x, knots.shape[1]), (y, knots.shape[0]))
    )
    near = knots[rows, columns]  # no copy: where the map shrinks much, it is large

    def show(column: Plane, row: Plane) -> Plane:
        made = cv2.remap(near, column, row, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
        return np.asarray(made, np.float32).reshape(*x.shape, *knots.shape[2:])

    if knots.ndim == 3:
        at_x, at_y = at_x[..., None], at_y[..., None]
    upper, lower = ((left := show(x0, row)) + at_x * (show(x1, row) - left) for row in (y0, y1))
    return np.asarray(upper + at_y * (lower - upper), np.float32)


def _pairs(place: NDArray[np.float64]) -> tuple[Plane, Plane, Plane, slice]:
    """Return the two places between two coefficients each, and the share of the second; within what part."""
    first, last = int(place.min()) - 1, int(place.max()) + 4
    near: Plane = (place - first).astype(np.float32)
    whole: Plane = np.floor(near)
    t: Plane = near - whole
    square = t * t
    fourth = square * t * np.float32(1 / 6)
    second = np.float32(2 / 3) - square + 3 * fourth
    share: Plane = np.float32(1 / 6) + (t + square) / 2 - 2 * fourth  # of the third and the fourth
    before: Plane = np.asarray(whole - 1 + second / (1 - share))
    after: Plane = np.asarray(whole + 1 + fourth / share)
    return before, after, share, slice(first, last)


def _as_shaped(made: Any, given: Plane) -> Plane:
    """Return what OpenCV made in the shape of what it was given: it drops an axis of one plane."""
    return np.asarray(made, np.float32).reshape(given.shape)
