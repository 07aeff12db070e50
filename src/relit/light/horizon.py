"""What a face hides of the light from itself: the horizon seen from each of its points [1]_.

From a point, the rest of the head covers the sky up to some elevation over the image's plane, in each
direction along it. A lamp is seen that stands higher.

References
----------
.. [1] N. L. Max, "Horizon mapping: shadows for bump-mapped surfaces", The Visual Computer 4(2), 1988.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import cv2
import numpy as np

from relit.photo.filters import gaussian

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

# What each of these is worth: docs/leaderboard.md, The constants.
_WAYS = 16  # directions along the image
_STEPS = 20  # looked at on each
_NEAREST, _FARTHEST = 0.06, 1.6  # interocular distances, of the first step and the last
_ROUGH = 0.02  # interocular distances that a surface must be in front to cover anything
_SOFT = 0.15  # rad above and below the horizon, where a lamp is half hidden
_BLUR = 0.04  # interocular distances: a template's edges are its own


def horizons(depth: NDArray[np.floating], solid: NDArray[np.bool_], iod: float) -> NDArray[np.float32]:
    """Return the elevation of the horizon round each pixel.

    Parameters
    ----------
    depth : (H, W) array
        Of the surface in px, growing away from the camera.
    solid : (H, W) bool array
        Where there is a surface; elsewhere nothing is in the way.
    iod : float
        Interocular distance in px.

    Returns
    -------
    (16, H, W) float32 array
        In rad over the image's plane, towards the camera; from the direction of x on, by way of y.

    Examples
    --------
    At the foot of a wall on the right, that side is covered:

    >>> depth = np.where(np.arange(80) < 40, 0.0, -10.0) * np.ones((80, 1))
    >>> seen = horizons(depth, np.ones((80, 80), bool), 20.0)[:, 40, 36]
    >>> bool(seen[0] > 0.8), bool(seen[8] < 0.1)
    (True, True)
    """
    height, width = depth.shape
    reach = int(np.ceil(_FARTHEST * iod))
    blocker = np.pad(np.where(solid, depth, np.inf).astype(np.float32), reach, constant_values=np.inf)
    surface = np.ascontiguousarray(depth - _ROUGH * iod, np.float32)
    planes = np.full((_WAYS, height, width), -np.inf, np.float32)
    rise = np.empty_like(surface)
    ways = 2 * np.pi * np.arange(_WAYS) / _WAYS
    steps = np.geomspace(_NEAREST, _FARTHEST, _STEPS) * iod
    places = np.stack([np.outer(np.sin(ways), steps), np.outer(np.cos(ways), steps)], axis=-1)
    for slope, way in zip(planes, (reach + np.rint(places).astype(int)).tolist(), strict=True):
        for (y, x), nearness in zip(way, (1 / steps).tolist(), strict=True):
            there = blocker[y : y + height, x : x + width]
            cv2.addWeighted(surface, nearness, there, -nearness, 0, rise)
            cv2.max(slope, rise, slope)
        slope[:] = gaussian(np.arctan(slope), _BLUR * iod)
    return planes


def visible(horizon: NDArray[np.floating], directions: NDArray[np.floating]) -> Iterator[NDArray[np.float32]]:
    """Yield the share of each of n lamps that is seen over the horizon.

    Parameters
    ----------
    horizon : (16, ...) array
        As of `horizons`.
    directions : (n, 3) array
        Towards the lamps, ``(x, y, z)``, z growing away from the camera.

    Yields
    ------
    (...) float32 array
        0 to 1; of the next lamp in the same memory.
    """
    x, y, z = directions.T
    way = np.arctan2(y, x) / (2 * np.pi) * _WAYS
    before = np.floor(way).astype(int)
    # (elevation - edge) / (2 soft) + 1/2, the edge being between those of two directions.
    middle = np.arctan2(-z, np.hypot(x, y)) / (2 * _SOFT) + 0.5
    share = (way - before) / (2 * _SOFT)
    lines = horizon.reshape(len(horizon), -1)
    seen = np.empty((lines.shape[1], 1), np.float32)
    columns = (before % _WAYS, (before + 1) % _WAYS, share - 1 / (2 * _SOFT), -share, middle)
    for first, second, of_first, of_second, height in zip(*(one.tolist() for one in columns), strict=True):
        cv2.addWeighted(lines[first], of_first, lines[second], of_second, height, seen)
        yield np.clip(seen, 0, 1, out=seen).reshape(horizon.shape[1:])
