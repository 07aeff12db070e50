"""The methods by name, and what the rest of the house has to know of each.

`relit.methods` has the functions; how they differ in what surrounds them stands here, in one record each.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Method:
    """What is to know of a method besides how it relights.

    Attributes
    ----------
    working_iod, preview_iod, sketch_iod : float
        Distance of the eyes, in px, that a face may be reduced to: for a result as good as on the whole
        photo, for the eye to judge by, and to follow a hand that is moving.
    map_tolerance : float
        Px that a reference may lie off where its map leads it.
    needs_second : bool
        Whether it takes a second reference: the reference's face in the target's light.
    anchors_itself : bool
        Whether it tells light from skin, so that the target's brightness and hue can be kept by that; of
        the others, the relit face is compared with the target.
    lights_brightness : bool
        Whether it relights nothing but what has a brightness: all of RGB, V of HSV, Y of YCbCr.
    splits : bool
        Whether it splits either photo by itself, so that a reference can be split in its own frame.
    relights_head : bool
        Whether it knows the light on all of the head, with hair, ears and neck, and not on the face alone.
    options : tuple of str
        Of the fields of `TransferOptions` that not every method heeds, those that it does.
    """

    working_iod: float = 200.0
    map_tolerance: float = 0.05
    preview_iod: float = 110.0
    sketch_iod: float = 25.0
    needs_second: bool = False
    anchors_itself: bool = False
    lights_brightness: bool = False
    splits: bool = False
    relights_head: bool = False
    options: tuple[str, ...] = ()


#: Name in `TransferOptions` → record. A light fitted to a face is as good on a small one; where edges are
#: found one by one, more pixels find them better.
METHODS = {
    "shading": Method(
        working_iod=60.0,
        map_tolerance=0.25,
        preview_iod=45.0,
        sketch_iod=18.0,
        anchors_itself=True,
        lights_brightness=True,
        relights_head=True,
        options=("lam", "softness", "turn", "tilt", "fill"),
    ),
    "ltv": Method(splits=True, options=("lam", "neighborhood", "split_first")),
    "log-gaussian": Method(options=("lam",)),
    "wls": Method(options=("lam",)),
    "moments": Method(),
    "histogram": Method(),
    "spherical-harmonics": Method(),
    "quotient": Method(needs_second=True),
    "expression-ratio": Method(needs_second=True),
}

#: Names of those that take a second reference.
WITH_SECOND_REFERENCE = tuple(name for name, method in METHODS.items() if method.needs_second)
