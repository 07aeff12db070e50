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

from typing import TYPE_CHECKING

import numpy as np
from scipy.ndimage import gaussian_filter

from relit.methods.light_and_person import explained_faces, shade_on
from relit.methods.scene import Relit, Scene, stacked
from relit.photo.color import LUMA_WEIGHTS

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from relit.methods.light_and_person import Face, Plane
    from relit.settings.options import TransferOptions

_RESIDUAL, _SHADOW, _SHADOW_FROM = 0.6, 0.6, -0.8  # share of r that is light, more of it below, in log I
_OTHERS, _ACROSS = 0.9, 0.1  # how little of r counts in features, and how far it is from beyond them


def relight(scene: Scene) -> Relit:
    """Return exp(s' + p + k r)."""
    unit = scene.landmarks.interocular_distance
    faces = explained_faces(
        scene.target, scene.reference, scene.landmarks, scene.reference_landmarks, rendered=scene.rendered
    )
    targets, references = faces.targets, faces.references
    blur = 0.5 / scene.lam_px
    persons, lights = list(faces.persons), []
    for k, (reference, stand_in) in enumerate(zip(references, faces.stand_ins, strict=True)):
        if faces.colored:
            grey = np.mean([one.person for one in references], axis=0)
            persons[k] = persons[k] + gaussian_filter(reference.person - grey, blur)
        if scene.rendered:
            lights.append(reference.shade)
            continue
        residual = _residual(stand_in - persons[k], faces.features, blur, unit)
        share = _RESIDUAL * residual + _SHADOW * np.minimum(residual - _SHADOW_FROM, 0)
        lights.append(np.log(shade_on(reference.light, faces.shape)) + reference.light.slant**3 * share)

    anchor = _anchor(scene.options, targets, references, lights, faces.shape.inside, faces.colored)
    lights = [light + shift for light, shift in zip(lights, anchor, strict=True)]
    relit = stacked([np.exp(light + person) for light, person in zip(lights, persons, strict=True)])
    # The hue of the skin is shown in the person, though in one photo it may be that of the light.
    tone = np.log([target.strength for target in targets])
    tone -= tone.mean()
    layers = {
        "target_light": stacked([np.exp(t.shade - c) for t, c in zip(targets, tone, strict=True)]),
        "target_is_lit": stacked(faces.lits),
        "person": stacked([np.exp(person + c) / 2 for person, c in zip(persons, tone, strict=True)]),
        "new_light": stacked([np.exp(light - c) for light, c in zip(lights, tone, strict=True)]),
    }
    return Relit(relit, layers=layers)


def _anchor(
    options: TransferOptions,
    targets: list[Face],
    references: list[Face],
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


def _residual(difference: Plane, features: Plane, blur: float, unit: float) -> Plane:
    """Return r, which goes through brows, eyes and mouth as it goes round them."""
    round_them = 1 - _OTHERS * features
    wide = gaussian_filter(difference * round_them, _ACROSS * unit) / gaussian_filter(
        round_them, _ACROSS * unit
    )
    return np.asarray(gaussian_filter(difference, blur) * (1 - features) + wide * features)
