"""Colour profiles: take pixels from the space of one ICC profile to that of another; the curve of sRGB."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np

from relit.errors import ImageError
from relit.photo.curves import power
from relit.runtime.threads import bands, pool

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

#: x and y of red, green, blue and white.
SRGB_PRIMARIES = (0.64, 0.33, 0.30, 0.60, 0.15, 0.06, 0.3127, 0.3290)


def convert(pixels: NDArray[Any], profile: bytes | None, target: bytes | None) -> NDArray[Any]:
    """Convert pixels from one ICC profile to another, as `Photo.to_profile` does.

    Relative colorimetric with black point compensation, which is what browsers and editors do.
    """
    if profile == target:
        return pixels
    grey = pixels.ndim == 2
    if not grey and target is not None and color_space(target) == "GRAY":
        raise ImageError(
            "cannot convert colour pixels to a grey profile; give an RGB profile, or None for sRGB"
        )
    samples = np.repeat(pixels[..., None], 3, axis=2) if grey and profile is None else pixels
    converted = _transform(samples, *(_srgb() if one is None else one for one in (profile, target)))
    return np.ascontiguousarray(converted[..., 1]) if grey and target is None else converted


def color_space(profile: bytes) -> str:
    """Return the colour space that an ICC profile describes: "RGB", "GRAY", "CMYK", ..."""
    return profile[16:20].decode("latin-1").strip()


def is_usable(profile: bytes, pixels: NDArray[Any]) -> bool:
    """Return whether a profile fits these pixels, grey or RGB, and can be converted to sRGB."""
    try:
        convert(pixels[:1, :1], profile, None)
    except ImageError:
        return False
    return True


def encode_srgb(light: NDArray[Any]) -> NDArray[Any]:
    """Return linear light in [0, 1] as sRGB values.

    Examples
    --------
    >>> encode_srgb(np.array([0, 0.001, 0.2140411, 1])).round(5).tolist()
    [0.0, 0.01292, 0.5, 1.0]
    """
    return np.where(light <= 0.0031308, light * 12.92, 1.055 * power(light, 1 / 2.4) - 0.055)


def decode_srgb(values: NDArray[Any]) -> NDArray[Any]:
    """Return sRGB values as linear light; the inverse of `encode_srgb`."""
    return np.where(values <= 0.04045, values / 12.92, power((values + 0.055) / 1.055, 2.4))


def rgb_profile(primaries: Sequence[float], gamma: float | None = None) -> bytes | None:
    """Return an ICC profile of primaries, 8 numbers, and a curve; None for sRGB, or if there can be none.

    The curve is that of sRGB, or has an exponent.
    """
    if gamma is None and np.allclose(primaries, SRGB_PRIMARIES, rtol=0, atol=1e-3):
        return None
    curve = np.linspace(0, 1, 4096)
    curve = decode_srgb(curve) if gamma is None else power(curve, gamma)
    red, green, blue, white = ([*primaries[n : n + 2], 1.0] for n in range(0, 8, 2))
    return _made(
        "rgb",
        primaries=[*red, *green, *blue],
        whitepoint=white,
        transferfunction=np.tile(np.rint(curve * 65535).astype(np.uint16), (3, 1)),
    )


def grey_with_gamma(gamma: float) -> bytes | None:
    """Return an ICC profile of greys whose light is their value to the power of `gamma`."""
    return _made("gray", gamma=gamma)


def _made(space: str, **described: Any) -> bytes | None:
    """Return an ICC profile as Little CMS makes it, if it can."""
    import imagecodecs

    try:
        made = imagecodecs.cms_profile(space, **described)
    except (imagecodecs.CmsError, ValueError):
        return None
    profile = bytearray(made)
    profile[24:36] = bytes(12)  # when it was made: the same photo gives the same bytes
    return bytes(profile)


def _transform(samples: NDArray[Any], profile: bytes, target: bytes) -> NDArray[Any]:
    import imagecodecs

    spaces = ["gray" if grey else "rgb" for grey in (samples.ndim == 2, color_space(target) == "GRAY")]
    flags: int = imagecodecs.CMS.FLAGS.BLACKPOINTCOMPENSATION
    if samples.dtype != np.uint8 or "gray" in spaces:
        # lcms' shortcuts are 20 times faster, and on 8-bit RGB within one level, two in the deepest shadows;
        # they miss greys by two levels anywhere, and 16 bits by thousands.
        flags |= imagecodecs.CMS.FLAGS.NOOPTIMIZE

    def transform(band: tuple[int, int]) -> NDArray[Any]:
        converted: NDArray[Any] = imagecodecs.cms_transform(
            np.ascontiguousarray(samples[slice(*band)]),
            profile,
            target,
            colorspace=spaces[0],
            outcolorspace=spaces[1],
            outdtype=samples.dtype,
            intent=imagecodecs.CMS.INTENT.RELATIVE_COLORIMETRIC,
            flags=flags,
        )
        return converted.clip(0, 1) if converted.dtype.kind == "f" else converted

    parts = bands(samples.shape[:2], None)
    try:
        with pool(len(parts)) as run:
            converted = run(transform, parts)
    except (imagecodecs.CmsError, ValueError) as error:
        raise ImageError("an ICC profile cannot be used: it is damaged, or neither RGB nor grey") from error
    return converted[0] if len(converted) == 1 else np.concatenate(converted)


@cache
def _srgb() -> bytes:
    import imagecodecs

    return bytes(imagecodecs.cms_profile("srgb"))
