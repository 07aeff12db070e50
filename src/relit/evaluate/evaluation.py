"""Running relit over pairs of photos whose true result is known, and scoring how near it comes."""

from __future__ import annotations

import signal
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass, replace
from functools import lru_cache, partial
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from relit.errors import ImageError, RelitError
from relit.evaluate.cases import Case
from relit.evaluate.face_scores import FaceScores, face_scores
from relit.evaluate.heads import Heads, is_of_heads
from relit.evaluate.scores import Scores, score
from relit.evaluate.yale_b import YaleB, pixels_of
from relit.face.detect import detect_landmarks
from relit.face.landmarks import Landmarks
from relit.photo.color import luma
from relit.photo.pixels import to_unit
from relit.relighting import transfer
from relit.results import TransferResult
from relit.runtime.engine import check_main
from relit.settings.methods import WITH_SECOND_REFERENCE
from relit.settings.options import TransferOptions
from relit.warp.alignment import lay_over

#: What costs nothing and must be beaten: the target as it is, and the reference laid over it.
BASELINES = ("noop", "refcopy")


@dataclass(frozen=True)
class Outcome:
    """What a method scored in a case, and how long it took in seconds."""

    case: Case
    method: str
    scores: Scores | FaceScores
    seconds: float


@dataclass(frozen=True, eq=False)
class Images:
    """The images of a case, on the target's frame, of values 0 to 255."""

    target: NDArray[Any]
    reference: NDArray[Any]
    truth: NDArray[Any]
    relit: dict[str, NDArray[Any]]


class _Files:
    """Photos by their paths, read as a Yale B folder is."""

    photo = staticmethod(pixels_of)

    @staticmethod
    @lru_cache(maxsize=64)
    def landmarks(path: Path) -> Landmarks:
        return detect_landmarks(pixels_of(path), name=str(path))

    @staticmethod
    def aligned(image: NDArray[np.float64], _path: Path) -> NDArray[np.float64]:
        return image


@lru_cache(maxsize=1)
def _photos_of(folder: Path | None) -> _Files | YaleB | Heads:
    if folder is None:
        return _Files()
    return Heads(folder) if is_of_heads(folder) else YaleB(folder)


def images_of(
    case: Case, methods: Mapping[str, TransferOptions], folder: Path | None
) -> tuple[Images, dict[str, float]]:
    """Relight a case by every method; return its images, and the seconds that each took.

    Of rendered heads the options say whether the whole image is relit, and the reference is laid over the
    face alone; of all else it is, and over all. All images come with the channels of the truth: grey or
    colour.

    Raises
    ------
    OptionError
        If a method takes a second reference and the case has none.
    ImageError
        If the truth of a table is not of the target's size.
    """
    photos = _photos_of(folder)
    target, reference = photos.photo(*case.target), photos.photo(*case.reference)
    truth = photos.aligned(_levels(photos.photo(*case.truth)), *case.truth)
    if isinstance(photos, _Files) and truth.shape[:2] != target.shape[:2]:
        (height, width), (rows, columns) = target.shape[:2], truth.shape[:2]
        raise ImageError(
            f"{case.truth[0]}: expected {width}x{height} px, as its target has, got {columns}x{rows}; crop it"
        )

    def beside_truth(image: NDArray[Any]) -> NDArray[Any]:
        return photos.aligned(_levels(image, truth.ndim), *case.target)

    relit, seconds = {"noop": beside_truth(target)}, dict.fromkeys(BASELINES, 0.0)
    for name, options in methods.items():
        second: dict[str, Any] = {}
        if options.method in WITH_SECOND_REFERENCE and case.second_reference:
            second["second_reference"] = photos.photo(*case.second_reference)
            second["second_landmarks"] = photos.landmarks(*case.second_reference)
        start = time.perf_counter()
        result = transfer(
            target,
            reference,
            target_landmarks=photos.landmarks(*case.target),
            reference_landmarks=photos.landmarks(*case.reference),
            options=options if isinstance(photos, Heads) else options.changed(mask=False),
            **second,
        )
        seconds[name] = time.perf_counter() - start
        laid = _laid_over(target, result)
        if isinstance(photos, Heads):
            laid = np.where(photos.mask(case.target[0], "face")[..., None], laid, target)
        relit |= {"refcopy": beside_truth(laid), name: beside_truth(result.image)}
    return Images(relit["noop"], _levels(reference, truth.ndim), truth, relit), seconds


