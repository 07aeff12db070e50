"""Fig. 2: the reference laid over the target."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from examples.faces import relit_face
from relit import detect_landmarks
from relit.figures import landmark_overlay, page, strip

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from examples.faces import Faces

PAPER = "radial basis functions through landmarks placed by hand align the features of the two faces."


def draw(faces: Faces) -> tuple[NDArray[np.uint8], str]:
    """Warp one portrait onto another, and find the landmarks again."""
    target, reference = faces.portrait("005"), faces.portrait("136")
    warped = relit_face(target, reference, mask=False, method="moments").first.warped
    eyes = target.landmarks.interocular_distance

    def apart(points: NDArray[np.float64]) -> float:
        return float(np.linalg.norm(points - target.landmarks.xy, axis=1).mean() / eyes * 100)

    before, after = apart(reference.landmarks.xy), apart(detect_landmarks(warped).xy)
    panels = [
        ("target", landmark_overlay(*target)),
        ("reference", landmark_overlay(*reference)),
        ("reference, warped", warped),
        ("half of each", np.asarray((target.pixels / 2 + warped / 2).round(), np.uint8)),
    ]
    ours = (
        f"the same without a hand: all 478 landmarks lay {before:.1f} % of the eyes' distance apart on "
        f"average, and when they are found again on the warped reference, {after:.1f} %."
    )
    return page([strip(panels, 300)]), ours
