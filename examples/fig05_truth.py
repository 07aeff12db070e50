"""Fig. 5: two faces lend light to each other, beside the truth."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from relit import TransferOptions
from relit.evaluate.cases import Case, swapped
from relit.evaluate.evaluation import images_of
from relit.evaluate.figure import truth_figure
from relit.evaluate.yale_b import FRONTAL, Light

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from examples.faces import Faces

PAPER = (
    "the relit face is near the photo that was taken in that light; most pixels differ by a few grey levels."
)


def draw(faces: Faces) -> tuple[NDArray[np.uint8], str]:
    """Swap a light from the side for one from the front."""
    return beside_truth(faces, "yaleB08", "yaleB04", Light(35, 15))


def beside_truth(faces: Faces, target: str, reference: str, light: Light) -> tuple[NDArray[np.uint8], str]:
    """Relight a frontal Yale B face by another in a light, and the other way round."""
    case = Case(target, "", (target, FRONTAL), (reference, light), (target, light))
    methods = {"ltv": TransferOptions(method="ltv")}
    rows = [
        (name, images_of(one, methods, faces.yaleb)[0], "ltv")
        for name, one in (("a", case), ("b", swapped(case)))
    ]
    found = []
    for name, images, method in rows:
        difference = np.abs(images.relit[method] - images.truth)
        near = (difference <= 25.5).mean()
        found.append(
            f"{name}: {difference.mean() / 2.55:.1f} % on average, {near:.0%} of the pixels within 10 %"
        )
    return truth_figure(rows), "; ".join(found) + "."
