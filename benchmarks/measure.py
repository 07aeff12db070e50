"""Timing things side by side."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np


@dataclass(frozen=True)
class Timing:
    """Median and interquartile range of some runs, in seconds."""

    median: float
    iqr: float
    runs: int

    @classmethod
    def of(cls, seconds: list[float]) -> Timing:
        """Sum up the runs."""
        low, middle, high = np.percentile(seconds, [25, 50, 75])
        return cls(float(middle), float(high - low), len(seconds))


def side_by_side(
    runs: int, functions: Mapping[str, Callable[[], Any]]
) -> tuple[dict[str, Timing], dict[str, Any]]:
    """Run every function in turn, several times over; return their timings and last results.

    Taking turns spreads what the machine does besides over all of them alike.
    """
    seconds: dict[str, list[float]] = {name: [] for name in functions}
    results: dict[str, Any] = {}
    for _ in range(runs):
        for name, function in functions.items():
            start = time.perf_counter()
            results[name] = function()
            seconds[name].append(time.perf_counter() - start)
    return {name: Timing.of(times) for name, times in seconds.items()}, results


def exponent(costs: Mapping[int, float]) -> float:
    """Return k of the power law ``cost ∝ size ** k`` nearest to some costs by size."""
    slope, _ = np.polyfit(np.log(list(costs)), np.log(list(costs.values())), 1)
    return float(slope)
