"""Summing up how near to the truth methods come: means, how certain these are, and rows of a table."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import asdict, dataclass
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from relit.evaluate.evaluation import BASELINES, Outcome
from relit.evaluate.yale_b import Light

_DRAWS = 2000  # of the bootstrap


@dataclass(frozen=True)
class Summary:
    """The mean of a score, with the bounds of its 95 % confidence interval over pairs.

    Attributes
    ----------
    method, group, figure : str
        Of what: the group is ``all`` or one of the cases' groups, the figure one of the scores'.
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


def summaries(outcomes: Iterable[Outcome], *, overall: bool = True) -> list[Summary]:
    """Sum up outcomes by method, and by all cases and each group of them.

    Confidence intervals are those of a bootstrap that draws whole pairs, since what a pair of faces scores
    under one light says much of what it scores under the next.

    Parameters
    ----------
    outcomes : iterable of Outcome
        Scores of one kind.
    overall : bool
        Whether all are summed up together, too; not so where groups are several truths of one transfer.
    """
    outcomes = list(outcomes)
    groups = sorted({outcome.case.group for outcome in outcomes} - {"all"})
    methods = sorted({outcome.method for outcome in outcomes}, key=lambda m: (m not in BASELINES, m))
    result = []
    for group, method in product(("all", *groups) if overall else groups, methods):
        chosen = [one for one in outcomes if one.method == method and group in ("all", one.case.group)]
        names, pair = np.unique([one.case.pair for one in chosen], return_inverse=True)
        for figure in asdict(chosen[0].scores):
            values = np.array([getattr(one.scores, figure) for one in chosen])
            low, high = _interval(values, pair, len(names))
            mean = float(values.mean())
            result.append(Summary(method, group, figure, mean, low, high, len(chosen), len(names)))
    return result


def _interval(values: NDArray[np.float64], pair: NDArray[np.int64], pairs: int) -> tuple[float, float]:
    sums, counts = np.bincount(pair, values, pairs), np.bincount(pair, minlength=pairs)
    drawn = np.random.default_rng(0).integers(0, pairs, (_DRAWS, pairs))
    means = sums[drawn].sum(axis=1) / counts[drawn].sum(axis=1)
    low, high = np.percentile(means, [2.5, 97.5]).tolist()
    return low, high


def as_record(outcome: Outcome) -> dict[str, Any]:
    """Return an outcome as the row of a table."""

    def name(part: Any) -> str:
        return f"{part.azimuth:+04d}{part.elevation:+03d}" if isinstance(part, Light) else str(part)

    case = outcome.case
    photos = {"target": case.target, "reference": case.reference, "truth": case.truth}
    return {
        **{role: " ".join(map(name, where)) for role, where in photos.items()},
        "group": case.group,
        "method": outcome.method,
        **asdict(outcome.scores),
        "seconds": outcome.seconds,
    }
