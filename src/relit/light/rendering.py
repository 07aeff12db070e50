"""Lights that need no reference: a face of one albedo, rendered on the target's own shape.

What is rendered then serves as the reference: the method finds all the light in it that it would find in a
photo, cast shadows included, and no person.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from relit.face.shape import face_shape
from relit.photo.filters import gaussian
from relit.photo.pixels import GAMMA
from relit.photo.resampling import Enlarger, reduced

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from relit.face.regions import FaceRegions
    from relit.face.shape import FaceShape
    from relit.settings.studio_lights import StudioLight

# What each of these is worth: docs/leaderboard.md, The constants.
_COARSE = 0.04  # interocular distances that normals are smoothed over
_STEPS = 48  # along a ray
_FARTHEST = 1.6  # interocular distances that a shadow falls over
_ROUGH = 0.02  # interocular distances that a surface must be in front to cast a shadow
_SOFT = 10.0  # degrees from the middle of the lamp to its rim: a softbox
_RIM = 6  # rays towards it
_MARCHED = 40.0  # px between the eyes where rays are marched: shadows are soft
_PENUMBRA = 0.05  # interocular distances that the steps between the rays' shadows are blurred over


@dataclass(frozen=True, eq=False)
class Rendered:
    """A face of one albedo in a light by name: nobody's reference, drawn when it is first asked for.

    Attributes
    ----------
    face : FaceRegions
        Where it is.
    light : StudioLight
    """

    face: FaceRegions
    light: StudioLight

    @cached_property
    def warped(self) -> NDArray[np.float32]:
        """As of `render`."""
        face = self.face
        return render(face_shape(face.landmarks, face.shape), self.light, face.interocular_distance)


def render(shape: FaceShape, light: StudioLight, iod: float) -> NDArray[np.float32]:
    """Return a matt white face in a light, encoded as photos are: (H, W) in [0, 1].

    `iod` is the interocular distance in px. Beyond the face, it is as at its rim.
    """
    # A mesh is coarser than a face: what it makes sharp is its own.
    sigma = _COARSE * iod
    normals = np.moveaxis(gaussian(shape.normals, sigma, edge="repeated"), -1, 0)
    normals = normals / np.linalg.norm(normals, axis=0)
    straight = np.maximum(np.tensordot(_direction(light).astype(np.float32), normals, 1), 0)
    lit = (1 - light.ambient) * straight * _visible(shape, light, iod) + light.ambient
    return np.asarray(np.clip(lit, 0, 1) ** (1 / GAMMA), np.float32)


def _visible(shape: FaceShape, light: StudioLight, iod: float) -> NDArray[np.float32]:
    """Return the share of the lamp that each pixel of the face sees past the rest of the face."""
    factor = max(int(iod / _MARCHED), 1)
    iod = iod / factor
    depth = reduced(shape.depth, factor).astype(np.float64) / factor
    inside = reduced(shape.inside.astype(np.float32), factor) > 0.5
    seen = np.ones(depth.shape)
    rows, columns = (np.flatnonzero(inside.any(axis=axis)) for axis in (1, 0))
    box = tuple(slice(line[0], line[-1] + 1) if len(line) else slice(0) for line in (rows, columns))
    surface = depth[box] - _ROUGH * iod
    height, width = surface.shape
    reach = int(np.ceil(_FARTHEST * iod)) + 1
    # What is beyond the face is not known to block anything.
    blockers = np.pad(np.where(inside, depth, np.inf)[box], reach, constant_values=np.inf)
    share = np.zeros(surface.shape)
    rays = _rays(_direction(light))
    for ray in rays:
        free = np.ones(surface.shape, bool)
        for step in (np.linspace(0.03, _FARTHEST, _STEPS) * iod).tolist():
            x, y, rise = (step * ray).tolist()
            row, column = reach + math.floor(y + 0.5), reach + math.floor(x + 0.5)
            free &= blockers[row : row + height, column : column + width] >= surface + rise
        share += free / len(rays)
    seen[box][inside[box]] = share[inside[box]]
    soft = gaussian(seen, _PENUMBRA * iod)
    return Enlarger(soft, factor, shape.inside.shape).rows(0, shape.inside.shape[0])


def _direction(light: StudioLight) -> NDArray[np.float64]:
    """Return the unit vector towards the lamp, ``(x, y, z)`` with z growing away from the camera."""
    azimuth, elevation = np.radians([light.azimuth, light.elevation])
    return np.array(
        [np.sin(azimuth) * np.cos(elevation), -np.sin(elevation), -np.cos(azimuth) * np.cos(elevation)]
    )


def _rays(direction: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return directions to the middle of the lamp and to points of its rim."""
    side = np.cross(direction, [0.0, 1.0, 0.0] if abs(direction[1]) < 0.9 else [1.0, 0.0, 0.0])
    side /= np.linalg.norm(side)
    over = np.cross(direction, side)
    around = np.linspace(0, 2 * np.pi, _RIM, endpoint=False)[:, None]
    rim = direction + np.tan(np.radians(_SOFT)) * (np.cos(around) * side + np.sin(around) * over)
    rays = np.vstack([direction, rim])
    return np.asarray(rays / np.linalg.norm(rays, axis=1, keepdims=True))