def _laid_over(target: NDArray[Any], result: TransferResult) -> NDArray[Any]:
    """Return the reference, laid over the whole target at its own size."""
    laid, options = result.first.warped, result.options
    if laid.shape[:2] == target.shape[:2]:
        return laid
    return lay_over(
        result.references[0],
        result.references_landmarks[0],
        result.target_landmarks,
        target.shape,
        kernel=options.kernel,
        affine=options.affine,
        smoothing=options.smoothing,
        dtype=target.dtype,
    ).warped


def _levels(image: NDArray[Any], ndim: int | None = None) -> NDArray[np.float64]:
    """Return an image in grey levels of 255, grey or in colour as it has so many dimensions."""
    levels = to_unit(image).astype(np.float64) * 255
    if ndim in (None, levels.ndim):
        return levels
    return luma(levels) if ndim == 2 else np.repeat(levels[..., None], 3, axis=2)


def _outcomes(case: Case, methods: Mapping[str, TransferOptions], folder: Path | None) -> list[Outcome]:
    images, seconds = images_of(case, methods, folder)
    return [
        Outcome(one, name, score_of(image), seconds[name])
        for one, score_of in _truths(case, images, _photos_of(folder))
        for name, image in images.relit.items()
    ]


_Judge = Callable[[NDArray[Any]], Scores | FaceScores]


def _truths(case: Case, images: Images, photos: _Files | YaleB | Heads) -> Iterator[tuple[Case, _Judge]]:
    """Yield the case with each of its truths, and what scores an image against that.

    Where a coloured light falls on a head that was in white light, the head in the same light made white is
    a truth as well, for those who take the light without its colour.
    """
    if not isinstance(photos, Heads):
        yield case, lambda image: score(image, images.truth, images.relit["refcopy"])
        return
    (person, own), (_, light) = case.target, case.truth
    areas = {area: photos.mask(person, area) for area in ("face", "background")}
    yield case, partial(face_scores, truth=images.truth, target=images.target, **areas)
    white = photos.white(person, light)
    if white and not photos.white(person, own):
        truth = _levels(photos.photo(person, white))
        one = replace(case, truth=(person, white), group=f"{case.group} made white")
        yield one, partial(face_scores, truth=truth, target=images.target, **areas)


def evaluate(
    cases: Sequence[Case],
    methods: Mapping[str, TransferOptions],
    *,
    folder: Path | None = None,
    jobs: int = 1,
) -> Iterator[list[Outcome]]:
    """Score methods and the baselines on every case; yield the outcomes of one case at a time, in any order.

    Parameters
    ----------
    cases : sequence of Case
        From `cases.protocol_cases`, `cases.head_cases` or `cases.triple_cases`.
    methods : mapping of str to TransferOptions
        How to relight, by name.
    folder : Path, optional
        The folder that the cases are of, of Yale B or of heads.
    jobs : int
        Processes to work in.

    Raises
    ------
    RelitError
        If a photo cannot be used, or a process dies.
    """
    outcomes_of = partial(_outcomes, methods=methods, folder=folder)
    if jobs == 1:
        yield from map(outcomes_of, cases)
        return
    check_main()
    # Forking a process that has threads can hang it.
    with ProcessPoolExecutor(jobs, get_context("spawn"), _prepare_process) as pool:
        futures = [pool.submit(outcomes_of, case) for case in cases]
        try:
            for done in as_completed(futures):
                yield done.result()
        except BrokenProcessPool as error:
            raise RelitError(
                "jobs: a process of the evaluation died, as it does where memory runs out, or where a script "
                'has no line if __name__ == "__main__":; use fewer of them'
            ) from error
        finally:
            pool.shutdown(wait=False, cancel_futures=True)


def _prepare_process() -> None:
    """Keep the processes' linear algebra out of one another's way, and leave Ctrl-C to their parent."""
    threadpool_limits(1)
    signal.signal(signal.SIGINT, signal.SIG_IGN)
