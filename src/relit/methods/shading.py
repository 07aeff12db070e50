"""relit's own method: light is lamps on a dome, and a new one changes a head by the ratio of what both make.

With Y the linear brightness of a photo, a face is ``log Y = log s + e``: s the shading that its lamps make on
its shape, e what they leave unexplained. The target's brightness changes by

    D = κ (log s' - log s) + κ₂ (a r - b t),

1. s' is the shading that the reference's lamps make on the target's head, cast shadows included, and s that
   of the target's own lamps.
2. r is e of the reference, blurred: soft shadows, highlights, a nose that is not in the template. It counts
   where both photos show skin. t is the target's own e, which the old light takes along. Either is in part
   the person, and more so in what both halves of a face share: of that, less is taken.
3. κ = 1 - τ²/var D tells a change of light from errors of the shape, as James and Stein do [1]_: between two
   lights that are alike, nothing is to be done.
4. Hue comes from the lamps alone: that of s' less that of s, shrunk alike; and what is left of it where the
   target's own light has colours: `hue`.
5. The less lamps explain of a face, the less is sure of its light: s' is blurred, and s at least as much;
   r counts less, and hue is shrunk more.
6. How strong a light is, and its overall colour, cannot be told from how dark a skin is, and of what colour:
   `LightChange.anchored` is told. What a photo has bleached of the skin is undone as it changes: `bleach`.

References
----------
.. [1] W. James and C. Stein, "Estimation with quadratic loss", Proc. 4th Berkeley Symp., 1961.
"""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from relit.face.head import turn_between
from relit.face.mirror import twins
from relit.face.shape import head_shape
from relit.light.lamps import (
    filled,
    moved,
    rotated,
    softened,
    studio_lamps,
    studio_points,
    tilted,
    turned,
)
from relit.methods.bleach import bleach_of
from relit.methods.hue import hue_change, shrunk, without_noise
from relit.methods.known_shape import as_explained, known_shape, not_outshining
from relit.methods.light_change import LightChange
from relit.methods.lit_face import BRIGHTEST, LitFace, brightness_of, explain, linear, shown
from relit.methods.residual import of_reference, of_target
from relit.methods.scene import Layers
from relit.methods.unlit import stand_in
from relit.photo.channels import clipped, repeated, within
from relit.photo.curves import exp
from relit.photo.ranks import median, quantile
from relit.photo.resampling import blurred
from relit.settings.studio_lights import studio_light
from relit.solver.membrane import carried_on

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from relit.face.landmarks import Landmarks
    from relit.face.regions import FaceRegions
    from relit.face.shape import FaceShape
    from relit.light.dome import Lamps
    from relit.methods.lit_face import Plane
    from relit.methods.scene import Scene

# What each of these is worth: docs/leaderboard.md, The constants.
_NOISE, _RESIDUAL_NOISE, _HUE_NOISE = 0.08, 0.3, 0.1  # τ of D, of a residual, of a hue; in log
_COARSE = 0.1  # interocular distances that a change is blurred over beyond the face
# Interocular distances that a light's brightness and hue are blurred over if it is not sure, and how well
# lamps explain a face whose light is, and is not. Of rendered heads nearly all are; of photos, shadows lose
# the template's edges.
_VAGUE, _VAGUE_HUE, _SURE, _UNSURE = 1.0, 0.5, 0.42, 0.3
_NEARLY_ALL = 0.98  # the share of a face that changes less than the most that ears and neck may
_FLAT = 0.2  # cosine of the angle to the camera up to which a reference shows nothing; at twice, it does

#: What is made on the way, as of `Lighting.layers`.
LAYERS = ("target_light", "target_is_lit", "person", "new_light")


def relight(scene: Scene) -> LightChange:
    """Return the change of light."""
    face, iod, options = scene.face, scene.face.interocular_distance, scene.options
    shape, target, reference = _explained(scene)
    lamps, sources, most = _new_light(scene, reference)
    sure = _sure_of(reference)
    own_doubt, doubt = iod * (1 - _sure_of(target)), iod * (1 - sure)
    # Shades of the old light that the new one is not known to replace stay as they are in the photo.
    old, old_hue = _as_sure(target.own_shading, max(own_doubt, doubt), own_doubt)
    new, new_hue = _as_sure(target.shading(lamps, most), doubt, doubt)

    change = new - old
    variance = float(change[face.interior].var())
    twin, finest = twins(face.landmarks, shape), 0.5 / scene.lam_px
    residual = -of_target(target, twin, finest, iod)  # a new array: what is remembered stays
    if reference is not None:
        change *= shrunk(variance, _NOISE)
        if options.turn == options.tilt == 0:  # shadows and highlights that were found do not turn
            kept = (1 - options.softness) * (1 - (options.fill or 0.0)) * sure
            residual += kept * of_reference(reference, face.below_brows, finest, iod)
    photo = linear(scene.target, scene.encoded)
    bright, smooth = brightness_of(photo), without_noise(photo, iod)
    missing, reached = stand_in(bright, old, target, reference, face.features, twin, iod)
    change += reached * variance / (variance + _RESIDUAL_NOISE**2) * residual
    known = known_shape(face, shape.head)
    change = as_explained(change, known, scene, target, shape.head)
    hue, cast = hue_change(scene, smooth, new_hue, old_hue, _HUE_NOISE * (2 - sure))
    planes = change[..., None] if hue is None else np.dstack([change, hue])
    planes = carried_on(_coarse_beyond(planes, shape, face, iod), known, iod)
    brightness = not_outshining(planes[..., 0] + missing, bright, scene, target)
    measured = target if reference is None else reference
    return LightChange(
        light=photo,
        encoded=scene.encoded,
        brightness=brightness,
        hue=None if hue is None else planes[..., 1:],
        bleach=bleach_of(smooth, target.own_shading[1], target.weight, face.inside & ~face.features, iod),
        cast=cast,
        face=face.interior,
        ours=_brightest(target, face.interior),
        theirs=_brightest(measured, face.interior),
        known=known,
        confidence=1.0 if reference is None else _confidence(reference, target),
        lamps=lamps,
        sources=sources,
        no_skin=reference is None,
        layers=Layers(LAYERS, partial(_layers, scene, photo, (old, old_hue), (new, new_hue), reached)),
    )


