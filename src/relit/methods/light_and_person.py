"""Two faces, one laid over the other, each explained by the light on it, as `methods.shading` takes them.

All that can be said before λ and the user's wishes come in: which is why it is remembered.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from scipy.ndimage import gaussian_filter, grey_erosion, map_coordinates

from relit.face.regions import drawn, feature_hulls
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

    Plane: TypeAlias = NDArray[np.float64]

_DARKEST_SHADE = 0.04  # of a light's strongest: what it leaves darker is no base for a ratio
_TILT = 0.15  # rad: how wrong a normal of the mesh is
_PERSON = 0.35  # in log I: how different two people are
_HALVES = 0.4  # and the two halves of one
_NOISE = 2 / 255
_UNLIT, _LIT = 0.03, 0.3  # brightness, of the light's strength, that says nothing and all of a person
_SLANTED = 0.5  # sine of the angle from which on a light casts shadows at their deepest
_FEATURES = ("brows", "eyes", "mouth")  # where two persons differ most
_BRIGHTEST = 0.95  # the share of a face that is darker than the brightest
_BLUR, _WIDE = 0.02, 0.04  # interocular distances


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


class Faces(NamedTuple):
    """Two faces, plane by plane, and all that is said of them before there is a λ.

    Attributes
    ----------
    shape : FaceShape
        The target's.
    targets, references : list of Face
    colored : bool
        Whether a grey target takes on the colours of the reference.
    lits, persons, stand_ins : list of array
        Where the target's light reaches, p, and the reference's p as bright as it.
    features : array
        As of `_features`.
    """

    shape: FaceShape
    targets: list[Face]
    references: list[Face]
    colored: bool
    lits: list[Plane]
    persons: list[Plane]
    stand_ins: list[Plane]
    features: Plane


@remembered
def explained_faces(
    target: NDArray[Any],
    reference: NDArray[Any],
    landmarks: Landmarks,
    reference_landmarks: Landmarks,
    *,
    rendered: bool,
) -> Faces:
    """Explain two faces, plane by plane.

    Parameters
    ----------
    target, reference : (H, W) or (H, W, 3) array
        The latter laid over the former.
    landmarks, reference_landmarks : Landmarks
        Of the target, and of the reference in its own photo.
    rendered : bool
        Whether the reference is nobody's face.

    Returns
    -------
    Faces
    """
    unit = landmarks.interocular_distance
    ours, found, lit, mirror, features = explained_target(target, landmarks)
    theirs = ours if rendered else face_shape(landmarks, target.shape, of=reference_landmarks)
    with pool(available()) as run:
        references = run(
            lambda plane: _all_light(plane, ours) if rendered else _explained(plane, theirs, unit),
            as_planes(to_unit(reference)),
        )
        colored = len(references) > len(found)
        copies = len(references) // len(found)
        targets, lits = copies * list(found), copies * list(lit)
        both = run(
            lambda k: _person(targets[k], references[k], lits[k], ours.inside, mirror), range(len(targets))
        )
    persons, stand_ins = (list(planes) for planes in zip(*both, strict=True))
    return Faces(ours, targets, references, colored, lits, persons, stand_ins, features)


class Target(NamedTuple):
    """What is said of a target alone, whatever light is to fall on it.

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
def explained_target(target: NDArray[Any], landmarks: Landmarks) -> Target:
    """Explain a target, plane by plane."""
    unit, shape = landmarks.interocular_distance, face_shape(landmarks, target.shape)
    with pool(available()) as run:
        faces = run(lambda plane: _explained(plane, shape, unit), as_planes(to_unit(target)))
        lits = run(lambda face: _lit(face, unit), faces)
    features = _features(landmarks, target.shape, unit)
    return Target(shape, tuple(faces), tuple(lits), _mirror(landmarks, shape), features)


