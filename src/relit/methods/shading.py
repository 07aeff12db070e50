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

from relit.color import LUMA_WEIGHTS
from relit.compose import drawn
from relit.face_shape import FaceShape, face_shape
from relit.lambertian import Light, fit_light
from relit.ltv import DARKEST
from relit.methods.scene import Relit, Scene, as_planes, stacked
from relit.pixels import to_unit
from relit.scale import feature_hulls

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
_SLANTED = 0.5  # sine of the angle from which on a light casts shadows at their deepest
_FEATURES = ("brows", "eyes", "mouth")  # where two persons differ most
_OTHERS, _ACROSS = 0.9, 0.1  # how little of r counts there, and how far it is from beyond them
_BRIGHTEST = 0.95  # the share of a face that is darker than the brightest
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


def relight(scene: Scene) -> Relit:
    """Return exp(s' + p + k r)."""
    unit = scene.landmarks.interocular_distance
    ours = face_shape(scene.landmarks, scene.face.shape)
    theirs = (
        ours
        if scene.rendered
        else face_shape(scene.landmarks, scene.face.shape, of=scene.reference_landmarks)
    )
    mirror = _mirror(scene, ours)
    targets = [_explained(plane, ours, unit) for plane in as_planes(to_unit(scene.target))]
    references = [
        _all_light(plane, ours) if scene.rendered else _explained(plane, theirs, unit)
        for plane in as_planes(to_unit(scene.reference))
    ]
    colored = len(references) > len(targets)
    targets *= len(references) // len(targets)

    blur = 0.5 / scene.lam_px
    features = _features(scene, unit)
    grey = np.mean([reference.person for reference in references], axis=0)
    lits, persons, lights = [], [], []
    for target, reference in zip(targets, references, strict=True):
        lit = _lit(target, unit)
        person, stand_in = _person(target, reference, lit, ours.inside, mirror)
        if colored:
            person = person + gaussian_filter(reference.person - grey, blur)
        residual = _residual(stand_in - person, features, blur, unit)
        share = _RESIDUAL * residual + _SHADOW * np.minimum(residual - _SHADOW_FROM, 0)
        lits.append(lit)
        persons.append(person)
        lights.append(
            reference.shade
            if scene.rendered
            else np.log(_shade(reference.light, ours)) + reference.light.slant**3 * share
        )

    anchor = _anchor(scene.options, targets, references, lights, ours.inside, colored)
    lights = [light + shift for light, shift in zip(lights, anchor, strict=True)]
    relit = stacked([np.exp(light + person) for light, person in zip(lights, persons, strict=True)])
    # The hue of the skin is shown in the person, though in one photo it may be that of the light.
    tone = np.log([target.strength for target in targets])
    tone -= tone.mean()
    layers = {
        "target_light": stacked([np.exp(t.shade - c) for t, c in zip(targets, tone, strict=True)]),
        "target_is_lit": stacked(lits),
        "person": stacked([np.exp(person + c) / 2 for person, c in zip(persons, tone, strict=True)]),
        "new_light": stacked([np.exp(light - c) for light, c in zip(lights, tone, strict=True)]),
    }
    return Relit(relit, layers=layers)


def _anchor(
    options: TransferOptions,
    targets: list[_Face],
    references: list[_Face],
    lights: list[Plane],
    inside: NDArray[np.bool_],
    colored: bool,
) -> Plane:
    """Return what to add to the light of every plane, to keep the target's brightness and hue or not."""
    exposure = options.exposure_share
    weights = LUMA_WEIGHTS if len(lights) == 3 else np.ones(len(lights))
    ours, theirs = (
        np.average([face.strength for face in faces], weights=weights) for faces in (targets, references)
    )
    stronger = np.log(ours / theirs)
    # A grey target has no hue to keep. Made brighter, the same pigment is less vivid.
    tint = min(1.0, float(np.exp(-(1 - exposure) * stronger))) if colored else options.tint_share or 0.0
    change = [(target.shade - light)[inside].mean() for target, light in zip(targets, lights, strict=True)]
    return np.asarray((1 - exposure) * stronger + (1 - tint) * (change - np.average(change, weights=weights)))


def _explained(plane: NDArray[Any], shape: FaceShape, unit: float) -> _Face:
    image = np.maximum(plane.astype(np.float64), DARKEST)
    smooth = gaussian_filter(image, _BLUR * unit)
    light = fit_light(smooth, shape.normals, shape.inside)
    wrong = gaussian_filter(light.sensitivity(shape.normals) ** 2, _BLUR * unit)
    noise = _NOISE / np.maximum(gaussian_filter(image, _WIDE * unit), _NOISE)
    return _Face(
        np.log(image), light, np.log(_shade(light, shape)), _TILT**2 * wrong + noise**2 + 1e-4, shape.inside
    )


def _all_light(plane: NDArray[Any], shape: FaceShape) -> _Face:
    """Return what was rendered: nobody, in its light."""
    log = np.log(np.maximum(plane.astype(np.float64), _DARKEST_SHADE))
    return _Face(log, Light(np.zeros(3), 1.0), log, np.zeros_like(log), shape.inside)


def _shade(light: Light, shape: FaceShape) -> Plane:
    shade = light.on(shape.normals)
    return np.asarray(np.maximum(shade, max(_DARKEST_SHADE * float(shade.max()), DARKEST)))


def _lit(face: _Face, unit: float) -> Plane:
    """Return where a face's own light reaches: 0 to 1, and less at a shadow's edge than within the light."""
    size = max(1, round(0.07 * unit))
    seen = gaussian_filter(np.exp(face.log), _WIDE * unit) / face.strength
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


def _features(scene: Scene, unit: float) -> Plane:
    """Return where brows, eyes and mouth are, a little larger, with soft edges."""
    hulls = drawn(feature_hulls(scene.landmarks, _FEATURES), scene.face.shape)
    larger = np.minimum(4 * gaussian_filter(hulls.astype(np.float64), _BLUR * unit), 1)
    return np.asarray(gaussian_filter(larger, _BLUR * unit))


def _residual(difference: Plane, features: Plane, blur: float, unit: float) -> Plane:
    """Return r, which goes through brows, eyes and mouth as it goes round them."""
    round_them = 1 - _OTHERS * features
    wide = gaussian_filter(difference * round_them, _ACROSS * unit) / gaussian_filter(
        round_them, _ACROSS * unit
    )
    return np.asarray(gaussian_filter(difference, blur) * (1 - features) + wide * features)


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
