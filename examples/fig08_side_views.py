"""Fig. 8: faces seen from the side."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from examples.faces import Face, errors_inside, in_light, relit_face, turned
from relit import detect_landmarks
from relit.figures import page, strip

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from examples.faces import Faces

PAPER = "with landmarks placed by hand on both, faces seen from the side are relit as well."
ANGLES = (30, 45, 60)
LIGHT = (40, 15)


def draw(faces: Faces) -> tuple[NDArray[np.uint8], str]:
    """Turn two portraits, find their landmarks, and relight one by the other."""
    target, reference = faces.portrait("005"), faces.portrait("067")
    strips, found = [], []
    for angle in ANGLES:
        ours, theirs = turned(target, angle), turned(in_light(reference, *LIGHT), angle)
        truth = turned(in_light(target, *LIGHT), angle)
        detected = [Face(view.pixels, detect_landmarks(view.pixels)) for view in (ours, theirs)]
        result = relit_face(*detected)
        errors = errors_inside(result, truth.pixels)
        miss = np.linalg.norm(detected[0].landmarks.xy - ours.landmarks.xy, axis=1).mean()
        miss *= 100 / target.landmarks.interocular_distance
        found.append(
            f"{angle}°: {errors[0]:.1f} % off the rendered truth (target {errors[1]:.1f} %), landmarks found "
            f"to {miss:.1f} % of the eyes' distance"
        )
        panels = [
            (f"target, turned {angle}°", ours.pixels[result.window]),
            ("reference", theirs.pixels[result.window]),
            ("relit", result.image[result.window]),
            ("rendered", truth.pixels[result.window]),
        ]
        strips.append(strip(panels, 280))
    return page(strips), "; ".join(found) + "."
