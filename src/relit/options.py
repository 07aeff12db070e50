"""Options of a transfer: the only place for their names, defaults, ranges and help.

The Python API, the command line and everything above read them from here.
"""

from __future__ import annotations

from dataclasses import dataclass, field, fields, replace
from numbers import Real
from typing import Any

import numpy as np

from relit.color import COLOR_SPACES, channels_of
from relit.errors import OptionError

METHODS = (
    "shading",
    "ltv",
    "log-gaussian",
    "wls",
    "moments",
    "histogram",
    "spherical-harmonics",
    "quotient",
    "expression-ratio",
)


def _option(
    default: Any,
    text: str,
    *,
    flag: str,
    choices: tuple[Any, ...] = (),
    word: str | None = None,
    at_least: float | None = None,
    at_most: float | None = None,
    above: float | None = None,
) -> Any:
    """Declare an option: default, help, command line flag, range, and a word that may stand for a number."""
    limits = {"choices": choices, "word": word, "at_least": at_least, "at_most": at_most, "above": above}
    return field(default=default, metadata={"help": text, "flag": flag, **limits})


@dataclass(frozen=True)
class TransferOptions:
    """How to relight; every field is a keyword of `relit.transfer` and an option of the command line.

    Attributes
    ----------
    method : str
        How to relight: by ``shading``, as docs/shading.md tells, or by ``ltv``, the algorithm of Li, Yin and
        Deng (2009). ``log-gaussian``, ``wls``, ``moments``, ``histogram`` and ``spherical-harmonics`` are
        there to compare with, and so are ``quotient`` and ``expression-ratio``, which take a second
        reference; each is in `relit.methods`.
    lam : float or "auto"
        λ > 0 for a face whose eyes are 100 px apart; it is scaled by 100 / interocular distance. What is
        smaller than about 1/λ px on such a face stays the target's. ``auto`` is slightly smaller than 1/G of
        the target's brows, eyes, nose and mouth: the largest λ at which none of them goes over to the light.
    exposure : float or None
        Of ``shading``: the share of the reference's brightness that the face takes on, 0 to 1. None is 0
        where the face is blended into its photo, which keeps its exposure all round, and 0.5 where the whole
        image is relit: a dark skin and a weak light look alike in one photo.
    tint : float
        Of ``shading``: the share of the reference's overall colour that the face takes on, 0 to 1. By default
        none: the skin keeps its hue. A grey target takes all of it.
    neighborhood : {4, 8, 16, "isotropic"}
        How total variation measures length: exactly, over 4, 8 or 16 neighbours, or isotropically, by an
        iteration on log I.
    color_space : {"rgb", "hsv", "ycbcr"}
        Where colour is relit.
    channels : str
        ``all``, ``primary`` (H of HSV, Y of YCbCr) or one channel by name; lightness alone where the
        reference is grey. ``shading`` relights RGB, V of HSV or Y of YCbCr.
    mask : bool
        Whether to relight the face alone and blend it into the photo; False is the paper's whole image.
    kernel : {"thin_plate_spline", "multiquadric", "gaussian"}
        Radial basis function of the alignment.
    affine : bool
        Whether the alignment has an affine part; False is the paper's literal form.
    smoothing : float or None
        How far the alignment may miss noisy landmarks, 0 for not at all; None for as little as keeps the map
        from folding.

    Raises
    ------
    OptionError
        If a value is out of range.

    Examples
    --------
    >>> TransferOptions(lam=0.5).lam
    0.5
    >>> TransferOptions(lam=-1)
    Traceback (most recent call last):
        ...
    relit.errors.OptionError: lam: expected a finite number above 0, or 'auto', got -1
    """

    method: str = _option(
        "shading",
        "How to relight. 'ltv' is the algorithm of Li, Yin and Deng (2009); the others are there to compare. "
        "'quotient' and 'expression-ratio' take a second reference.",
        flag="--method",
        choices=METHODS,
    )
    lam: float | str = _option(
        0.2,
        "Above 0: how fine the light may be. Low values take only broad light from the reference, higher "
        "ones also its finer shadows, and in the end its features. Scaled by the size of the face, so that "
        "one value fits every photo. 'auto' takes it from the size of the features of the target's face.",
        flag="--lambda",
        word="auto",
        above=0,
    )
    exposure: float | None = _option(
        None,
        "Of 'shading', 0 to 1: how much of the reference's brightness the face takes on. By default "
        "none, to go with the rest of the photo; 0.5 with --no-mask.",
        flag="--exposure",
        at_least=0,
        at_most=1,
    )
    tint: float = _option(
        0.0,
        "Of 'shading', 0 to 1: how much of the reference's overall colour the face takes on. 0 keeps the "
        "hue of its skin; 1 takes a coloured light as it is, and the other's complexion with it.",
        flag="--tint",
        at_least=0,
        at_most=1,
    )
    neighborhood: int | str = _option(
        4,
        "Neighbours of a pixel in the measure of length: 4 is fastest, 16 roundest; 'isotropic' is perfectly "
        "round and approximate.",
        flag="--neighborhood",
        choices=(4, 8, 16, "isotropic"),
    )
    color_space: str = _option(
        "rgb", "Colour space to relight in.", flag="--color-space", choices=("rgb", "hsv", "ycbcr")
    )
    channels: str = _option(
        "all",
        "Channels to relight: 'all', 'primary' (H of HSV, Y of YCbCr, as in the paper), or one by name, for "
        "example 'v' of HSV. A grey reference lights the lightness alone, whatever is chosen.",
        flag="--channels",
    )
    mask: bool = _option(
        True,
        "Relight the face alone and blend it into the photo, or (--no-mask) the whole image.",
        flag="--mask",
    )
    kernel: str = _option(
        "thin_plate_spline",
        "Radial basis function that aligns the faces.",
        flag="--kernel",
        choices=("thin_plate_spline", "multiquadric", "gaussian"),
    )
    affine: bool = _option(
        True,
        "Align with an affine part, or (--no-affine) by radial functions alone, as in the paper.",
        flag="--affine",
    )
    smoothing: float | None = _option(
        None,
        "How far the alignment may miss noisy landmarks: 0 not at all. By default as little as keeps the map "
        "from folding.",
        flag="--smoothing",
        at_least=0,
    )

    def __post_init__(self) -> None:
        """Check every value against its declared range."""
        for declared in fields(self):
            _check(declared.name, getattr(self, declared.name), declared.default, declared.metadata)
        chosen = channels_of(self.color_space, self.lit_channels)  # type: ignore[arg-type]
        lightness = COLOR_SPACES[self.color_space].lightness  # type: ignore[index]
        wanted = channels_of(self.color_space, lightness) if lightness else chosen  # type: ignore[arg-type]
        if self.method == "shading" and chosen != wanted:
            raise OptionError(
                f"channels: expected {lightness!r} or 'all' with method 'shading', which lights what has a "
                f"brightness, got {self.channels!r}; or choose method ltv"
            )

    @property
    def lit_channels(self) -> str:
        """The channels that are relit: ``shading`` leaves those alone that have no brightness."""
        lightness = COLOR_SPACES[self.color_space].lightness if self.color_space in COLOR_SPACES else None
        return (
            lightness if lightness and self.method == "shading" and self.channels == "all" else self.channels
        )

    def changed(self, **changes: Any) -> TransferOptions:
        """Return the options with some values changed.

        Raises
        ------
        OptionError
            If a name is unknown or a value out of range.
        """
        known = [declared.name for declared in fields(self)]
        for name in changes:
            if name not in known:
                raise OptionError(f"{name}: no such option; expected one of {', '.join(known)}")
        return replace(self, **changes)


