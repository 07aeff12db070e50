"""Fig. 3: two faces, each split by two λ."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from relit import decompose
from relit.figures import page, split_pictures, strip

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from examples.faces import Faces

PAPER = "u keeps the light and v the person; with λ = 0.5 instead of 0.2 more of the face is in u."
LAMS = (0.2, 0.5)


def draw(faces: Faces) -> tuple[NDArray[np.uint8], str]:
    """Split two Yale B faces."""
    strips, shares = [], []
    for face in (faces.lit("yaleB01", 50, 0), faces.lit("yaleB09", -35, 40)):
        panels = [("face", face.pixels)]
        for lam in LAMS:
            split = decompose(face.pixels, lam)
            shares.append(variation(np.log(split.u)) / variation(np.log(split.u * split.v)))
            panels += zip((f"u, lambda {lam}", f"v, lambda {lam}"), split_pictures(split), strict=True)
        strips.append(strip(panels, 260))
    fine, coarse = (np.mean(shares[i::2]) for i in (0, 1))
    return page(
        strips
    ), f"u has {fine:.0%} of the total variation of log I with λ = 0.2, and {coarse:.0%} with 0.5."


def variation(plane: NDArray[np.float32]) -> float:
    """Return the total variation over four neighbours."""
    return float(sum(np.abs(np.diff(plane, axis=axis)).sum() for axis in (0, 1)))
