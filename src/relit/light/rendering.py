"""Lights that need no reference: a face of one albedo, rendered on the target's own shape.

What is rendered then serves as the reference: the method finds all the light in it that it would find in a
photo, cast shadows included, and no person.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from relit.face.shape import face_shape
from relit.light.lamps import directions_of, strengths
from relit.photo.channels import within
from relit.photo.filters import gaussian
from relit.photo.pixels import GAMMA, to_unit
from relit.photo.ranks import median
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
    photo : (H, W) or (H, W, 3) array
        What the face is in: in coloured light it is drawn with its skin's own colour, or a method that cannot
        tell a light from a skin would take a white one over.
    """

    face: FaceRegions
    light: StudioLight
    photo: NDArray[Any]

    @cached_property
    def warped(self) -> NDArray[np.float32]:
        """As of `render`."""
        face = self.face
        drawn = render(face_shape(face.landmarks, face.shape), self.light, face.interocular_distance)
        if drawn.ndim == 2 or self.photo.ndim == 2 or not face.skin_area.any():
            return drawn
        skin = median(within(to_unit(self.photo), face.skin_area))
        return np.asarray(drawn * (skin / skin.max()), np.float32)


def render(shape: FaceShape, light: StudioLight, iod: float) -> NDArray[np.float32]:
    """Return a matt white face in a light, encoded as photos are: in [0, 1], (H, W), or (H, W, 3) in colours.

    `iod` is the interocular distance in px. Beyond the face, it is as at its rim.
    """
    # A mesh is coarser than a face: what it makes sharp is its own.
    sigma = _COARSE * iod
    normals = np.moveaxis(gaussian(shape.normals, sigma, edge="repeated"), -1, 0)
    normals = normals / np.linalg.norm(normals, axis=0)
    lit: NDArray[np.float32] | float = 0.0
    for lamp, there, strength in zip(
        light.lamps, directions_of(light), strengths(light).tolist(), strict=True
    ):
        straight = np.maximum(np.tensordot(there.astype(np.float32), normals, 1), 0)
        made = (1 - light.fill) * strength * straight * _visible(shape, there, lamp.size, iod)
        lit = lit + (made[..., None] * np.array(lamp.color, np.float32) if light.colored else made)
    lit = np.asarray(lit + light.fill, np.float32)
    if len(light.lamps) > 1:  # between two lamps it is brighter than before either
        lit = lit / max(float(lit.max()), 1)
    return np.asarray(np.clip(lit, 0, 1) ** (1 / GAMMA), np.float32)


def _visible(
    shape: FaceShape, direction: NDArray[np.float64], size: float, iod: float
) -> NDArray[np.float32]:
    """Return the share of a lamp that each pixel of the face sees past the rest of the face.

    `direction` is that towards its middle, `size` is in degrees from there to its rim.
    """
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
    rays = _rays(direction, size)
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


def _rays(direction: NDArray[np.float64], size: float) -> NDArray[np.float64]:
    """Return directions to the middle of the lamp and to points of its rim."""
    side = np.cross(direction, [0.0, 1.0, 0.0] if abs(direction[1]) < 0.9 else [1.0, 0.0, 0.0])
    side /= np.linalg.norm(side)
    over = np.cross(direction, side)
    around = np.linspace(0, 2 * np.pi, _RIM, endpoint=False)[:, None]
    rim = direction + np.tan(np.radians(size)) * (np.cos(around) * side + np.sin(around) * over)
    rays = np.vstack([direction, rim])
    return np.asarray(rays / np.linalg.norm(rays, axis=1, keepdims=True))
