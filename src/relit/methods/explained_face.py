"""One face, explained by the light on it: ``log I = s + p``, plane by plane.

s is the shade of the light that is fitted to the face, p its person: what the light leaves over. Of a target
this is known whatever light is to fall on it, which is why it is remembered.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from scipy.ndimage import gaussian_filter, grey_erosion

from relit.face.shape import FaceShape, face_shape
from relit.light.lambertian import Light, fit_light
from relit.methods.scene import as_planes
from relit.photo.pixels import DARKEST, to_unit
from relit.runtime.memo import remembered
from relit.runtime.threads import available, pool

if TYPE_CHECKING:
    from typing import TypeAlias

    from numpy.typing import NDArray

    from relit.face.landmarks import Landmarks
    from relit.face.regions import FaceRegions

    Plane: TypeAlias = NDArray[np.float64]

# What each of these is worth: docs/leaderboard.md, The constants.
_DARKEST_SHADE = 0.04  # of a light's strongest: what it leaves darker is no base for a ratio
_UNLIT, _LIT = 0.03, 0.3  # brightness, of the light's strength, that says nothing and all of a person
_TILT, _NOISE = 0.15, 2 / 255  # rad, how wrong a normal of the mesh is; brightness, of 1
_SLANTED = 0.5  # sine of the angle from which on a light casts shadows at their deepest
_BRIGHTEST = 0.95  # the share of a face that is darker than the brightest
_BLUR, _WIDE = 0.02, 0.04  # interocular distances
_SHADOW_EDGE = 0.07  # interocular distances that a shadow is widened by: at its edge light and person mix


@dataclass(frozen=True, eq=False)
class Face:
    """One plane of a face, explained by a light.

    Attributes
    ----------
    log : array
        f.
    light : Light
    shade : array
        s, on the shape of this face.
    variance : array
        Of p, for the errors of the shape and the noise of the image.
    inside : array
        Where the face is.
    """

    log: Plane
    light: Light
    shade: Plane
    variance: Plane
    inside: NDArray[np.bool_]

    @cached_property
    def strength(self) -> float:
        """Brightness that the light makes where it meets this face most straightly."""
        return float(np.exp(np.quantile(self.shade[self.inside], _BRIGHTEST)))

    @cached_property
    def person(self) -> Plane:
        """``f - s``."""
        return self.log - self.shade


class Target(NamedTuple):
    """What is known of a target alone, whatever light is to fall on it.

    Attributes
    ----------
    shape : FaceShape
    faces : tuple of Face
        Plane by plane.
    lits : tuple of array
        Where its light reaches.
    mirror : array or None
        As of `_mirror`.
    features : array
        As of `_features`.
    """

    shape: FaceShape
    faces: tuple[Face, ...]
    lits: tuple[Plane, ...]
    mirror: NDArray[np.float64] | None
    features: Plane


@remembered
def explained_target(target: NDArray[Any], face: FaceRegions) -> Target:
    """Explain a target, plane by plane."""
    shape = face_shape(face.landmarks, face.shape)
    with pool(available()) as run:
        faces = run(lambda plane: explained(plane, shape, face), as_planes(to_unit(target)))
        lits = run(lambda one: _lit(one, face), faces)
    return Target(shape, tuple(faces), tuple(lits), _mirror(face.landmarks, shape), _features(face))


def explained(plane: NDArray[Any], shape: FaceShape, face: FaceRegions) -> Face:
    """Fit a light to a plane; σ² of p is that of the mesh's tilt, as the light shows it, and of noise.

    σ² = (τ ∂s/∂tilt)² + (n / I)² + 10⁻⁴, with a normal that is wrong by τ and noise of n.
    """
    iod = face.interocular_distance
    image = np.maximum(plane.astype(np.float64), DARKEST)
    light = fit_light(gaussian_filter(image, _BLUR * iod), shape.normals, face.inside)
    steepness = gaussian_filter(light.sensitivity(shape.normals) ** 2, _BLUR * iod)
    noise = _NOISE / np.maximum(gaussian_filter(image, _WIDE * iod), _NOISE)
    variance = _TILT**2 * steepness + noise**2 + 1e-4
    return Face(np.log(image), light, np.log(shade_on(light, shape)), variance, face.inside)


def all_light(plane: NDArray[Any], face: FaceRegions) -> Face:
    """Return what was rendered: nobody, in its light."""
    log = np.log(np.maximum(plane.astype(np.float64), _DARKEST_SHADE))
    return Face(log, Light(np.zeros(3), 1.0), log, np.zeros_like(log), face.inside)


def shade_on(light: Light, shape: FaceShape) -> Plane:
    """Return the brightness that a light makes on a face, and nowhere too little to divide by."""
    shade = light.on(shape.normals)
    return np.asarray(np.maximum(shade, max(_DARKEST_SHADE * float(shade.max()), DARKEST)))


def _lit(target: Face, face: FaceRegions) -> Plane:
    """Return where a face's own light reaches: 0 to 1, and less at a shadow's edge than within the light."""
    iod = face.interocular_distance
    size = max(1, round(_SHADOW_EDGE * iod))
    seen = gaussian_filter(np.exp(target.log), _WIDE * iod) / target.strength
    seen = gaussian_filter(grey_erosion(seen, (size, size)), size / 3)
    share = np.clip((seen - _UNLIT) / (_LIT - _UNLIT), 0, 1)
    dark = 1 - share**2 * (3 - 2 * share)
    # A light at the camera casts no shadow that the camera sees: what is dark then is dark hair.
    return np.asarray(1 - dark * min(target.light.slant / _SLANTED, 1) ** 4)


def _features(face: FaceRegions) -> Plane:
    """Return where brows, eyes and mouth are, a little larger, with soft edges."""
    blur = _BLUR * face.interocular_distance
    larger = np.minimum(4 * gaussian_filter(face.features.astype(np.float64), blur), 1)
    return np.asarray(gaussian_filter(larger, blur))


def _mirror(landmarks: Landmarks, shape: FaceShape) -> NDArray[np.float64] | None:
    """Return where, ``(y, x)``, the same place of the other half of the face is seen, if eyes tell.

    The face's plane of symmetry is that between the eyes in space: ``x ↦ x - 2 ((x - m)·a) a``.
    """
    eyes = landmarks.eyes
    if eyes is None:
        return None
    right, left = np.pad(eyes, ((0, 0), (0, 3 - eyes.shape[1])))
    across = (left - right) / np.linalg.norm(left - right)
    y, x = np.indices(shape.depth.shape)
    place = np.stack([x, y, shape.depth], axis=-1)
    there = place - 2 * ((place - (left + right) / 2) @ across)[..., None] * across
    return np.stack([there[..., 1], there[..., 0]])
