"""Twenty pairs of portraits across complexions, to see whose skin it is afterwards."""

from __future__ import annotations

from itertools import permutations
from typing import TYPE_CHECKING

import numpy as np
from skimage.color import deltaE_ciede2000, rgb2lab

from examples.faces import inside, relit_face
from examples.sheets import columns
from relit.figures import strip

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from examples.faces import Faces
    from relit import TransferResult

PAPER = (
    "faces of different complexions are outside its reach: the reference's skin comes along with its light."
)
PORTRAITS = (
    "096",
    "062",
    "017",
    "136",
    "030",
)  # from dark to light, and every one lends its light to every other
FLAT = 0.8  # of the light's strength


def draw(faces: Faces) -> tuple[NDArray[np.uint8], str]:
    """Relight each of five by each other, by our method and the paper's."""
    strips, changes, ltv_changes = [], [], []
    for ours, theirs in permutations(PORTRAITS, 2):
        target, reference = faces.portrait(ours), faces.portrait(theirs)
        result = relit_face(target, reference, method="shading")
        by_ltv = relit_face(target, reference)
        changes.append(hue_change(result, flat_lit(result)))
        ltv_changes.append(hue_change(by_ltv, flat_lit(result)))
        panels = [
            (f"target {ours}", target.pixels),
            (f"reference {theirs}", reference.pixels),
            (f"ltv: {ltv_changes[-1]:.1f}", by_ltv.image),
            (f"shading: {changes[-1]:.1f}", result.image),
        ]
        region = result.window
        strips.append(
            strip(
                [(name, one[region] if one.shape == target.pixels.shape else one) for name, one in panels],
                220,
            )
        )
    ours = (
        f"the skin in flat light changes by a median ΔE2000 of {np.median(changes):.1f} (largest "
        f"{max(changes):.1f}) over the 20 pairs after the best gain; by the paper's method by "
        f"{np.median(ltv_changes):.1f} (largest {max(ltv_changes):.1f})."
    )
    return columns(strips, 2), ours


def flat_lit(result: TransferResult) -> NDArray[np.bool_]:
    """Return which pixels of the face both lights meet nearly straight on."""
    assert result.mask is not None
    lights = [
        result.first.layers[name].mean(axis=-1)[result.mask > 0.5] for name in ("target_light", "new_light")
    ]
    flat: NDArray[np.bool_] = np.logical_and(*(light >= FLAT * np.quantile(light, 0.98) for light in lights))
    return flat


def hue_change(result: TransferResult, where: NDArray[np.bool_]) -> float:
    """Return the median ΔE2000 between relit face and target, after the one gain that fits best."""
    relit, target = (inside(result, image)[where] / 255 for image in (result.image, result.target))
    gain = (relit * target).sum() / (relit * relit).sum()
    lab = [rgb2lab(np.clip(image, 0, 1)[None]) for image in (gain * relit, target)]
    return float(np.median(deltaE_ciede2000(*lab)))  # type: ignore[no-untyped-call]
