"""Running relit over pairs of photos whose true result is known, and summing up how near it comes."""

from __future__ import annotations

import signal
import time
from collections.abc import Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from dataclasses import asdict, dataclass
from functools import lru_cache, partial
from multiprocessing import get_context
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from threadpoolctl import threadpool_limits

from relit.errors import RelitError
from relit.evaluate.cases import Case
from relit.evaluate.scores import Scores, score
from relit.evaluate.yale_b import Light, YaleB
from relit.face.detect import detect_landmarks
from relit.methods import WITH_SECOND_REFERENCE
from relit.photo.color import luma
from relit.photo.pixels import to_unit
from relit.photo.reading import read_image
from relit.relighting import transfer
from relit.settings.options import TransferOptions

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from relit.face.landmarks import Landmarks

#: What costs nothing and must be beaten: the target as it is, and the reference laid over it.
BASELINES = ("noop", "refcopy")

_DRAWS = 2000  # of the bootstrap


@dataclass(frozen=True)
class Outcome:
    """What a method scored in a case, and how long it took in seconds."""

    case: Case
    method: str
    scores: Scores
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

    def photo(self, path: Path) -> NDArray[Any]:
        return _opened(path)

    def landmarks(self, path: Path) -> Landmarks:
        return _detected(path)

    def aligned(self, image: NDArray[np.float64], path: Path) -> NDArray[np.float64]:  # noqa: ARG002
        return image


@lru_cache(maxsize=64)
def _opened(path: Path) -> NDArray[Any]:
    return read_image(path).pixels


@lru_cache(maxsize=64)
def _detected(path: Path) -> Landmarks:
    return detect_landmarks(_opened(path), name=str(path))


@lru_cache(maxsize=1)
def _yale_b(folder: Path) -> YaleB:
    return YaleB(folder)


def images_of(
    case: Case, methods: Mapping[str, TransferOptions], folder: Path | None
) -> tuple[Images, dict[str, float]]:
    """Relight a case by every method; return its images, and the seconds that each took.

    The whole image is relit. All images come with the channels of the truth: grey or colour.

    Raises
    ------
    OptionError
        If a method takes a second reference and the case has none.
    """
    source = _Files() if folder is None else _yale_b(folder)
    target, reference = source.photo(*case.target), source.photo(*case.reference)
    truth = source.aligned(_in_grey_levels(source.photo(*case.truth)), *case.truth)

    def place(image: NDArray[Any]) -> NDArray[Any]:
        return _with_channels_of(truth, source.aligned(_in_grey_levels(image), *case.target))

    relit, seconds = {"noop": place(target)}, dict.fromkeys(BASELINES, 0.0)
    for name, options in methods.items():
        second: dict[str, Any] = {}
        if options.method in WITH_SECOND_REFERENCE and case.second_reference:
            second["second_reference"] = source.photo(*case.second_reference)
            second["second_landmarks"] = source.landmarks(*case.second_reference)
        start = time.perf_counter()
        result = transfer(
            target,
            reference,
            target_landmarks=source.landmarks(*case.target),
            reference_landmarks=source.landmarks(*case.reference),
            options=options.changed(mask=False),
            **second,
        )
        seconds[name] = time.perf_counter() - start
        relit |= {"refcopy": place(result.first.warped), name: place(result.image)}
    shown = _with_channels_of(truth, _in_grey_levels(reference))
    return Images(relit["noop"], shown, truth, relit), seconds


def _in_grey_levels(image: NDArray[Any]) -> NDArray[np.float64]:
    return to_unit(image).astype(np.float64) * 255


def _with_channels_of(truth: NDArray[Any], image: NDArray[Any]) -> NDArray[Any]:
    if image.ndim == truth.ndim:
        return image
    return luma(image) if truth.ndim == 2 else np.repeat(image[..., None], 3, axis=2)


