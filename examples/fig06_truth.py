"""Fig. 6: the same as Fig. 5 with two other faces and a harder light."""

from __future__ import annotations

from typing import TYPE_CHECKING

from examples.fig05_truth import PAPER as PAPER
from examples.fig05_truth import beside_truth
from relit.evaluate.yale_b import Light

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from examples.faces import Faces


def draw(faces: Faces) -> tuple[NDArray[np.uint8], str]:
    """Take a light from far to the other side."""
    return beside_truth(faces, "yaleB09", "yaleB07", Light(-60, 20))
