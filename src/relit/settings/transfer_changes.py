"""Options as editors and type checkers know them: each by name, with the values that it takes."""

from __future__ import annotations

from typing import Literal, TypedDict

MethodName = Literal[
    "shading",
    "ltv",
    "log-gaussian",
    "wls",
    "moments",
    "histogram",
    "spherical-harmonics",
    "quotient",
    "expression-ratio",
]
Lambda = float | Literal["auto"]
Light = str | tuple[float, float] | None
Exposure = float | Literal["keep", "take"] | None
Tint = float | Literal["keep", "take", "neutral"] | None
Neighborhood = Literal[4, 8, 16, "isotropic"]
ColorSpace = Literal["rgb", "hsv", "ycbcr"]
Kernel = Literal["thin_plate_spline", "multiquadric", "gaussian"]


class TransferChanges(TypedDict, total=False):
    """Keywords that change single fields of `TransferOptions`, which says what they mean.

    A function that hands keywords on to `relit.transfer` takes ``**changes: Unpack[TransferChanges]``. They
    are written out, since type checkers run no code; a test compares them with the fields.
    """

    method: MethodName
    lam: Lambda
    light: Light
    strength: float
    shadows: float
    highlights: float
    exposure: Exposure
    tint: Tint
    region: str
    neighborhood: Neighborhood
    split_first: bool
    color_space: ColorSpace
    channels: str
    mask: bool
    full_resolution: bool
    kernel: Kernel
    affine: bool
    smoothing: float | None
    softness: float
    turn: float
    fill: float | None
    tilt: float
