"""relit's own method: a simple light explains most of a face, the reference's residual the rest of its light.

With f = log I, a face is ``f = s + p``: s the shading of the light that is fitted to it, p the person. The
relit face is ``exp(s' + p + k r)``:

1. s' is the shading that the reference's light makes on the target's shape.
2. p is the target's, where its own light reaches. Elsewhere the mirrored half of the face and the reference
   stand in; all are weighted by their variances, so that one fades into the other.
3. r is what the reference's light leaves unexplained there, blurred: cast shadows, highlights, a nose that is
   not in the mesh. The more the light slants, the more of it is light, not person.
4. How strong the light is, and of what colour, cannot be told from how dark a skin is, and of what colour.
   Where the face goes back into its photo, both stay those of the target; `TransferOptions` has the rest.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.ndimage import gaussian_filter, grey_erosion, map_coordinates

from relit.face_shape import FaceShape, face_shape
from relit.lambertian import Light, fit_light
from relit.ltv import DARKEST
from relit.methods.scene import Relit, Scene, as_planes, stacked
from relit.pixels import to_unit

if TYPE_CHECKING:
    from typing import TypeAlias

    from numpy.typing import NDArray

    from relit.options import TransferOptions

    Plane: TypeAlias = NDArray[np.float64]

_DARKEST_SHADE = 0.04  # of a light's strongest: what it leaves darker is no base for a ratio
_TILT = 0.15  # rad: how wrong a normal of the mesh is
_PERSON = 0.35  # in log I: how different two people are
_HALVES = 0.4  # and the two halves of one
_NOISE = 2 / 255
_UNLIT, _LIT = 0.03, 0.3  # brightness, of the light's strength, that says nothing and all of a person
_RESIDUAL, _SHADOW, _SHADOW_FROM = 0.6, 0.6, -0.8  # share of r that is light, more of it below, in log I
_UNKNOWN = 0.5  # of a difference in brightness: the light's share, where nothing tells it from the skin's
_SLANTED = 0.5  # sine of the angle from which on a light casts shadows at their deepest
_BLUR, _WIDE = 0.02, 0.04  # interocular distances


@dataclass(frozen=True, eq=False)
class _Face:
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
    """

    log: Plane
    light: Light
    shade: Plane
    variance: Plane

    @cached_property
    def person(self) -> Plane:
        """``f - s``."""
        return self.log - self.shade


def relight(scene: Scene) -> Relit:
    """Return exp(s' + p + k r)."""
    unit = scene.landmarks.interocular_distance
    ours = face_shape(scene.landmarks, scene.face.shape)
    theirs = face_shape(scene.landmarks, scene.face.shape, of=scene.reference_landmarks)
    mirror = _mirror(scene, ours)
    targets = [_explained(plane, ours, unit) for plane in as_planes(to_unit(scene.target))]
    references = [_explained(plane, theirs, unit) for plane in as_planes(to_unit(scene.reference))]
    colored = len(references) > len(targets)
    targets *= len(references) // len(targets)

    blur = 0.5 / scene.lam_px
    grey = np.mean([reference.person for reference in references], axis=0)
    lits, persons, lights = [], [], []
    for target, reference in zip(targets, references, strict=True):
        lit = _lit(target, unit)
        person, stand_in = _person(target, reference, lit, ours.inside, mirror)
        if colored:
            person = person + gaussian_filter(reference.person - grey, blur)
        residual = gaussian_filter(stand_in - person, blur)
        share = _RESIDUAL * residual + _SHADOW * np.minimum(residual - _SHADOW_FROM, 0)
        lits.append(lit)
        persons.append(person)
        lights.append(np.log(_shade(reference.light, ours)) + reference.light.slant**3 * share)

    anchor = _anchor(scene.options, targets, references, lights, ours.inside, colored)
    lights = [light + shift for light, shift in zip(lights, anchor, strict=True)]
    relit = stacked([np.exp(light + person) for light, person in zip(lights, persons, strict=True)])
    layers = {
        "target_light": stacked([np.exp(target.shade) for target in targets]),
        "target_is_lit": stacked(lits),
        "person": stacked([np.exp(person) / 2 for person in persons]),
        "new_light": stacked([np.exp(light) for light in lights]),
    }
    return Relit(np.clip(relit, 0, 1), layers=layers)


def _anchor(
    options: TransferOptions,
    targets: list[_Face],
    references: list[_Face],
    lights: list[Plane],
    inside: NDArray[np.bool_],
    colored: bool,
) -> Plane:
    """Return what to add to the light of every plane, to keep the target's brightness and hue or not."""
    exposure = options.exposure
    if exposure is None:
        exposure = 0.0 if options.mask else _UNKNOWN
    pairs = zip(targets, references, strict=True)
    stronger = np.mean([np.log(t.light.strength / r.light.strength) for t, r in pairs])
    # A grey target has no hue to keep.
    tint = 1.0 if colored else options.tint
    change = [(target.shade - light)[inside].mean() for target, light in zip(targets, lights, strict=True)]
    return np.asarray((1 - exposure) * stronger + (1 - tint) * (change - np.mean(change)))


def _explained(plane: NDArray[Any], shape: FaceShape, unit: float) -> _Face:
    image = np.maximum(plane.astype(np.float64), DARKEST)
    smooth = gaussian_filter(image, _BLUR * unit)
    light = fit_light(smooth, shape.normals, shape.inside)
    wrong = gaussian_filter(light.sensitivity(shape.normals) ** 2, _BLUR * unit)
    noise = _NOISE / np.maximum(gaussian_filter(image, _WIDE * unit), _NOISE)
    return _Face(np.log(image), light, np.log(_shade(light, shape)), _TILT**2 * wrong + noise**2 + 1e-4)


def _shade(light: Light, shape: FaceShape) -> Plane:
    shade = light.on(shape.normals)
    return np.asarray(np.maximum(shade, max(_DARKEST_SHADE * float(shade.max()), DARKEST)))


def _lit(face: _Face, unit: float) -> Plane:
    """Return where a face's own light reaches: 0 to 1, and less at a shadow's edge than within the light."""
    size = max(1, round(0.07 * unit))
    seen = gaussian_filter(np.exp(face.log), _WIDE * unit) / max(face.light.strength, DARKEST)
    seen = gaussian_filter(grey_erosion(seen, (size, size)), size / 3)
    share = np.clip((seen - _UNLIT) / (_LIT - _UNLIT), 0, 1)
    dark = 1 - share**2 * (3 - 2 * share)
    # A light at the camera casts no shadow that the camera sees: what is dark then is dark hair.
    return np.asarray(1 - dark * min(face.light.slant / _SLANTED, 1) ** 4)


def _person(
    target: _Face, reference: _Face, lit: Plane, inside: NDArray[np.bool_], mirror: NDArray[np.float64] | None
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


def _mirror(scene: Scene, shape: FaceShape) -> NDArray[np.float64] | None:
    """Return where, ``(y, x)``, the same place of the other half of the face is seen, if eyes tell."""
    eyes = scene.landmarks.eyes
    if eyes is None:
        return None
    right, left = np.pad(eyes, ((0, 0), (0, 3 - eyes.shape[1])))
    across = (left - right) / np.linalg.norm(left - right)
    y, x = np.indices(scene.face.shape)
    place = np.stack([x, y, shape.depth], axis=-1)
    there = place - 2 * ((place - (left + right) / 2) @ across)[..., None] * across
    return np.stack([there[..., 1], there[..., 0]])
