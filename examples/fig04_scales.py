"""Fig. 4: shapes of falling scale, parted by λ on either side of their 1/G."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from relit import tv_l1
from relit.figures import page, strip
from relit.ltv.g_value import scale_of

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from examples.faces import Faces

PAPER = "five shapes of falling G-value leave u one by one as λ falls past each 1/G: six λ part them all."
LEVELS = (220, 60, 190, 20, 250)  # of grey, on a ground of 128


def shapes() -> list[NDArray[np.bool_]]:
    """Return five shapes, the largest scale first, each on a plane of its own."""
    planes = [np.zeros((150, 220), bool) for _ in LEVELS]
    planes[0][20:90, 15:85] = True  # a square
    planes[1][15:45, 120:190] = True  # a bar
    planes[2][65:105, 105:121] = planes[2][89:105, 105:145] = True  # an L
    planes[3][70:100, 175:184] = planes[3][81:90, 164:195] = True  # a plus
    planes[4][115:119, 30:34] = True  # a dot
    return planes


def draw(faces: Faces) -> tuple[NDArray[np.uint8], str]:  # noqa: ARG001
    """Split an image of them."""
    planes = shapes()
    critical = [scale_of(plane).critical_lam for plane in planes]
    bounds = np.array([critical[0] / 2, *critical, 2 * critical[-1]])
    lams = np.sqrt(bounds[:-1] * bounds[1:])
    panels, exact = [], 0
    for count, lam in enumerate(lams):
        image = np.full(planes[0].shape, 128, np.uint8)
        for plane, level in zip(planes, LEVELS, strict=True):
            image[plane] = level
        u = tv_l1(image, float(lam))
        wanted = np.full_like(image, 128)
        for plane, level in zip(planes[:count], LEVELS, strict=False):
            wanted[plane] = level
        exact += bool((u == wanted).all())
        panels.append((f"u, lambda {lam:.3f}", u))
    strips = [strip([("the image", image)], 150), strip(panels[:3], 150), strip(panels[3:], 150)]
    g_values = ", ".join(f"{1 / lam:.2f}" for lam in critical)
    return page(
        strips
    ), f"with G = {g_values} px, {exact} of 6 λ leave in u just the shapes that they should, to the pixel."
