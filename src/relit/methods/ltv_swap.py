"""The method of Li, Yin and Deng (2009): large scales by the logarithmic total variation model."""

from __future__ import annotations

from functools import partial

from relit.ltv import decompose
from relit.methods.scene import Relit, Scene, recombined
from relit.threads import pool


def relight(scene: Scene) -> Relit:
    """Return u(reference) · v(target)."""
    split = partial(
        decompose,
        lam=scene.lam,
        neighborhood=scene.options.neighborhood,
        interocular_distance=scene.landmarks.interocular_distance,
    )
    with pool(2) as run:
        return recombined(*run(split, (scene.target, scene.reference)))