def _explained(plane: NDArray[Any], shape: FaceShape, unit: float) -> Face:
    image = np.maximum(plane.astype(np.float64), DARKEST)
    smooth = gaussian_filter(image, _BLUR * unit)
    light = fit_light(smooth, shape.normals, shape.inside)
    wrong = gaussian_filter(light.sensitivity(shape.normals) ** 2, _BLUR * unit)
    noise = _NOISE / np.maximum(gaussian_filter(image, _WIDE * unit), _NOISE)
    return Face(
        np.log(image), light, np.log(shade_on(light, shape)), _TILT**2 * wrong + noise**2 + 1e-4, shape.inside
    )


def _all_light(plane: NDArray[Any], shape: FaceShape) -> Face:
    """Return what was rendered: nobody, in its light."""
    log = np.log(np.maximum(plane.astype(np.float64), _DARKEST_SHADE))
    return Face(log, Light(np.zeros(3), 1.0), log, np.zeros_like(log), shape.inside)


def shade_on(light: Light, shape: FaceShape) -> Plane:
    """Return the brightness that a light makes on a face, and nowhere too little to divide by."""
    shade = light.on(shape.normals)
    return np.asarray(np.maximum(shade, max(_DARKEST_SHADE * float(shade.max()), DARKEST)))


def _lit(face: Face, unit: float) -> Plane:
    """Return where a face's own light reaches: 0 to 1, and less at a shadow's edge than within the light."""
    size = max(1, round(0.07 * unit))
    seen = gaussian_filter(np.exp(face.log), _WIDE * unit) / face.strength
    seen = gaussian_filter(grey_erosion(seen, (size, size)), size / 3)
    share = np.clip((seen - _UNLIT) / (_LIT - _UNLIT), 0, 1)
    dark = 1 - share**2 * (3 - 2 * share)
    # A light at the camera casts no shadow that the camera sees: what is dark then is dark hair.
    return np.asarray(1 - dark * min(face.light.slant / _SLANTED, 1) ** 4)


def _person(
    target: Face, reference: Face, lit: Plane, inside: NDArray[np.bool_], mirror: NDArray[np.float64] | None
) -> tuple[Plane, Plane]:
    """Return p, and the reference's p as bright as it."""
    own = lit / target.variance
    other = 1 / (_PERSON**2 + reference.variance)
    weight = own * inside
    difference = (weight * (target.person - reference.person)).sum() / max(weight.sum(), 1e-9)
    stand_in = reference.person + difference
    total, weights = own * target.person + other * stand_in, own + other
    if mirror is None:
        return total / weights, stand_in

    def mirrored(plane: Plane) -> Plane:
        return np.asarray(map_coordinates(plane, mirror, order=1, mode="nearest"))

    half = (1 - lit) * mirrored(lit) / (mirrored(target.variance) + _HALVES**2)
    return (total + half * mirrored(target.person)) / (weights + half), stand_in


def _features(landmarks: Landmarks, shape: tuple[int, ...], unit: float) -> Plane:
    """Return where brows, eyes and mouth are, a little larger, with soft edges."""
    hulls = drawn(feature_hulls(landmarks, _FEATURES), shape)
    larger = np.minimum(4 * gaussian_filter(hulls.astype(np.float64), _BLUR * unit), 1)
    return np.asarray(gaussian_filter(larger, _BLUR * unit))


def _mirror(landmarks: Landmarks, shape: FaceShape) -> NDArray[np.float64] | None:
    """Return where, ``(y, x)``, the same place of the other half of the face is seen, if eyes tell."""
    eyes = landmarks.eyes
    if eyes is None:
        return None
    right, left = np.pad(eyes, ((0, 0), (0, 3 - eyes.shape[1])))
    across = (left - right) / np.linalg.norm(left - right)
    y, x = np.indices(shape.depth.shape)
    place = np.stack([x, y, shape.depth], axis=-1)
    there = place - 2 * ((place - (left + right) / 2) @ across)[..., None] * across
    return np.stack([there[..., 1], there[..., 0]])
