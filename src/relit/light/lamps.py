"""Lights that a person sets: by name or place, tilted, turned, filled, softened; and the picture of a light.

A picture of a light is in latitude and longitude, as panoramas are: the middle is where the camera stands,
left and right are those of the photo, and the upper edge is straight above.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from relit.light.dome import DOME, Lamps
from relit.photo.color import luma

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from relit.settings.studio_lights import StudioLight

# What each of these is worth: docs/leaderboard.md, The constants.
_RING = 8  # rays towards the rim of a lamp, and as many halfway there
_SPREAD = 60.0  # degrees that a lamp is spread over, as a standard deviation, by a softness of 1
_SHARPEST = 0.1  # degrees that a lamp is spread over at least
_GLOW = 14.0  # the same in the picture of a light: half of how far apart the dome's lamps are


def studio_lamps(light: StudioLight) -> Lamps:
    """Return lamps where a portraitist's stand, and a little light from everywhere.

    What looks into the lamp that most falls on has the brightness 1; with all lamps off, the fill is left.

    Examples
    --------
    >>> from relit.settings.studio_lights import studio_light
    >>> lamps = studio_lamps(studio_light("-90,0"))
    >>> bool((lamps.directions[0] == [-1, 0, 0]).all() or abs(lamps.directions[0][0] + 1) < 1e-9)
    True
    """
    rays = [_disc(middle, lamp.size) for middle, lamp in zip(directions_of(light), light.lamps, strict=True)]
    counts = [len(some) for some in rays]
    even = light.fill / np.maximum(-DOME[:, 2], 0).sum()
    strength = (1 - light.fill) * strengths(light)
    weights = np.append(np.repeat(strength / counts, counts), np.full(len(DOME), even))
    lamps = Lamps(np.vstack([*rays, DOME]), weights)
    if not light.colored:
        return lamps
    filters = np.vstack([np.repeat([lamp.color for lamp in light.lamps], counts, axis=0), np.ones_like(DOME)])
    return _behind(lamps, filters)


def studio_points(light: StudioLight) -> Lamps:
    """Return the lamps of a portraitist's light, each as one direction, without what fills their shadows."""
    lamps = Lamps(directions_of(light), np.array([lamp.power for lamp in light.lamps], float))
    return _behind(lamps, np.array([lamp.color for lamp in light.lamps])) if light.colored else lamps


def directions_of(light: StudioLight) -> NDArray[np.float64]:
    """Return the unit vectors towards lamps, (n, 3), ``(x, y, z)`` with z growing away from the camera."""
    azimuth, elevation = np.radians([[lamp.azimuth, lamp.elevation] for lamp in light.lamps]).T
    level = np.cos(elevation)
    return np.stack([np.sin(azimuth) * level, -np.sin(elevation), -np.cos(azimuth) * level], axis=1)


def strengths(light: StudioLight) -> NDArray[np.float64]:
    """Return what each lamp does to what looks into it, (n,): the most that one gets of all of them is 1.

    Examples
    --------
    >>> from relit.settings.studio_lights import studio_light
    >>> strengths(studio_light("-90,0+90,0:power=0.5")).tolist(), strengths(studio_light("0,0+0,0")).tolist()
    ([1.0, 0.5], [0.5, 0.5])
    """
    there, powers = directions_of(light), np.array([lamp.power for lamp in light.lamps], float)
    facing = np.maximum(there @ there.T, 0)
    np.fill_diagonal(facing, 1)
    most = float((facing @ powers)[powers > 0].max(initial=0))
    return powers / (most or 1)


def moved(light: StudioLight, tilt: float, turn: float) -> StudioLight:
    """Return a portraitist's light with its lamps carried upwards over the head, and then round it.

    Examples
    --------
    >>> from relit.settings.studio_lights import studio_light
    >>> lamp = moved(studio_light("0,0"), 30, 50).lamps[0]
    >>> lamp.azimuth, round(lamp.elevation, 6)
    (50.0, 30.0)
    """
    if tilt:
        places = zip(light.lamps, *angles_of(tilted(studio_points(light), tilt).directions), strict=True)
        light = light._replace(lamps=tuple(lamp._replace(azimuth=a, elevation=e) for lamp, a, e in places))
    return light._replace(lamps=tuple(lamp._replace(azimuth=lamp.azimuth + turn) for lamp in light.lamps))


def angles_of(directions: NDArray[np.float64]) -> tuple[list[float], list[float]]:
    """Return the azimuths and the elevations of directions, in degrees; the inverse of `directions_of`."""
    x, y, z = directions.T
    return np.degrees(np.arctan2(x, -z)).tolist(), np.degrees(np.arcsin(np.clip(-y, -1, 1))).tolist()


def filled(lamps: Lamps, share: float) -> Lamps:
    """Return lamps of which even light has replaced a share; what faces the camera is as bright as before.

    Examples
    --------
    >>> half = filled(Lamps(np.array([[0.0, 0.0, -1.0]]), np.ones(1)), 0.5)
    >>> float(half.weights[0]), round(float(np.maximum(-half.directions[:, 2], 0) @ half.weights), 6)
    (0.5, 1.0)
    """
    front = np.maximum(-DOME[:, 2], 0)
    facing = np.maximum(-lamps.directions[:, 2], 0) / front.sum()

    def both(of: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.concatenate([(1 - share) * of, np.repeat([share * (facing @ of)], len(DOME), axis=0)])

    colors = None if lamps.colors is None else both(lamps.colors)
    return Lamps(np.vstack([lamps.directions, DOME]), both(lamps.weights), colors)


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


def tilted(lamps: Lamps, degrees: float) -> Lamps:
    """Return lamps carried over the head, from the front upwards: round the axis from ear to ear.

    Examples
    --------
    >>> lamps = Lamps(np.array([[0.0, 0.0, -1.0]]), np.ones(1))
    >>> (tilted(lamps, 90).directions.round(6) + 0.0).tolist()
    [[0.0, -1.0, 0.0]]
    """
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return rotated(lamps, np.array([[1, 0, 0], [0, c, -s], [0, s, c]]))


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


def _behind(lamps: Lamps, filters: NDArray[np.float64]) -> Lamps:
    """Return white lamps behind coloured filters, (n, 3)."""
    return Lamps(lamps.directions, lamps.weights * luma(filters), lamps.weights[:, None] * filters)


def _disc(middle: NDArray[np.float64], radius: float) -> NDArray[np.float64]:
    """Return directions spread over a lamp whose rim is so many degrees from its middle."""
    side = np.cross(middle, [0.0, 1.0, 0.0] if abs(middle[1]) < 0.9 else [1.0, 0.0, 0.0])
    side /= np.linalg.norm(side)
    over = np.cross(middle, side)
    around = 2 * np.pi * np.arange(_RING) / _RING
    ring = np.outer(np.cos(around), side) + np.outer(np.sin(around), over)
    rays = np.vstack([middle, *(middle + np.tan(np.radians(part * radius)) * ring for part in (0.5, 1))])
    return np.asarray(rays / np.linalg.norm(rays, axis=1, keepdims=True))
