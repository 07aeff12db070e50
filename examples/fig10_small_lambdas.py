"""Fig. 10: what a small λ leaves of the light."""

from __future__ import annotations

from typing import TYPE_CHECKING

from examples.by_lambda import by_lambda

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from examples.faces import Faces

PAPER = "λ is the user's control: 0.01, 0.1 and 0.2 carry more and more of the reference's light; 0.2 works."


def draw(faces: Faces) -> tuple[NDArray[np.uint8], str]:
    """Relight a frontal face from the side by three λ."""
    return by_lambda(faces, ("yaleB07", 0, 0), ("yaleB08", 50, 0), (0.01, 0.1, 0.2))
