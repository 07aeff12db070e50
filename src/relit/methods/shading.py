"""relit's own method: a simple light explains most of a face, the reference's residual the rest of its light.

With f = log I, a face is ``f = s + p``: s the shading of the light that is fitted to it, p the person. The
relit face is ``exp(s' + p + k r)``:

1. s' is the shading that the reference's light makes on the target's shape.
2. p is the target's, where its own light reaches. Elsewhere the mirrored half of the face and the reference
   stand in; all are weighted by their variances, so that one fades into the other.
3. r is what the reference's light leaves unexplained there, blurred: cast shadows, highlights, a nose that is
   not in the mesh. The more the light slants, the more of it is light, not person.
4. How strong the light is, and of what colour, cannot be told from how dark a skin is, and of what colour.
   `compose.adjust` decides on both, and adds what it comes to, a number for each plane, to s'.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.ndimage import gaussian_filter

from relit.methods.explained_face import shade_on
from relit.methods.light_and_person import Faces, explained_faces
from relit.methods.scene import Relit, Scene, stacked

if TYPE_CHECKING:
    from relit.methods.explained_face import Plane

# What each of these is worth: docs/leaderboard.md, The constants.
_RESIDUAL, _SHADOW, _SHADOW_FROM = 0.6, 0.6, -0.8  # share of r that is light, more of it below, in log I
_OTHERS, _ACROSS = 0.9, 0.1  # how little of r counts in features, and how far it is from beyond them


@dataclass(frozen=True, eq=False)
class LightAndPerson:
    """A relit face in log I, before it is said how bright it is to be, and of what hue.

    Attributes
    ----------
    faces : Faces
        The two faces that it was made of.
    lights, persons : list of array
        ``s' + k r`` and p, plane by plane.
    """

    faces: Faces
    lights: list[Plane]
    persons: list[Plane]

    def anchored(self, anchor: Plane) -> Relit:
        """Return the relit planes, ``exp(s' + p + k r)``, with what `anchor` adds to the light of each."""
        lights = [light + shift for light, shift in zip(self.lights, anchor, strict=True)]
        relit = stacked([np.exp(light + person) for light, person in zip(lights, self.persons, strict=True)])
        # The hue of the skin is shown in the person, though in one photo it may be that of the light.
        targets = self.faces.targets
        tone = np.log([target.strength for target in targets])
        tone -= tone.mean()
        layers = {
            "target_light": stacked([np.exp(t.shade - c) for t, c in zip(targets, tone, strict=True)]),
            "target_is_lit": stacked(self.faces.lits),
            "person": stacked([np.exp(person + c) / 2 for person, c in zip(self.persons, tone, strict=True)]),
            "new_light": stacked([np.exp(light - c) for light, c in zip(lights, tone, strict=True)]),
        }
        return Relit(relit, layers=layers)


def relight(scene: Scene) -> LightAndPerson:
    """Return s' + k r, and p."""
    iod = scene.face.interocular_distance
    faces = explained_faces(
        scene.target, scene.reference, scene.face, scene.reference_landmarks, rendered=scene.rendered
    )
    blur = 0.5 / scene.lam_px
    persons, lights = list(faces.persons), []
    for k, (reference, stand_in) in enumerate(zip(faces.references, faces.stand_ins, strict=True)):
        if faces.colored:
            grey = np.mean([one.person for one in faces.references], axis=0)
            persons[k] = persons[k] + gaussian_filter(reference.person - grey, blur)
        if scene.rendered:
            lights.append(reference.shade)
            continue
        residual = _residual(stand_in - persons[k], faces.features, blur, iod)
        share = _RESIDUAL * residual + _SHADOW * np.minimum(residual - _SHADOW_FROM, 0)
        lights.append(np.log(shade_on(reference.light, faces.shape)) + reference.light.slant**3 * share)
    return LightAndPerson(faces, lights, persons)


def _residual(difference: Plane, features: Plane, blur: float, iod: float) -> Plane:
    """Return r, which goes through brows, eyes and mouth as it goes round them."""
    round_them = 1 - _OTHERS * features
    wide = gaussian_filter(difference * round_them, _ACROSS * iod) / gaussian_filter(
        round_them, _ACROSS * iod
    )
    return np.asarray(gaussian_filter(difference, blur) * (1 - features) + wide * features)
