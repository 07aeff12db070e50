"""The steps whose results rows share: those worth a file, and how they become arrays; those worth memory."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from inspect import unwrap
from typing import TYPE_CHECKING, Any

import numpy as np

from relit.batch.reading import fetch
from relit.compose.hair import hair
from relit.compose.matte import eyes_and_teeth, matte
from relit.compose.person_matte import person_area, person_matte
from relit.face.detect import faces_in
from relit.face.head import fitted, raster_of
from relit.face.landmarks import Landmarks
from relit.face.person import person
from relit.face.shape import face_shape, head_shape
from relit.face.trust import skin_shown
from relit.face.views import as_seen_before
from relit.light.dome import surface_of
from relit.ltv.decomposition import Decomposition, decompose
from relit.methods.lit_face import explain

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Arrays = Mapping[str, NDArray[Any]]


def _split_together(arrays: Arrays) -> Decomposition:
    lam, neighborhood = arrays["lam"].item(), arrays["neighborhood"].item()
    return Decomposition(arrays["u"], arrays["v"], lam, neighborhood)


def _faces_apart(faces: tuple[Landmarks, ...]) -> Arrays:
    points, confidence = [face.points for face in faces], [face.confidence for face in faces]
    return {"points": np.array(points), "confidence": np.array(confidence, float)}


def _faces_together(arrays: Arrays) -> tuple[Landmarks, ...]:
    found = zip(arrays["points"], arrays["confidence"].tolist(), strict=True)
    return tuple(Landmarks(points, "mesh478", confidence) for points, confidence in found)


#: The steps that are worth a file: how a result becomes arrays, and they a result. That a photo has no face
#: is a result of `faces_in` like any other.
FORMS: dict[Callable[..., Any], tuple[Callable[[Any], Arrays], Callable[[Arrays], Any]]] = {
    unwrap(decompose): (
        lambda split: {name: np.asarray(part) for name, part in vars(split).items()},
        _split_together,
    ),
    unwrap(faces_in): (_faces_apart, _faces_together),
    unwrap(fetch): (
        lambda data: {"data": np.frombuffer(data, np.uint8)},
        lambda arrays: arrays["data"].tobytes(),
    ),
}

_OF_SHAPE_AND_LIGHT = explain, face_shape, fitted, head_shape, raster_of, surface_of
_OF_PIXELS = as_seen_before, eyes_and_teeth, hair, matte, person, person_area, person_matte, skin_shown

#: The steps on a target alone that are worth memory only: rows that share it mostly follow each other, while
#: hardly another row has the same pair.
OF_TARGETS = {unwrap(step) for step in _OF_SHAPE_AND_LIGHT + _OF_PIXELS}
