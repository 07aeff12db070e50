"""Light and person of two faces, one laid over the other: p̂, made up where the target's light does not reach.

This much is known before λ and the user's wishes come in, which is why it is remembered.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from scipy.ndimage import map_coordinates

from relit.face.shape import FaceShape, face_shape
from relit.methods.explained_face import Face, all_light, explained, explained_target
from relit.methods.scene import as_planes
from relit.photo.pixels import to_unit
from relit.runtime.memo import remembered
from relit.runtime.threads import available, pool

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from relit.face.landmarks import Landmarks
    from relit.face.regions import FaceRegions
    from relit.methods.explained_face import Plane

# What each of these is worth: docs/leaderboard.md, The constants.
_PERSON, _HALVES = 0.35, 0.4  # in log I: how different two people are, and the two halves of one


class Faces(NamedTuple):
    """Two faces, plane by plane, and all that is known of them before there is a λ.

    Attributes
    ----------
    face : FaceRegions
        Where the target is.
    shape : FaceShape
        The target's.
    targets, references : list of Face
    colored : bool
        Whether a grey target takes on the colours of the reference.
    lits, persons, stand_ins : list of array
        Where the target's light reaches, p̂, and the reference's p as bright as it.
    features : array
        Where brows, eyes and mouth are, as of `explained_target`.
    """

    face: FaceRegions
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
    face: FaceRegions,
    reference_landmarks: Landmarks,
    *,
    rendered: bool,
) -> Faces:
    """Explain two faces, plane by plane.

    Parameters
    ----------
    target, reference : (H, W) or (H, W, 3) array
        The latter laid over the former.
    face : FaceRegions
        Of the target.
    reference_landmarks : Landmarks
        Of the reference in its own photo.
    rendered : bool
        Whether the reference is nobody's face.

    Returns
    -------
    Faces
    """
    shape, found, lit, mirror, features = explained_target(target, face)
    theirs = shape if rendered else face_shape(face.landmarks, face.shape, of=reference_landmarks)
    with pool(available()) as run:
        references = run(
            lambda plane: all_light(plane, face) if rendered else explained(plane, theirs, face),
            as_planes(to_unit(reference)),
        )
        colored = len(references) > len(found)
        copies = len(references) // len(found)
        targets, lits = copies * list(found), copies * list(lit)
        both = run(
            lambda k: _person(targets[k], references[k], lits[k], face.inside, mirror), range(len(targets))
        )
    persons, stand_ins = (list(planes) for planes in zip(*both, strict=True))
    return Faces(face, shape, targets, references, colored, lits, persons, stand_ins, features)


def _person(
    target: Face, reference: Face, lit: Plane, inside: NDArray[np.bool_], mirror: NDArray[np.float64] | None
) -> tuple[Plane, Plane]:
    """Return p̂, and the reference's p as bright as it.

    p̂ = Σ wᵢpᵢ / Σ wᵢ, wᵢ = 1/σᵢ², over the target's own p, the reference's and that of the mirrored half. Two
    persons differ by σ = 0.35, two halves of one by 0.4; the target counts as far as its light reaches.
    """
    w_own = lit / target.variance
    w_other = 1 / (_PERSON**2 + reference.variance)
    inner = w_own * inside
    difference = (inner * (target.person - reference.person)).sum() / max(inner.sum(), 1e-9)
    stand_in = reference.person + difference
    weighted, weights = w_own * target.person + w_other * stand_in, w_own + w_other
    if mirror is None:
        return weighted / weights, stand_in

    def mirrored(plane: Plane) -> Plane:
        return np.asarray(map_coordinates(plane, mirror, order=1, mode="nearest"))

    w_half = (1 - lit) * mirrored(lit) / (mirrored(target.variance) + _HALVES**2)
    return (weighted + w_half * mirrored(target.person)) / (weights + w_half), stand_in
