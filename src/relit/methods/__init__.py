"""Ways to relight a target by a reference that lies on it: ours, the paper's, and baselines."""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from typing import Any

from relit.methods import paper, shading
from relit.methods.light_change import LightChange
from relit.methods.scene import Relit, Scene


def _baseline(module: str, function: str) -> Callable[[Scene], Relit]:
    """Return a baseline that is imported when it is first asked for: SciPy comes along, and takes long."""

    def relight(scene: Scene) -> Relit:
        baseline: Any = import_module(f"relit.methods.baselines.{module}")
        made: Relit = getattr(baseline, function)(scene)
        return made

    return relight


#: Name in `TransferOptions` → what takes a `Scene` and relights it; `settings.methods` has a record of each.
RELIGHT: dict[str, Callable[[Scene], Relit | LightChange]] = {
    "shading": shading.relight,
    "ltv": paper.relight,
    "log-gaussian": _baseline("log_gaussian", "relight"),
    "wls": _baseline("wls", "relight"),
    "moments": _baseline("statistics", "match_moments"),
    "histogram": _baseline("statistics", "match_histogram"),
    "spherical-harmonics": _baseline("spherical_harmonics", "relight"),
    "quotient": _baseline("quotient", "quotient"),
    "expression-ratio": _baseline("quotient", "expression_ratio"),
}
