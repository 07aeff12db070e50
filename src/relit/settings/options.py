"""Options of a transfer: the only place for their names, defaults, ranges and help.

The Python API, the command line and everything above read them from here.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from typing import TYPE_CHECKING, get_args

from relit.errors import OptionError
from relit.photo.color import COLOR_SPACES, channels_of
from relit.settings.methods import METHODS, Method
from relit.settings.option_fields import check, option
from relit.settings.studio_lights import STUDIO_LIGHTS, light_text, studio_light
from relit.settings.transfer_changes import (
    ColorSpace,
    Exposure,
    Kernel,
    Lambda,
    Light,
    MethodName,
    Neighborhood,
    Tint,
)

if TYPE_CHECKING:
    from typing import Unpack

    from relit.settings.transfer_changes import TransferChanges

#: Parts of a face that may be relit alone; `FaceRegions.parts` draws them.
PARTS = ("left", "right", "forehead", "cheeks", "nose", "mouth", "eyes", "chin")

_UNKNOWN = 0.5  # of a difference in brightness: the light's share, where nothing tells it from the skin's


@dataclass(frozen=True)
class TransferOptions:
    """How to relight; every field is a keyword of `relit.transfer` and an option of the command line.

    Attributes
    ----------
    method : str
        How to relight: by ``shading``, as in docs/shading.md, or by ``ltv``, the algorithm of Li, Yin and
        Deng (2009). ``log-gaussian``, ``wls``, ``moments``, ``histogram`` and ``spherical-harmonics`` are
        there to compare with, and so are ``quotient`` and ``expression-ratio``, which take a second
        reference; each is in `relit.methods`.
    lam : float or "auto"
        λ > 0 for a face whose eyes are 100 px apart; it is scaled by 100 / interocular distance. What is
        smaller than about 1/λ px on such a face stays the target's. ``auto`` is slightly smaller than 1/G of
        the target's brows, eyes, nose and mouth: the largest λ at which none of them goes over to the light.
    light : str, (float, float) or None
        A light that needs no reference: ``rembrandt``, ``butterfly``, ``split``, ``loop``, ``rim``, ``flat``,
        or the lamp's place in degrees to the right of the picture and upwards, ``"-30,20"`` or ``(-30, 20)``;
        kept as text. In a text, lamps may have a size, a power and a colour, and are joined by ``+``:
        ``"-30,20:size=25:color=#ffd9a0+rim:power=0.4"``.
    strength : float
        How much of the change of light is made: 0 is the target, 1 the whole; more exaggerates.
    shadows : float
        The same for what becomes darker than the face does on average.
    highlights : float
        The same for what becomes brighter than it does.
    exposure : {"keep", "take"}, float or None
        Whether the face keeps the target's brightness, takes the reference's, or is so many stops brighter
        than the target. Of ``shading``, None keeps it where the face is blended into its photo, and goes half
        the way where the whole image is relit: a dark skin and a weak light look alike in one photo. The
        other methods take it by default.
    tint : {"keep", "take", "neutral"}, float or None
        Whether the skin keeps its hue, takes the reference's overall colour, or that share of it, 0 to 1;
        ``neutral`` takes none of the light's colours. By default ``shading`` takes as much of it as is
        more than two skins differ by, and the others take it all, as a grey target does. How the colours of
        the light differ over the face goes over in any case but ``neutral``.
    region : str
        What is relit: ``face``, with the skin round it; or parts of the face joined by ``+``: ``left`` and
        ``right`` of the picture, ``forehead``, ``cheeks``, ``nose``, ``mouth``, ``eyes``, ``chin``.
    neighborhood : {4, 8, 16, "isotropic"}
        How total variation measures length: exactly, over 4, 8 or 16 neighbours, or isotropically, by an
        iteration on log I.
    split_first : bool
        Whether ``ltv`` splits the reference in its own frame and lays its u over the target, so that many
        targets share one split (with ``lam="auto"``, those of one λ); False lays it there first, as the
        paper does.
    color_space : {"rgb", "hsv", "ycbcr"}
        Where colour is relit.
    channels : str
        ``all``, ``primary`` (H of HSV, Y of YCbCr) or one channel by name; lightness alone where the
        reference is grey. ``shading`` relights RGB, V of HSV or Y of YCbCr.
    mask : bool
        Whether to relight the face alone and blend it into the photo; False is the paper's whole image.
    full_resolution : bool
        Whether light is worked out at the photo's own size, however large, and not at the size that its face
        needs.
    kernel : {"thin_plate_spline", "multiquadric", "gaussian"}
        Radial basis function of the alignment.
    affine : bool
        Whether the alignment has an affine part; False is the paper's literal form.
    smoothing : float or None
        How far the alignment may miss noisy landmarks, 0 for not at all; None for as little as keeps the map
        from folding.
    softness : float
        How far ``shading`` softens the light, 0 to 1: a window becomes a cloudy sky.
    turn : float
        Degrees by which ``shading`` carries the light round the head, within ±180; what comes from the camera
        goes to the right of the picture.
    fill : float or None
        Light from everywhere, 0 to 1: of ``light``, as a share of what falls on what looks into a lamp, and
        None for the named light's own, 0.2 of a lamp by its place. Of a reference ``shading`` has even light
        instead of that share of what it found, and None leaves it.
    tilt : float
        Degrees by which ``shading`` carries the light upwards over the head, within ±90, before it is turned.

    Raises
    ------
    OptionError
        If a value is out of range.

    Examples
    --------
    >>> TransferOptions(lam=0.5).lam
    0.5
    >>> TransferOptions(light=(-30, 20)).light
    '-30,20'
    >>> TransferOptions(lam=-1)
    Traceback (most recent call last):
        ...
    relit.errors.OptionError: lam: expected a finite number above 0, or 'auto', got -1
    """

    method: MethodName = option(
        "shading",
        "How to relight. 'ltv' is the algorithm of Li, Yin and Deng (2009); the others are there to compare. "
        "'quotient' and 'expression-ratio' take a second reference.",
        flag="--method",
        group="expert",
        choices=tuple(METHODS),
    )
    lam: Lambda = option(
        0.2,
        "Above 0: how fine the light may be. Low values take only broad light from the reference, higher "
        "ones also its finer shadows, and in the end its features. Scaled by the size of the face, so that "
        "one value fits every photo. 'auto' takes it from the size of the features of the target's face.",
        flag="--lambda",
        group="expert",
        title="Fineness of light (λ)",
        words=("auto",),
        above=0,
    )
    light: Light = option(
        None,
        f"A light that needs no REFERENCE: {', '.join(STUDIO_LIGHTS)}, or AZ,EL, where the lamp stands in "
        "degrees, from the camera to the right of the picture and upwards. A lamp may have a size (degrees "
        "to its rim), a power and a colour, and others follow: -30,20:size=25:color=#ffd9a0+rim:power=0.4",
        flag="--light",
        words=tuple(STUDIO_LIGHTS),
        text=True,
    )
    strength: float = option(
        1.0,
        "How much of the change of light is made: 0 gives the target back, beyond 1 exaggerates.",
        flag="--strength",
        at_least=0,
        at_most=4,
    )
    shadows: float = option(
        1.0, "The same, for what becomes darker alone.", flag="--shadows", at_least=0, at_most=4
    )
    highlights: float = option(
        1.0, "The same, for what becomes brighter alone.", flag="--highlights", at_least=0, at_most=4
    )
    exposure: Exposure = option(
        None,
        "'keep' the brightness of the target, 'take' that of the reference, or so many stops above the "
        "target's. By default 'shading' keeps it, or with --no-mask goes half the way; the others take it.",
        flag="--exposure",
        words=("keep", "take"),
        at_least=-8,
        at_most=8,
    )
    tint: Tint = option(
        None,
        "'keep' the hue of the skin, 'take' the reference's overall colour, light and complexion alike, or a "
        "share of it, 0 to 1; 'neutral' takes none of its colours. By default 'shading' takes what is more "
        "than two skins differ by, the others take it.",
        flag="--tint",
        group="color",
        title="Colour of light",
        words=("keep", "take", "neutral"),
        at_least=0,
        at_most=1,
    )
    region: str = option(
        "face",
        f"What to relight: 'face' and the skin round it, or parts joined by +: {', '.join(PARTS)}; left and "
        "right are those of the picture.",
        flag="--region",
        group="where",
        words=("face", *PARTS),
    )
    neighborhood: Neighborhood = option(
        4,
        "Neighbours of a pixel in the measure of length: 4 is fastest, 16 roundest; 'isotropic' is perfectly "
        "round and approximate.",
        flag="--neighborhood",
        group="expert",
        title="Roundness of contours (neighbourhood)",
        choices=get_args(Neighborhood),
    )
    split_first: bool = option(
        False,
        "Method ltv: split the reference in its own frame and lay its u over the target, so that many "
        "targets share one split.",
        flag="--split-first",
        group="expert",
        title="Split the reference in its own frame",
    )
    color_space: ColorSpace = option(
        "rgb",
        "Colour space to relight in.",
        flag="--color-space",
        group="expert",
        title="Colour space",
        choices=get_args(ColorSpace),
    )
    channels: str = option(
        "all",
        "Channels to relight: 'all', 'primary' (H of HSV, Y of YCbCr, as in the paper), or one by name, for "
        "example 'v' of HSV. A grey reference lights the lightness alone, whatever is chosen.",
        flag="--channels",
        group="expert",
    )
    mask: bool = option(
        True,
        "Relight the face alone and blend it into the photo, or (--no-mask) the whole image.",
        flag="--mask",
        group="where",
        title="Blend into the photo (mask)",
    )
    full_resolution: bool = option(
        False,
        "Work out the light at the photo's own size, instead of that which its face needs: exact, and slow "
        "on large photos.",
        flag="--full-resolution",
        group="expert",
    )
    kernel: Kernel = option(
        "thin_plate_spline",
        "Radial basis function that aligns the faces.",
        flag="--kernel",
        group="expert",
        title="Bending of the fit (radial basis function)",
        choices=get_args(Kernel),
    )
    affine: bool = option(
        True,
        "Align with an affine part, or (--no-affine) by radial functions alone, as in the paper.",
        flag="--affine",
        group="expert",
        title="Shear of the fit (affine part)",
    )
    smoothing: float | None = option(
        None,
        "How far the alignment may miss noisy landmarks: 0 not at all. By default as little as keeps the map "
        "from folding.",
        flag="--smoothing",
        group="expert",
        title="Slack of the fit (smoothing)",
        at_least=0,
    )
    softness: float = option(
        0.0,
        "Method shading: how far to soften the light, 0 leaves it as it is, 1 makes it that of a cloudy sky.",
        flag="--softness",
        at_least=0,
        at_most=1,
    )
    turn: float = option(
        0.0,
        "Method shading: degrees to carry the light round the head, to the right of the picture at "
        "its front.",
        flag="--turn",
        at_least=-180,
        at_most=180,
    )
    fill: float | None = option(
        None,
        "Light from everywhere, which is how light the shadows are: 0 none, 1 nothing else. By default that "
        "of the light by name, 0.2 of a lamp by its place, and of a REFERENCE what is found, which methods "
        "other than shading take in any case.",
        flag="--fill",
        at_least=0,
        at_most=1,
    )
    tilt: float = option(
        0.0,
        "Method shading: degrees to carry the light upwards over the head, before it is turned.",
        flag="--tilt",
        at_least=-90,
        at_most=90,
    )

    def __post_init__(self) -> None:
        """Check every value against its declared range."""
        object.__setattr__(self, "light", light_text(self.light))
        for declared in fields(self):
            check(declared.name, getattr(self, declared.name), declared.default, declared.metadata)
        if self.light is not None:
            studio_light(self.light)
        for part in self.region.split("+"):
            if part not in ("face", *PARTS):
                raise OptionError(
                    f"region: expected face, or parts joined by +: {', '.join(PARTS)}, got {self.region!r}"
                )
        chosen = channels_of(self.color_space, self.lit_channels)
        lightness = COLOR_SPACES[self.color_space].lightness
        wanted = channels_of(self.color_space, lightness) if lightness else chosen
        if self.record.lights_brightness and chosen != wanted:
            raise OptionError(
                f"channels: expected {lightness!r} or 'all' with method {self.method!r}, which lights what "
                f"has a brightness, got {self.channels!r}; or choose method ltv"
            )

    @property
    def record(self) -> Method:
        """What is to know of the method besides how it relights."""
        return METHODS[self.method]

    @property
    def lit_channels(self) -> str:
        """The channels that are relit: some methods leave those alone that have no brightness."""
        lightness = COLOR_SPACES[self.color_space].lightness if self.color_space in COLOR_SPACES else None
        alone = lightness and self.record.lights_brightness and self.channels == "all"
        return lightness if lightness and alone else self.channels

    @property
    def splits_alone(self) -> bool:
        """Whether the reference is split in its own frame."""
        return self.split_first and self.record.splits

    @property
    def exposure_share(self) -> float:
        """How much of the reference's brightness ``shading`` takes on, 0 to 1."""
        if self.exposure is None:
            return 0.0 if self.mask else _UNKNOWN
        return float(self.exposure == "take")

    @property
    def stops(self) -> float | None:
        """By how many stops the face gets brighter than the target's; None where the option is no number."""
        return None if self.exposure is None or isinstance(self.exposure, str) else float(self.exposure)

    @property
    def tint_share(self) -> float | None:
        """How much of the reference's overall colour the face takes on; None by default."""
        if self.tint is None or isinstance(self.tint, str):
            return {"keep": 0.0, "take": 1.0, "neutral": 0.0}.get(self.tint or "")
        return float(self.tint)

    def changed(self, /, **changes: Unpack[TransferChanges]) -> TransferOptions:
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
