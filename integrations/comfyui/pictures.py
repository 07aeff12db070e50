"""Pictures of a light: a panorama at another size, and a white ball in it."""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

_ROWS = 16  # of the panorama, for the ball: what is matt blurs a light by 60° and more


def enlarged(panorama: NDArray[Any], height: int) -> NDArray[np.float32]:
    """Return a panorama so many px high; its left and right edge stay one."""
    round_it = np.concatenate([panorama, panorama[:, :1]], axis=1).astype(np.float32)
    width = 2 * height
    x, y = np.meshgrid(
        (np.arange(width) + 0.5) * panorama.shape[1] / width - 0.5,
        (np.arange(height) + 0.5) * panorama.shape[0] / height - 0.5,
    )
    maps = (np.mod(x, panorama.shape[1]).astype(np.float32), y.astype(np.float32))
    made = cv2.remap(round_it, *maps, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    return np.asarray(np.clip(made, 0, 1), np.float32)


def ball(panorama: NDArray[Any], height: int) -> NDArray[np.float32]:
    """Return a white, matt ball in a light, linear, black round it; the brightest of it is 1.

    The brightness of a pixel with the normal n is ``Σ L(ω) max(n·ω, 0) dω`` over the panorama.
    """
    light = cv2.resize(np.asarray(panorama, np.float32), (2 * _ROWS, _ROWS), interpolation=cv2.INTER_AREA)
    elevation = np.pi / 2 - np.pi * (np.arange(_ROWS)[:, None] + 0.5) / _ROWS
    azimuth = np.pi * (np.arange(2 * _ROWS)[None] + 0.5) / _ROWS - np.pi
    level = np.cos(elevation)
    there = np.stack(
        np.broadcast_arrays(level * np.sin(azimuth), np.sin(elevation), level * np.cos(azimuth)), axis=-1
    ).reshape(-1, 3)
    weights = (light * level[..., None]).reshape(-1, 3)
    x, y = _places(height)
    inside = x**2 + y**2 < 1
    normals = np.stack([x[inside], y[inside], np.sqrt(1 - x[inside] ** 2 - y[inside] ** 2)], axis=1)
    shown = np.zeros((height, height, 3), np.float32)
    shown[inside] = np.maximum(normals @ there.T, 0) @ weights
    return np.asarray(shown / max(float(shown.max()), 1e-9), np.float32)


def disc(height: int) -> NDArray[np.float32]:
    """Return where the ball is."""
    x, y = _places(height)
    return (x**2 + y**2 < 1).astype(np.float32)


def _places(height: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return how far right and up each pixel is of the ball's middle, in its radii."""
    along = (np.arange(height) + 0.5) * 2 / height - 1
    x, y = np.meshgrid(along, -along)
    return x, y
