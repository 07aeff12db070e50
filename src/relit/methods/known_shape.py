"""Where the shape of a target's head is known well enough to say what light does on it.

A template has a head's shape, and the landmarks that of a face, but not of lids, nostrils and an open mouth;
shoulders and clothes are nobody's; and a neck has light from a shirt, which no template knows. There a change
of light is carried on from where it is known. And an ear that is not where the template's is, or a shoulder,
would burn out in a face that is dim.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from relit.face.outline import drawn
from relit.methods.lit_face import BRIGHTEST
from relit.photo.curves import log
from relit.photo.filters import close_to, gaussian
from relit.photo.ranks import quantile
from relit.photo.resampling import blurred
from relit.runtime.memo import remembered

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from relit.face.regions import FaceRegions
    from relit.methods.lit_face import LitFace, Plane
    from relit.methods.scene import Scene

# What each of these is worth: docs/leaderboard.md, The constants.
_LIDS = 0.08  # interocular distances that lids reach beyond the eyes
_WINGS = 0.05  # the same of the crease below a nose, which a template has where it is not
_NOSE_WINGS = 48, 64, 98, 97, 2, 326, 327, 294, 278  # rows of the mesh along it
_CHEST = 0.4, 0.9  # interocular distances below a face where a neck begins to end, and has ended
_AROUND = 0.1  # interocular distances over which skin beyond the face is looked at
_ROUND_IT = 0.3  # interocular distances from where a change is taken instead
_LITTLE, _MUCH = 0.15, 0.4  # in log: what may be left unexplained there, and what says that nothing is known
_DARKEST = 1e-4  # linear brightness that counts as none
_EDGE = 0.02  # interocular distances over which skin ends
_RIM = 0.03  # interocular distances that trust in the shape turns soft over at the rim of a head


@remembered
def known_shape(face: FaceRegions, head: NDArray[np.bool_]) -> Plane:
    """Return where the light on a head is known, 0 to 1.

    Parameters
    ----------
    face : FaceRegions
    head : (H, W) bool array
        Where the head is.

    Returns
    -------
    (H, W) float32 array
    """
    return _soft(head, face.interocular_distance) * (1 - _fine_shapes(face)) * _above_chest(face)


def as_explained(
    change: Plane, known: Plane, scene: Scene, target: LitFace, head: NDArray[np.bool_]
) -> Plane:
    """Return a change of brightness, as round it where lamps do not explain the skin beyond the face.

    Parameters
    ----------
    change : (H, W) array
    known : (H, W) array
        As of `known_shape`.
    scene : Scene
    target : LitFace
        In its own light.
    head : (H, W) bool array
        Where the head is.

    Returns
    -------
    (H, W) float32 array
    """
    trust, wide = _explained_beyond(scene, target, head), _ROUND_IT * scene.face.interocular_distance
    near = known * trust
    # Far from all that is explained, it is the mean.
    mean = float((near * change).sum() / max(float(near.sum()), 1e-9))
    around = mean + blurred(near * (change - np.float32(mean)), wide) / np.maximum(blurred(near, wide), 1e-2)
    return np.asarray(trust * change + (1 - trust) * around, np.float32)


def not_outshining(change: Plane, brightness: Plane, scene: Scene, target: LitFace) -> Plane:
    """Return a change with which no skin beyond the face outshines the face more than it did before.

    Parameters
    ----------
    change : (H, W) array
        Of the brightness, in log.
    brightness : (H, W) array
        Linear luma of the target, nowhere 0.
    scene : Scene
    target : LitFace
        In its own light.

    Returns
    -------
    (H, W) float32 array
    """
    face, wide = scene.face, _AROUND * scene.face.interocular_distance
    assert scene.like_skin is not None
    beyond = np.asarray(scene.like_skin * ~face.inside, np.float32)
    bright = log(np.maximum(blurred(brightness, wide / 2), np.float32(_DARKEST)))
    skin = (target.weight > 0.5) & face.interior
    if not skin.any():
        return change
    edge = gaussian(beyond, _EDGE * face.interocular_distance)
    before, after = (light - quantile(light[skin], BRIGHTEST) for light in (bright, bright + change))
    excess = beyond * np.maximum(after - np.maximum(before, 0), 0)
    excess = blurred(excess, wide) / np.maximum(blurred(beyond, wide), 0.1)
    return np.asarray(change - edge * excess, np.float32)


def _explained_beyond(scene: Scene, target: LitFace, head: NDArray[np.bool_]) -> Plane:
    """Return where lamps explain what is seen of a skin beyond the face, 0 to 1; 1 where none is seen.

    A template's chin keeps the light from its neck. A photo's neck has light from a shirt, and of a wall.
    """
    face, iod = scene.face, scene.face.interocular_distance
    assert scene.like_skin is not None
    seen = np.asarray(scene.like_skin * head * ~face.inside, np.float32)
    near = blurred(seen, _AROUND * iod)
    off = np.abs(blurred(seen * target.unexplained, _AROUND * iod)) / np.maximum(near, 1e-3)
    doubt = np.clip((off - _LITTLE) / (_MUCH - _LITTLE), 0, 1) * np.minimum(4 * near, 1)
    return np.asarray(np.where(face.inside, 1, 1 - doubt), np.float32)


def _fine_shapes(face: FaceRegions) -> Plane:
    """Return where eyes, lids, nostrils and an open mouth are, whose shape no template has, 0 to 1."""
    iod = face.interocular_distance
    eyes, mouth = (face.hulls((name,)) for name in ("eyes", "inner_mouth"))
    fine = close_to(eyes, _LIDS * iod) | close_to(mouth, _LIDS / 2 * iod)
    if face.landmarks.scheme == "mesh478":
        wings = face.landmarks.xy[list(_NOSE_WINGS)]
        fine |= close_to(drawn([np.vstack([wings, wings[::-1]])], face.shape), _WINGS * iod)
    return gaussian(fine, _LIDS / 2 * iod)


def _above_chest(face: FaceRegions) -> Plane:
    """Return where light on a head is known, 0 to 1: not on shoulders, clothed and no template's."""
    first, last = _CHEST
    share = (last + face.height / np.float32(face.interocular_distance)) / (last - first)
    return np.asarray(np.clip(share, 0, 1), np.float32)


def _soft(head: NDArray[np.bool_], iod: float) -> Plane:
    """Return where a head is, 0 to 1, and less at its rim, where a surface is seen too flat to be shaded."""
    soft = gaussian(head, _RIM * iod, edge="repeated")
    return np.clip(2 * soft - 1, 0, 1)
