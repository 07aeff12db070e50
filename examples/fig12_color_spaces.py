"""Fig. 12: colour spaces, all channels against the primary one."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

import numpy as np

from examples.faces import in_light, inside, relit_face
from relit.figures import page, strip

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from examples.faces import Faces

PAPER = (
    "all channels of RGB, HSV and YCbCr give nearly the same; the primary one alone is three times as fast."
)
CHOICES = [
    ("rgb", "all"),
    ("hsv", "all"),
    ("hsv", "primary"),
    ("hsv", "v"),
    ("ycbcr", "all"),
    ("ycbcr", "primary"),
]
TIMES = 3


def draw(faces: Faces) -> tuple[NDArray[np.uint8], str]:
    """Relight a portrait in every one."""
    target, reference = faces.portrait("005"), in_light(faces.portrait("136"), 50, 10)
    results, seconds = {}, dict.fromkeys(CHOICES, np.inf)
    for _ in range(TIMES):
        for space, channels in CHOICES:
            start = time.perf_counter()
            results[space, channels] = relit_face(target, reference, color_space=space, channels=channels)
            seconds[space, channels] = min(seconds[space, channels], time.perf_counter() - start)
    rgb = results["rgb", "all"]
    panels, found = [("target", target.pixels), ("reference", reference.pixels)], []
    for choice, result in results.items():
        panels.append((" ".join(choice), result.image))
        if choice != ("rgb", "all"):
            off = np.abs(inside(rgb, result.image) - inside(rgb, rgb.image)).mean() / 2.55
            found.append(f"{' '.join(choice)} differs from RGB by {off:.1f} %")
    faster = [seconds[space, "all"] / seconds[space, "primary"] for space in ("hsv", "ycbcr")]
    ours = (
        "; ".join(found)
        + ". The primary channel alone is {:.1f} and {:.1f} times as fast as all of HSV and YCbCr, the "
        "alignment included. H alone carries hue and no light: V is what to take of HSV.".format(*faster)
    )
    return page([strip(panels[:4], 260), strip(panels[4:], 260)]), ours
