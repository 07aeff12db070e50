"""Lights that a person sets: by name or place, turned, softened; and the picture of a light.

A picture of a light is in latitude and longitude, as panoramas are: the middle is where the camera stands,
left and right are those of the photo, and the upper edge is straight above.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from relit.light.dome import DOME, Lamps

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from relit.settings.studio_lights import StudioLight

# What each of these is worth: docs/leaderboard.md, The constants.
_RING = 8  # rays towards the rim of a lamp, and as many halfway there
_SPREAD = 60.0  # degrees that a lamp is spread over, as a standard deviation, by a softness of 1
_SHARPEST = 0.1  # degrees that a lamp is spread over at least
_GLOW = 14.0  # the same in the picture of a light: half of how far apart the dome's lamps are


def studio_lamps(light: StudioLight) -> Lamps:
    """Return a lamp where a portraitist's stands, and a little light from everywhere.

    Examples
    --------
    >>> from relit.settings.studio_lights import studio_light
    >>> lamps = studio_lamps(studio_light("-90,0"))
    >>> bool((lamps.directions[0] == [-1, 0, 0]).all() or abs(lamps.directions[0][0] + 1) < 1e-9)
    True
    """
    rays = _disc(light.azimuth, light.elevation, light.softness)
    even = light.ambient / np.maximum(-DOME[:, 2], 0).sum()
    weights = np.append(np.full(len(rays), (1 - light.ambient) / len(rays)), np.full(len(DOME), even))
    return Lamps(np.vstack([rays, DOME]), weights)


def rotated(lamps: Lamps, rotation: NDArray[np.float64]) -> Lamps:
    """Return lamps after a rotation of space, (3, 3): each direction d becomes ``d @ rotation``.

    Examples
    --------
    >>> lamps = Lamps(np.array([[0.0, 0.0, -1.0]]), np.ones(1))
    >>> rotated(lamps, np.array([[0.0, 1, 0], [0, 0, -1], [-1, 0, 0]])).directions.tolist()
    [[1.0, 0.0, 0.0]]
    """
    if (rotation == np.eye(3)).all():
        return lamps  # the same directions, of which a `Surface` keeps what each does
    return lamps._replace(directions=lamps.directions @ rotation + 0.0)


def turned(lamps: Lamps, degrees: float) -> Lamps:
    """Return lamps carried round the head, a positive angle to the right of the picture at its front.

    Examples
    --------
    >>> lamps = Lamps(np.array([[0.0, 0.0, -1.0]]), np.ones(1))
    >>> (turned(lamps, 90).directions.round(6) + 0.0).tolist()
    [[1.0, 0.0, 0.0]]
    """
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return rotated(lamps, np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]]))


def softened(lamps: Lamps, softness: float) -> Lamps:
    """Return lamps spread over the dome: 0 as they are, 1 as wide as a cloudy sky.

    Parameters
    ----------
    lamps : Lamps
    softness : float
        0 to 1.

    Examples
    --------
    >>> lamp = Lamps(np.array([[-1.0, 0.0, 0.0]]), np.ones(1))
    >>> soft = softened(lamp, 0.5)
    >>> len(soft.weights), round(float(soft.weights.sum()), 6), bool(soft.weights @ DOME[:, 0] < 0)
    (100, 1.0, True)
    """
    if softness == 0:
        return lamps
    near = DOME @ lamps.directions.T
    # Of the nearest of the dome, which some lamps stand far from, there is always some.
    spread = np.exp((near - near.max(axis=0)) / np.radians(max(softness * _SPREAD, _SHARPEST)) ** 2)
    spread /= spread.sum(axis=0)
    colors = None if lamps.colors is None else spread @ lamps.colors
    return Lamps(DOME, spread @ lamps.weights, colors)


def panorama(lamps: Lamps, height: int = 64) -> NDArray[np.float32]:
    """Return the picture of a light, in latitude and longitude.

    Parameters
    ----------
    lamps : Lamps
    height : int
        In px; it is twice as wide.

    Returns
    -------
    (height, 2 height, 3) float32 array
        Linear; what is brightest is 1.

    Examples
    --------
    >>> left = panorama(Lamps(np.array([[-1.0, 0.0, 0.0]]), np.ones(1)), 16)
    >>> np.unravel_index(left[..., 0].argmax(), (16, 32))[1] in (7, 8)
    True
    """
    elevation = np.pi / 2 - np.pi * (np.arange(height) + 0.5) / height
    azimuth = np.pi * (np.arange(2 * height) + 0.5) / height - np.pi
    level, upward = np.cos(elevation)[:, None], np.sin(elevation)[:, None]
    there = np.stack(
        np.broadcast_arrays(level * np.sin(azimuth), -upward, -level * np.cos(azimuth)), axis=-1
    ).reshape(-1, 3)
    colors = lamps.colors if lamps.colors is not None else np.repeat(lamps.weights[:, None], 3, axis=1)
    light = _lobes(there, lamps.directions, _GLOW) @ colors
    return np.asarray(light / max(float(light.max()), 1e-9), np.float32).reshape(height, 2 * height, 3)


def _lobes(there: NDArray[np.float64], lamps: NDArray[np.float64], degrees: float) -> NDArray[np.float64]:
    """Return how much of each lamp comes from each direction, spread over so many degrees [1]_.

    References
    ----------
    .. [1] R. A. Fisher, "Dispersion on a sphere", Proc. R. Soc. A 217, 1953.
    """
    return np.asarray(np.exp((there @ lamps.T - 1) / np.radians(degrees) ** 2))


def _disc(azimuth: float, elevation: float, radius: float) -> NDArray[np.float64]:
    """Return directions spread over a lamp whose rim is so many degrees from its middle."""
    a, e = np.radians([azimuth, elevation])
    middle = np.array([np.sin(a) * np.cos(e), -np.sin(e), -np.cos(a) * np.cos(e)])
    side = np.cross(middle, [0.0, 1.0, 0.0] if abs(middle[1]) < 0.9 else [1.0, 0.0, 0.0])
    side /= np.linalg.norm(side)
    over = np.cross(middle, side)
    around = 2 * np.pi * np.arange(_RING) / _RING
    ring = np.outer(np.cos(around), side) + np.outer(np.sin(around), over)
    rays = np.vstack([middle, *(middle + np.tan(np.radians(part * radius)) * ring for part in (0.5, 1))])
    return np.asarray(rays / np.linalg.norm(rays, axis=1, keepdims=True))
