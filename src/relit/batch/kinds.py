"""What a row does, kind by kind: from the bytes that were read to those that are to be written."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from relit.errors import FaceNotFoundError
from relit.face.landmark_files import landmarks_as_bytes, landmarks_from
from relit.face.landmarks import check_inside
from relit.photo.atomic_files import NamedBytes
from relit.photo.writing import check_destination, write_image
from relit.relighting import transfer
from relit.result_files import check_results_destination, not_kept_of, write_results
from relit.splitting import Splitting, grey_like

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from relit.batch.jobs import Job
    from relit.batch.reading import Content
    from relit.face.landmarks import Landmarks
    from relit.photo.photo import Photo
    from relit.results import TransferResult
    from relit.runtime.timing import Stopwatch


class Doing:
    """A row under way: what `Job.inputs` hold, by place, and what is measured and lost meanwhile."""

    def __init__(self, job: Job, held: Mapping[str, Content], watch: Stopwatch) -> None:
        self.job, self.watch, self._held = job, watch, held
        self.measured: dict[str, float] = {}
        self.not_kept: tuple[str, ...] = ()

    def photo(self, place: str) -> Photo:
        """Return the photo at a place that was read."""
        with self.watch("read"):
            return self._held[place].photo

    def face(self, photo: Photo, role: str) -> Landmarks:
        """Return where the face is in the photo of a role: as the row gives it, or by looking."""
        place: str = getattr(self.job, role)
        marks: str | None = getattr(self.job, f"{role}_landmarks")
        with self.watch("find the face"):
            if marks is not None:
                found = landmarks_from(self._held[marks].data, marks)
                check_inside(found, photo.pixels.shape, marks)
            else:
                try:
                    found = self._held[place].face
                except FaceNotFoundError as error:
                    told = str(error).replace("--landmarks FILE", "a column of landmarks in the manifest")
                    raise FaceNotFoundError(told) from None
        if found.confidence is not None:
            self.measured[f"{role}_confidence"] = found.confidence
        if role == "target":
            self.measured["eye_distance"] = round(found.interocular_distance, 3)
        return found

    def encoded(self, name: str, pixels: Any) -> bytes:
        """Return a photo as a file of this name holds it."""
        stream = NamedBytes(name)
        with self.watch("write"):
            write_image(stream, pixels)
        return stream.getvalue()


def _transfer(row: Doing) -> list[bytes]:
    job, photo = row.job, row.photo(row.job.target)
    check_results_destination(NamedBytes(job.output), like=photo)
    here, light, there = row.face(photo, "target"), None, None
    if job.reference is not None:
        light = row.photo(job.reference)
        there = row.face(light, "reference")
    with row.watch("relight"):
        result = transfer(photo, light, target_landmarks=here, reference_landmarks=there, options=job.options)
    alignment = result.first.alignment
    row.measured["folded"] = round(alignment.folded, 6) if alignment else 0.0
    row.measured["change"] = round(_mean_change(result), 6)
    stream = NamedBytes(job.output)
    with row.watch("write"):
        write_results(stream, [result], like=photo)
        row.not_kept = not_kept_of(stream, photo)
    return [stream.getvalue()]


def _mean_change(result: TransferResult) -> float:
    """Return by how much the face changed on average: of the log, without its sign."""
    share = np.ones(result.change.shape[:2]) if result.mask is None else result.mask
    total = float(share.sum())
    return float((np.abs(result.change).mean(axis=2) * share).sum()) / total if total else 0.0


def _normalize(row: Doing) -> list[bytes]:
    photo = row.photo(row.job.target)
    check_destination(NamedBytes(row.job.output), like=grey_like(photo))
    here = row.face(photo, "target")
    with row.watch("split"):
        picture = Splitting.of(here, row.job.options).normalized(photo)
    return [row.encoded(row.job.output, picture)]


def _decompose(row: Doing) -> list[bytes]:
    photo = row.photo(row.job.target)
    here = row.face(photo, "target")
    with row.watch("split"):
        pictures = Splitting.of(here, row.job.options).decomposed(photo)
    return [row.encoded("split.png", picture) for picture in pictures]


def _landmarks(row: Doing) -> list[bytes]:
    here = row.face(row.photo(row.job.target), "target")
    return [landmarks_as_bytes(row.job.output, here, image_name=Path(row.job.target).name)]


#: What does a row, by the name of its kind: returns what is to be written, in the order of `Job.files`.
WORK: dict[str, Callable[[Doing], list[bytes]]] = {
    "transfer": _transfer,
    "normalize": _normalize,
    "decompose": _decompose,
    "landmarks": _landmarks,
}
