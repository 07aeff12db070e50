"""What a row does, kind by kind: from the bytes that were read to those that are to be written."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from relit.errors import FaceNotFoundError
from relit.face.detect import detect_landmarks
from relit.face.landmark_files import landmarks_as_bytes, landmarks_from
from relit.face.landmarks import check_inside
from relit.figures import split_pictures
from relit.ltv.decomposition import decompose, normalize
from relit.ltv.g_value import lam_for
from relit.photo.atomic_files import NamedBytes
from relit.photo.pixels import from_unit
from relit.photo.writing import check_destination, write_image
from relit.relighting import transfer

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from relit.batch.jobs import Job
    from relit.batch.reading import Content
    from relit.face.landmarks import Landmarks
    from relit.photo.photo import Photo
    from relit.results import TransferResult
    from relit.runtime.timing import Stopwatch

    Held = Mapping[str, Content]


class Done(NamedTuple):
    """What a row comes to.

    Attributes
    ----------
    files : list of bytes
        In the order of `Job.files`.
    landmarks : mapping of str to Landmarks
        By role.
    metrics : mapping of str to float
    """

    files: list[bytes]
    landmarks: Mapping[str, Landmarks]
    metrics: Mapping[str, float]


def _photo(place: str, held: Held, watch: Stopwatch) -> Photo:
    with watch("read"):
        return held[place].photo


def _face(photo: Photo, place: str, marks: str | None, held: Held, watch: Stopwatch) -> Landmarks:
    with watch("find the face"):
        if marks is not None:
            found = landmarks_from(held[marks].data, marks)
            check_inside(found, photo.pixels.shape, marks)
            return found
        try:
            return detect_landmarks(photo.pixels, name=place)
        except FaceNotFoundError as error:
            told = str(error).replace("--landmarks FILE", "a column of landmarks in the manifest")
            raise FaceNotFoundError(told) from None


def _transfer(job: Job, held: Held, watch: Stopwatch) -> Done:
    photo = _photo(job.target, held, watch)
    check_destination(NamedBytes(job.output), like=photo)
    here = _face(photo, job.target, job.target_landmarks, held, watch)
    found, light = {"target": here}, None
    if job.reference is not None:
        light = _photo(job.reference, held, watch)
        found["reference"] = _face(light, job.reference, job.reference_landmarks, held, watch)
    with watch("relight"):
        result = transfer(
            photo,
            light,
            target_landmarks=here,
            reference_landmarks=found.get("reference"),
            options=job.options,
        )
    with watch("write"):
        image = _encoded(job.output, result.image, photo)
    alignment = result.first.alignment
    metrics = {
        "eye_distance": round(here.interocular_distance, 3),
        "folded": round(alignment.folded, 6) if alignment else 0.0,
        "change": round(_mean_change(result), 6),
    }
    return Done([image], found, metrics)


def _mean_change(result: TransferResult) -> float:
    """Return by how much the face changed on average: of the log, without its sign."""
    share = np.ones(result.change.shape[:2]) if result.mask is None else result.mask
    total = float(share.sum())
    return float((np.abs(result.change).mean(axis=2) * share).sum()) / total if total else 0.0


def _normalize(job: Job, held: Held, watch: Stopwatch) -> Done:
    photo = _photo(job.target, held, watch)
    depth = photo.pixels.dtype if photo.pixels.dtype.kind == "u" else np.dtype(np.uint8)
    picture = replace(photo, pixels=np.zeros(photo.pixels.shape[:2], depth), alpha=None, profile=None)
    check_destination(NamedBytes(job.output), like=picture)
    here = _face(photo, job.target, job.target_landmarks, held, watch)
    distance = here.interocular_distance
    with watch("split"):
        v = normalize(
            photo.pixels,
            lam_for(here, job.options),
            neighborhood=job.options.neighborhood,
            interocular_distance=distance,
        )
    with watch("write"):
        image = _encoded(job.output, from_unit(v, depth), picture)
    return Done([image], {"target": here}, {"eye_distance": round(distance, 3)})


def _decompose(job: Job, held: Held, watch: Stopwatch) -> Done:
    photo = _photo(job.target, held, watch)
    here = _face(photo, job.target, job.target_landmarks, held, watch)
    distance = here.interocular_distance
    with watch("split"):
        split = decompose(
            photo.pixels,
            lam_for(here, job.options),
            neighborhood=job.options.neighborhood,
            interocular_distance=distance,
        )
    with watch("write"):
        pictures = [_encoded("split.png", picture) for picture in split_pictures(split)]
    return Done(pictures, {"target": here}, {"eye_distance": round(distance, 3)})


def _landmarks(job: Job, held: Held, watch: Stopwatch) -> Done:
    photo = _photo(job.target, held, watch)
    here = _face(photo, job.target, job.target_landmarks, held, watch)
    data = landmarks_as_bytes(job.output, here, image_name=Path(job.target).name)
    return Done([data], {"target": here}, {"eye_distance": round(here.interocular_distance, 3)})


def _encoded(name: str, pixels: Any, like: Photo | None = None) -> bytes:
    stream = NamedBytes(name)
    write_image(stream, pixels, like=like)
    return stream.getvalue()


#: What does a row, by the name of its kind; it gets what `Job.inputs` hold, by place.
WORK: dict[str, Callable[[Job, Held, Stopwatch], Done]] = {
    "transfer": _transfer,
    "normalize": _normalize,
    "decompose": _decompose,
    "landmarks": _landmarks,
}
