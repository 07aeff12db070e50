"""Fig. 7: light of a colour."""

from __future__ import annotations

from typing import TYPE_CHECKING

from examples.faces import errors_inside, in_light, relit_face
from relit.figures import page, strip

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from examples.faces import Faces

PAPER = "channel by channel, colour photos take on the light of colour photos, with its colour."
PAIRS = (("005", "136", (50, 10), (1.0, 0.75, 0.5)), ("062", "114", (-45, 25), (0.6, 0.8, 1.0)))


def draw(faces: Faces) -> tuple[NDArray[np.uint8], str]:
    """Relight portraits by portraits in rendered light, beside what the light would make of them."""
    strips, found = [], []
    for ours, theirs, light, color in PAIRS:
        target = faces.portrait(ours)
        reference = in_light(faces.portrait(theirs), *light, color)
        truth = in_light(target, *light, color).pixels
        result = relit_face(target, reference)
        errors = errors_inside(result, truth)
        found.append("{:.1f} % off the rendered truth in the face, the target {:.1f} %".format(*errors))
        panels = [
            ("target", target.pixels),
            ("reference", reference.pixels),
            ("relit", result.image),
            ("rendered", truth),
        ]
        strips.append(strip(panels, 300))
    return page(strips), "; ".join(found) + "."
