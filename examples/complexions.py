"""Twenty pairs of portraits across complexions, to see whose skin it is afterwards."""

from __future__ import annotations

from itertools import permutations
from typing import TYPE_CHECKING, Any

import numpy as np
from skimage.color import deltaE_ciede2000, rgb2lab

from examples.faces import relit_face
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
        # Both are looked at where the paper's method changes a photo: in the face.
        flat = in_photo(result, flat_lit(result)) & in_photo(by_ltv, by_ltv.mask)
        changes.append(hue_change(result, flat))
        ltv_changes.append(hue_change(by_ltv, flat))
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
    """Return where in the result's window both lights meet a face nearly straight on."""
    assert result.mask is not None
    face = result.mask > 0.5
    lights = [result.first.layers[name].mean(axis=-1) for name in ("target_light", "new_light")]
    bright = [light >= FLAT * np.quantile(light[face], 0.98) for light in lights]
    flat: NDArray[np.bool_] = face & bright[0] & bright[1]
    return flat


def in_photo(result: TransferResult, share: NDArray[Any] | None) -> NDArray[np.bool_]:
    """Return where in the photo a share of the window's pixels, 0 to 1, is more than a half."""
    whole = np.zeros(result.image.shape[:2], bool)
    whole[result.window] = np.asarray(share) > 0.5
    return whole


def hue_change(result: TransferResult, where: NDArray[np.bool_]) -> float:
    """Return the median ΔE2000 between relit face and target, after the one gain that fits best."""
    relit, target = (image[where] / 255 for image in (result.image, result.target))
    gain = (relit * target).sum() / (relit * relit).sum()
    lab = [rgb2lab(np.clip(image, 0, 1)[None]) for image in (gain * relit, target)]
    return float(np.median(deltaE_ciede2000(*lab)))  # type: ignore[no-untyped-call]
