"""Ways to relight a target by a reference that lies on it: ours, the paper's, and baselines."""

from __future__ import annotations

from collections.abc import Callable

from relit.methods import paper, shading
from relit.methods.baselines import log_gaussian, quotient, spherical_harmonics, statistics, wls
from relit.methods.light_change import LightChange
from relit.methods.scene import Relit, Scene

#: Name in `TransferOptions` → what takes a `Scene` and relights it; `settings.methods` has a record of each.
RELIGHT: dict[str, Callable[[Scene], Relit | LightChange]] = {
    "shading": shading.relight,
    "ltv": paper.relight,
    "log-gaussian": log_gaussian.relight,
    "wls": wls.relight,
    "moments": statistics.match_moments,
    "histogram": statistics.match_histogram,
    "spherical-harmonics": spherical_harmonics.relight,
    "quotient": quotient.quotient,
    "expression-ratio": quotient.expression_ratio,
}
