"""The method of Li, Yin and Deng (2009): large scales by the logarithmic total variation model."""

from __future__ import annotations

from dataclasses import replace
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

    def split(face: tuple[NDArray[Any], Landmarks]) -> Decomposition:
        planes, landmarks = face
        return decompose(
            planes,
            scene.lam,
            neighborhood=scene.options.neighborhood,
            interocular_distance=landmarks.interocular_distance,
        )

    ours, laid = ((planes, scene.landmarks) for planes in (scene.target, scene.reference))
    theirs = laid if scene.own is None else (scene.own, scene.reference_landmarks)
    with pool(2) as run:
        target, reference = run(split, (ours, theirs))
    if scene.own is not None and scene.alignment is not None:
        u = scene.alignment.lay(reference.u)
        v = np.maximum(to_unit(scene.reference), np.float32(DARKEST)) / u
        reference = replace(reference, u=u, v=np.asarray(v, np.float32))
    return recombined(target, reference)
