"""The method of Li, Yin and Deng (2009), Algorithm 1: u(warped reference) · v(target).

So that many targets can share the split of one reference, it may be split in its own photo: then its u is
warped, ``warped u(reference) · v(target)``.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from relit.ltv.decomposition import Decomposition, decompose
from relit.methods.scene import Relit, Scene, recombined
from relit.photo.pixels import DARKEST, to_unit
from relit.runtime.threads import pool

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from relit.face.landmarks import Landmarks


def relight(scene: Scene) -> Relit:
    """Return u(reference) · v(target)."""

    def split(photo: tuple[NDArray[Any], Landmarks]) -> Decomposition:
        planes, face = photo
        distance, neighborhood = face.interocular_distance, scene.options.neighborhood
        return decompose(planes, scene.lam, neighborhood=neighborhood, interocular_distance=distance)

    target, reference = (scene.target, scene.face.landmarks), (scene.reference, scene.face.landmarks)
    if scene.own is not None:
        reference = scene.own, scene.reference_landmarks
    with pool(2) as run:
        ours, theirs = run(split, (target, reference))
    if scene.own is not None:
        theirs = _warped(theirs, scene)
    return recombined(ours, theirs)  # theirs.u * ours.v


def _warped(split: Decomposition, scene: Scene) -> Decomposition:
    """Return the split of a reference, made in its own photo, as it lies on the target."""
    assert scene.alignment is not None
    u = scene.alignment.lay(split.u)
    v = np.maximum(to_unit(scene.reference), np.float32(DARKEST)) / u
    return Decomposition(u, np.asarray(v, np.float32), split.lam, split.neighborhood)
