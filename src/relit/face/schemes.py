"""Landmark schemes: what the rows of a landmark array are.

*Left* and *right* are the subject's own, as in anatomy: the right eye is on the left side of a frontal photo.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

SchemeName = Literal["mesh478", "ibug68", "frl189", "points"]


def _span(first: int, last: int) -> tuple[int, ...]:
    return tuple(range(first, last + 1))


@dataclass(frozen=True)
class Scheme:
    """What the rows of a landmark array are.

    Attributes
    ----------
    count : int or None
        Number of points; None where any number goes.
    right_eye, left_eye : tuple of int
        Rows whose mean is the eye's centre.
    outline : tuple of int
        Rows round the face, in order; empty where the convex hull has to serve.
    has_forehead : bool
        Whether the outline reaches the hairline.
    groups : dict
        Facial feature → its rows.
    """

    count: int | None
    right_eye: tuple[int, ...] = ()
    left_eye: tuple[int, ...] = ()
    outline: tuple[int, ...] = ()
    has_forehead: bool = False
    groups: dict[str, tuple[int, ...]] | None = None


# fmt: off
_MESH_OVAL = (10, 338, 297, 332, 284, 251, 389, 356, 454, 323, 361, 288, 397, 365, 379, 378, 400, 377, 152,
              148, 176, 149, 150, 136, 172, 58, 132, 93, 234, 127, 162, 21, 54, 103, 67, 109)
_MESH_GROUPS = {
    "oval": _MESH_OVAL,
    "brows": (46, 53, 52, 65, 55, 70, 63, 105, 66, 107, 276, 283, 282, 295, 285, 300, 293, 334, 296, 336),
    "eyes": (33, 7, 163, 144, 145, 153, 154, 155, 133, 173, 157, 158, 159, 160, 161, 246,
             263, 249, 390, 373, 374, 380, 381, 382, 362, 398, 384, 385, 386, 387, 388, 466),
    "nose": (168, 6, 197, 195, 5, 4, 1, 19, 94, 2, 98, 97, 326, 327, 294, 278, 344, 440, 275, 45, 220, 115,
             48, 64),
    "mouth": (61, 146, 91, 181, 84, 17, 314, 405, 321, 375, 291, 409, 270, 269, 267, 0, 37, 39, 40, 185),
    "inner_mouth": (78, 95, 88, 178, 87, 14, 317, 402, 318, 324, 308, 415, 310, 311, 312, 13, 82, 81,
                    80, 191),
    "cheeks": (50, 280, 101, 330, 205, 425, 36, 266, 117, 346, 187, 411, 207, 427, 123, 352, 147, 376, 213,
               433),
    "forehead": (9, 8, 151, 108, 337, 69, 299, 104, 333, 71, 301),
    "chin": (18, 200, 199, 175),
}

SCHEMES: dict[SchemeName, Scheme] = {
    "mesh478": Scheme(
        count=478,
        right_eye=(33, 160, 158, 133, 153, 144),
        left_eye=(362, 385, 387, 263, 373, 380),
        outline=_MESH_OVAL,
        has_forehead=True,
        groups=_MESH_GROUPS,
    ),
    "ibug68": Scheme(
        count=68,
        right_eye=_span(36, 41),
        left_eye=_span(42, 47),
        outline=(*_span(0, 16), *reversed(_span(17, 26))),
        groups={"jaw": _span(0, 16), "brows": _span(17, 26), "nose": _span(27, 35), "eyes": _span(36, 47),
                "mouth": _span(48, 59), "inner_mouth": _span(60, 67)},
    ),
    "frl189": Scheme(
        count=189,
        right_eye=(0,),
        left_eye=(1,),
        outline=(109, 185, 110, 186, 111, *_span(125, 133), 114, 188, 113, 187, 112,
                 *reversed(_span(134, 144))),
        has_forehead=True,
        groups={"jaw": _span(125, 133), "hairline": _span(134, 144), "brows": _span(71, 86),
                "eyes": (0, 1, *_span(2, 43)), "nose": _span(50, 70), "mouth": _span(87, 108)},
    ),
    "points": Scheme(count=None),
}
# fmt: on
