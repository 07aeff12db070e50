"""Fig. 1: every step from two photos to the relit one."""

from __future__ import annotations

from typing import TYPE_CHECKING

from examples.faces import relit_face
from relit.evaluate.yale_b import Light
from relit.figures import contact_sheet

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from examples.faces import Faces

PAPER = "the reference is warped to the target, both are split, and u of the one joins v of the other."


def draw(faces: Faces) -> tuple[NDArray[np.uint8], str]:
    """Relight one Yale B face by another."""
    result = relit_face(faces.lit("yaleB07"), faces.lit("yaleB04", 35, 15), mask=False)
    light = Light(35, 15)
    truth = faces.yale.aligned(faces.yale.photo("yaleB07", light), "yaleB07", light)
    error = abs(result.image - truth).mean() / 2.55
    unlit = abs(result.target - truth).mean() / 2.55
    ours = f"the same; the result is {error:.1f} % off the truth, as the target was by {unlit:.1f} %."
    return contact_sheet(result), ours