def _new_light(scene: Scene, reference: LitFace | None) -> tuple[Lamps, Lamps, float]:
    """Return the new light, the same as of `Lighting.sources`, and the most that it makes of a face.

    Lamps are tilted, then turned; then they are filled; then all is softened.
    """
    options = scene.options
    if reference is None:
        # Of a light by name the lamps are moved, and not the little light from everywhere.
        light = moved(studio_light(options.light, options.fill), options.tilt, options.turn)
        lamps, sources, most = studio_lamps(light), studio_points(light), np.inf
        if not scene.colored:
            lamps, sources = lamps._replace(colors=None), sources._replace(colors=None)
    else:
        turn = turn_between(scene.reference_landmarks, scene.face.landmarks)
        found = tilted(rotated(reference.lamps, turn), options.tilt)
        lamps = sources = turned(found, options.turn)
        most = reference.most()
        if options.fill is not None:
            lamps = filled(lamps, options.fill)
    return softened(lamps, options.softness), softened(sources, options.softness), most


def _explained(scene: Scene) -> tuple[FaceShape, LitFace, LitFace | None]:
    """Return the shape of the target's head, and both faces explained, side by side."""
    face, iod = scene.face, scene.face.interocular_distance

    def one(
        given: tuple[NDArray[Any], NDArray[np.float32], Landmarks | None],
    ) -> tuple[FaceShape, LitFace]:
        planes, skin, of = given
        shape = head_shape(face.landmarks, face.shape, of=of)
        if of is not None:
            skin = np.clip((-shape.normals[..., 2] - _FLAT) / _FLAT, 0, 1) * skin
        return shape, explain(planes, shape, skin, iod, encoded=scene.encoded)

    assert scene.skin is not None
    ours = scene.target, scene.skin, None
    if scene.rendered:
        return *one(ours), None
    assert scene.reference_skin is not None
    theirs = scene.reference, scene.reference_skin, scene.reference_landmarks
    # Side by side, two threads would wait for Python's lock longer than they work: 1.2 times as long in all.
    shape, target = one(ours)
    return shape, target, one(theirs)[1]


def _layers(
    scene: Scene,
    light: Plane,
    old: tuple[Plane, Plane | None],
    new: tuple[Plane, Plane | None],
    reached: Plane,
) -> dict[str, Plane]:
    """Return both lights as they fall on the head, and the person, by whom the first makes the target."""
    inside = scene.face.interior
    first, second = (exp(shade if hue is None else shade[..., None] + hue) for shade, hue in (old, new))
    person = light / (first if first.ndim == light.ndim else exp(old[0]))
    first *= median(within(person, inside))
    person /= median(within(person, inside))
    second *= quantile(within(first, inside).ravel(), BRIGHTEST) / quantile(
        within(second, inside).ravel(), BRIGHTEST
    )
    return {
        "target_light": shown(first, scene.encoded),
        "target_is_lit": reached,
        "person": np.asarray(shown(person, scene.encoded) / 2, np.float32),
        "new_light": shown(second, scene.encoded),
    }


def _coarse_beyond(planes: Plane, shape: FaceShape, face: FaceRegions, iod: float) -> Plane:
    """Return a change that is coarser where a template is: at ears, neck, skull, which no landmarks hold."""
    head, blur, count = shape.head.astype(np.float32), _COARSE * iod, planes.shape[2]
    wide = blurred(planes * repeated(head, count), blur)
    wide /= repeated(np.maximum(blurred(head, blur), 1e-3), count)
    skin = within(planes, face.skin_area)
    wide = clipped(wide, quantile(skin, 1 - _NEARLY_ALL), quantile(skin, _NEARLY_ALL))
    held = repeated(np.clip(face.distance / blur, 0, 1).astype(np.float32), count)
    return np.asarray(held * planes + (1 - held) * wide, np.float32)


def _as_sure(
    shading: tuple[Plane, Plane | None], doubt: float, doubt_of_hue: float
) -> tuple[Plane, Plane | None]:
    """Return a shading, blurred the more, the less is sure of it; doubt is in px."""
    bright, hue = shading
    if doubt:
        bright = blurred(bright, _VAGUE * doubt)
    return bright, blurred(hue, _VAGUE_HUE * doubt_of_hue) if hue is not None and doubt_of_hue else hue


def _sure_of(face: LitFace | None) -> float:
    """Return how far the light that a face shows is sure, 0 to 1."""
    if face is None:
        return 1.0
    return float(np.clip((face.explained - _UNSURE) / (_SURE - _UNSURE), 0, 1))


def _brightest(face: LitFace, inside: NDArray[np.bool_]) -> float:
    """Return the brightness of a face where it is lit."""
    skin = (face.weight > 0.5) & inside
    return float(quantile(face.brightness[skin if skin.any() else inside], BRIGHTEST))


def _confidence(reference: LitFace, target: LitFace) -> float:
    """Return how far a light can be trusted: the share of the face that shows it, less what is left over."""
    seen = float(reference.weight.sum()) / max(float(target.weight.sum()), 1e-9)
    return min(seen, 1.0) * reference.explained
