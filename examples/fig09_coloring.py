"""Fig. 9: a grey photo takes the colours of a colour photo."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from examples.faces import inside, relit_face
from relit.figures import page, strip
from relit.photo.color import luma

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from examples.faces import Faces

PAPER = "u of a colour reference gives a grey face its colours, and its light."
PAIRS = (("005", "136"), ("096", "114"))


def draw(faces: Faces) -> tuple[NDArray[np.uint8], str]:
    """Colour portraits that were made grey, beside their own colours."""
    strips, found = [], []
    for ours, theirs in PAIRS:
        target, reference = faces.portrait(ours), faces.portrait(theirs)
        grey = target._replace(pixels=np.asarray(np.rint(luma(target.pixels.astype(float))), np.uint8))
        result = relit_face(grey, reference)
        chroma = [np.ptp(inside(result, image), axis=-1).mean() for image in (result.image, target.pixels)]
        found.append(
            "largest less smallest channel in the face: {:.0f}, and {:.0f} of its own colours".format(*chroma)
        )
        panels = [
            ("target", grey.pixels),
            ("reference", reference.pixels),
            ("coloured", result.image),
            ("its own colours", target.pixels),
        ]
        strips.append(strip(panels, 300))
    return page(strips), "; ".join(found) + "."
