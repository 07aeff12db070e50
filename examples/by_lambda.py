"""One transfer of Yale B by several λ, beside its truth."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from examples.faces import relit_face
from relit.evaluate.scores import score
from relit.evaluate.yale_b import Light
from relit.figures import page, split_pictures, strip

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from examples.faces import Faces

_Lit = tuple[str, int, int]  # subject, azimuth, elevation


def by_lambda(
    faces: Faces, ours: _Lit, theirs: _Lit, lams: tuple[float, ...]
) -> tuple[NDArray[np.uint8], str]:
    """Relight one face by another; return the picture, and how far from the truth each is."""
    target, reference = faces.lit(*ours), faces.lit(*theirs)
    own, light = Light(*ours[1:]), Light(*theirs[1:])
    truth = faces.yale.aligned(faces.yale.photo(ours[0], light), ours[0], light)
    first = [
        ("target", target.pixels),
        ("reference", reference.pixels),
        ("truth", np.asarray(truth, np.uint8)),
    ]
    strips, found = [strip(first, 240)], []
    for lam in lams:
        result = relit_face(target, reference, lam=lam, mask=False)
        assert result.first.reference_split
        assert result.first.target_split
        u, _ = split_pictures(result.first.reference_split)
        _, v = split_pictures(result.first.target_split)
        image, warped = (faces.yale.aligned(one, ours[0], own) for one in (result.image, result.first.warped))
        scores = score(image, truth, warped)
        panels = [(f"u of the reference, lambda {lam}", u), ("v of the target", v), ("relit", result.image)]
        strips.append(strip(panels, 240))
        found.append(f"λ = {lam}: {scores.raw:.1f} % off the truth, {scores.gain:.1f} % at the best exposure")
    plain = score(faces.yale.aligned(target.pixels, ours[0], own), truth, warped)
    return page(strips), "; ".join(found) + f"; the target itself: {plain.raw:.1f} %, {plain.gain:.1f} %."
