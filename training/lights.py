"""Lamps round a head, and lights made of them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

LAMPS = 96
_BEHIND = 0.35  # z of the lamp that is farthest behind the head
_HOW_MANY = (0.5, 0.3, 0.2)  # how often a light has one lamp, two, three
_AZIMUTH, _HEIGHT = (0, 55), (20, 28)  # degrees, mean and standard deviation
_LOBE, _FILL = (0.015, 0.4), (0.05, 1.5)  # how wide a lamp is, and how much comes from everywhere


def lamps() -> NDArray[np.float64]:
    """Return directions to the lamps, even over the camera's side of the head and a little behind.

    Returns
    -------
    (LAMPS, 3) array
        Unit vectors, x right, y down, z away from the camera.
    """
    k = np.arange(LAMPS)
    z = -1 + (1 + _BEHIND) * (k + 0.5) / LAMPS
    angle = k * np.pi * (3 - np.sqrt(5))
    return np.column_stack([np.sqrt(1 - z**2) * np.cos(angle), np.sqrt(1 - z**2) * np.sin(angle), z])


def a_light(random: np.random.Generator) -> NDArray[np.float64]:
    """Return a light, (LAMPS,): one to three lamps, small or large, and a little from everywhere.

    Examples
    --------
    >>> a_light(np.random.default_rng(0)).shape
    (96,)
    """
    directions, light = lamps(), np.zeros(LAMPS)
    for strength in random.uniform(0.2, 1, 1 + random.choice(len(_HOW_MANY), p=_HOW_MANY)):
        azimuth, height = np.radians(random.normal(*_AZIMUTH)), np.radians(random.normal(*_HEIGHT))
        to = [np.sin(azimuth) * np.cos(height), -np.sin(height), -np.cos(azimuth) * np.cos(height)]
        lobe = np.exp((directions @ to - 1) / _log_uniform(random, _LOBE))
        light += strength * lobe / lobe.sum()
    return np.asarray(light / light.sum() + _log_uniform(random, _FILL) / LAMPS)


def _log_uniform(random: np.random.Generator, between: tuple[float, float]) -> float:
    return float(np.exp(random.uniform(*np.log(between))))
