"""Fig. 11: a target with shadows of its own."""

from __future__ import annotations

from typing import TYPE_CHECKING

from examples.by_lambda import by_lambda

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from examples.faces import Faces

PAPER = "shadows of the target stay in v; a larger λ, 0.5 or 0.8 for 0.2, takes more of them away by hand."


def draw(faces: Faces) -> tuple[NDArray[np.uint8], str]:
    """Relight a face lit from the side from the front by three λ."""
    return by_lambda(faces, ("yaleB07", 60, 20), ("yaleB08", 0, 0), (0.2, 0.5, 0.8))