def _check(name: str, value: Any, default: Any, declared: Any) -> None:
    if value is None and default is None:
        return
    if choices := declared["choices"]:
        # 4 == 4.0 == True in Python, but only the choice itself is one.
        if not any(type(value) is type(choice) and value == choice for choice in choices):
            raise OptionError(f"{name}: expected one of {', '.join(map(str, choices))}, got {value!r}")
    elif isinstance(default, bool):
        if not isinstance(value, bool):
            raise OptionError(f"{name}: expected True or False, got {value!r}")
    elif isinstance(default, str):
        if not isinstance(value, str):
            raise OptionError(f"{name}: expected a name, got {value!r}")
    elif not (isinstance(value, str) and value == declared["word"]):
        above, at_least, at_most = declared["above"], declared["at_least"], declared["at_most"]
        wanted = f"above {above}" if above is not None else f"of {at_least} or more"
        wanted += f" and at most {at_most}" if at_most is not None else ""
        number = isinstance(value, Real) and not isinstance(value, bool) and bool(np.isfinite(float(value)))
        if not (
            number
            and (value > above if above is not None else value >= at_least)
            and (at_most is None or value <= at_most)
        ):
            wanted += f", or {declared['word']!r}" if declared["word"] else ""
            raise OptionError(f"{name}: expected a finite number {wanted}, got {value!r}")
