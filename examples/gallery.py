"""Which figures there are."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from examples.faces import Faces

#: Names of modules.
FIGURES = (
    "fig01_pipeline",
    "fig02_warp",
    "fig03_split",
    "fig04_scales",
    "fig05_truth",
    "fig06_truth",
    "average",
    "fig07_color",
    "fig08_side_views",
    "fig09_coloring",
    "fig10_small_lambdas",
    "fig11_shadowed_target",
    "fig12_color_spaces",
    "complexions",
)


def figure(name: str, faces: Faces) -> tuple[str, NDArray[np.uint8], str]:
    """Return what the paper shows, the picture, and what we see."""
    module = import_module(f"examples.{name}")
    picture, ours = module.draw(faces)
    return module.PAPER, picture, ours
