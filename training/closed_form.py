"""The method as it is, watched: what it works with, as planes that a network sees, and a way to correct it.

`relit.methods.shading` knows nothing of any network: three of its steps are replaced while a trial lasts.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any
from unittest.mock import patch

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import map_coordinates

from relit.face.regions import FaceRegions
from relit.methods import shading
from relit.methods.known_shape import not_outshining
from relit.methods.lit_face import LitFace, brightness_of, linear
from relit.methods.scene import Scene

SIDE = 96  # px of what a network sees
#: Log brightness of target and reference, the change of it, the old shading and the new one, normals, where
#: either shows skin, and where the face is.
PLANES = 11
_MARGIN = 0.12  # of the face's size, round it
_DARKEST = 1e-3  # linear brightness

Planes = NDArray[np.float32]


@dataclass
class Watched:
    """What the method worked with, last of all."""

    scene: Scene
    normals: NDArray[Any]
    target: LitFace
    reference: LitFace | None
    shades: list[Planes] = field(default_factory=list)


@contextmanager
def corrected(correct: Callable[[Planes, Watched], Planes]) -> Iterator[None]:
    """Let a change of brightness, (H, W) in log, be another one meanwhile.

    Parameters
    ----------
    correct : callable
        Takes the change and what it was made of, and returns a change.
    """
    usual_explained, usual_as_sure = shading._explained, shading._as_sure
    seen: list[Watched] = []

    def explained(scene: Scene) -> Any:
        shape, target, reference = usual_explained(scene)
        seen[:] = [Watched(scene, shape.normals, target, reference)]
        return shape, target, reference

    def as_sure(*given: Any) -> Any:
        made = usual_as_sure(*given)
        seen[0].shades.append(made[0])
        return made

    def last(change: Planes, *rest: Any) -> Any:
        return not_outshining(correct(change, seen[0]), *rest)

    with patch.multiple(shading, _explained=explained, _as_sure=as_sure, not_outshining=last):
        yield


def box_round(face: FaceRegions) -> NDArray[np.float64]:
    """Return where a network's pixels lie in a view: rows and columns, (2, SIDE, SIDE), of a square."""
    y, x = np.nonzero(face.inside)
    line = (1 + 2 * _MARGIN) * max(np.ptp(y), np.ptp(x)) * ((np.arange(SIDE) + 0.5) / SIDE - 0.5)
    middle = (y.min() + y.max()) / 2, (x.min() + x.max()) / 2
    return np.stack(np.meshgrid(middle[0] + line, middle[1] + line, indexing="ij"))


def at(plane: NDArray[Any], box: NDArray[np.float64]) -> Planes:
    """Return a plane at the places of a box."""
    return np.asarray(map_coordinates(np.asarray(plane, np.float32), box, order=1, mode="nearest"))


def planes_of(change: Planes, seen: Watched) -> Planes:
    """Return what a network sees of a change, (PLANES, SIDE, SIDE); medians over the face are taken off."""
    assert seen.reference is not None
    face, box = seen.scene.face, box_round(seen.scene.face)
    inside = at(face.inside, box)
    light = brightness_of(linear(seen.scene.target, seen.scene.encoded))
    logs = [np.log(np.maximum(one, _DARKEST)) for one in (light, seen.reference.brightness)]
    planes = [at(plane, box) for plane in (*logs, change, *seen.shades)]
    planes = [plane - np.median(plane[inside > 0.5]) for plane in planes]
    planes += [at(seen.normals[..., k], box) for k in range(3)]
    planes += [at(seen.target.weight, box), at(seen.reference.weight, box), inside]
    return np.stack(planes).astype(np.float32)