def _outcomes(case: Case, methods: Mapping[str, TransferOptions], folder: Path | None) -> list[Outcome]:
    images, seconds = images_of(case, methods, folder)
    return [
        Outcome(case, name, score(image, images.truth, images.relit["refcopy"]), seconds[name])
        for name, image in images.relit.items()
    ]


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
        From `cases.protocol_cases` or `cases.triple_cases`.
    methods : mapping of str to TransferOptions
        How to relight, by name.
    folder : Path, optional
        The Yale B folder that the cases are of.
    jobs : int
        Processes to work in.

    Raises
    ------
    RelitError
        If a photo cannot be used, or a process dies.
    """
    work = partial(_outcomes, methods=methods, folder=folder)
    if jobs == 1:
        yield from map(work, cases)
        return
    # Forking a process that has threads can hang it.
    with ProcessPoolExecutor(jobs, get_context("spawn"), _prepare_process) as pool:
        futures = [pool.submit(work, case) for case in cases]
        try:
            for done in as_completed(futures):
                yield done.result()
        except BrokenProcessPool as error:
            raise RelitError(
                "jobs: a process of the evaluation died, as it does where memory runs out; use fewer of them"
            ) from error
        finally:
            pool.shutdown(wait=False, cancel_futures=True)


def _prepare_process() -> None:
    """Keep the processes' linear algebra out of one another's way, and leave Ctrl-C to their parent."""
    threadpool_limits(1)
    signal.signal(signal.SIGINT, signal.SIG_IGN)


@dataclass(frozen=True)
class Summary:
    """The mean of a figure, with the bounds of its 95 % confidence interval over pairs.

    Attributes
    ----------
    method, group, figure : str
        Of what: the group is ``all`` or one of the cases' groups.
    mean, low, high : float
    cases, pairs : int
        How many it is over.
    """

    method: str
    group: str
    figure: str
    mean: float
    low: float
    high: float
    cases: int
    pairs: int


def summaries(outcomes: Iterable[Outcome]) -> list[Summary]:
    """Sum up outcomes by method, and by all cases and each group of them.

    Confidence intervals are those of a bootstrap that draws whole pairs, since what a pair of faces scores
    under one light says much of what it scores under the next.
    """
    outcomes = list(outcomes)
    groups = sorted({outcome.case.group for outcome in outcomes} - {"all"})
    methods = sorted({outcome.method for outcome in outcomes}, key=lambda m: (m not in BASELINES, m))
    result = []
    for group in ("all", *groups):
        for method in methods:
            chosen = [o for o in outcomes if o.method == method and group in ("all", o.case.group)]
            pairs = sorted({outcome.case.pair for outcome in chosen})
            index = np.array([pairs.index(outcome.case.pair) for outcome in chosen])
            for figure in Scores.__dataclass_fields__:
                values = np.array([getattr(outcome.scores, figure) for outcome in chosen])
                low, high = _interval(values, index, len(pairs))
                result.append(
                    Summary(method, group, figure, float(values.mean()), low, high, len(chosen), len(pairs))
                )
    return result


def _interval(values: NDArray[np.float64], pair: NDArray[np.int64], pairs: int) -> tuple[float, float]:
    sums, counts = np.bincount(pair, values, pairs), np.bincount(pair, minlength=pairs)
    drawn = np.random.default_rng(0).integers(0, pairs, (_DRAWS, pairs))
    means = sums[drawn].sum(axis=1) / counts[drawn].sum(axis=1)
    low, high = np.percentile(means, [2.5, 97.5])
    return float(low), float(high)


def as_record(outcome: Outcome) -> dict[str, Any]:
    """Return an outcome as the row of a table."""
    case = outcome.case
    names = {
        role: " ".join(
            str(part) if not isinstance(part, Light) else "{:+04d}{:+03d}".format(*part) for part in where
        )
        for role, where in (("target", case.target), ("reference", case.reference), ("truth", case.truth))
    }
    return {
        **names,
        "group": case.group,
        "method": outcome.method,
        **asdict(outcome.scores),
        "seconds": outcome.seconds,
    }
