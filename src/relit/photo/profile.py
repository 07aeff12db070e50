"""Colour profiles: take pixels from the space of one ICC profile to that of another."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np

from relit.errors import ImageError
from relit.runtime.threads import bands, pool

if TYPE_CHECKING:
    from numpy.typing import NDArray


def convert(pixels: NDArray[Any], profile: bytes | None, target: bytes | None) -> NDArray[Any]:
    """Convert pixels from one ICC profile to another, at their own bit depth.

    Relative colorimetric with black point compensation, which is what browsers and editors do; colours
    outside the new gamut are clipped to it.

    Parameters
    ----------
    pixels : ndarray, shape (H, W) or (H, W, 3)
        uint8, uint16, or floating point in [0, 1].
    profile : bytes or None
        ICC profile the pixels are in; None for sRGB, or for grey with the sRGB curve.
    target : bytes or None
        ICC profile to take them to. None for sRGB: grey pixels then stay grey. Another RGB profile makes
        grey pixels ``(H, W, 3)``.

    Returns
    -------
    ndarray
        Of the dtype of `pixels`; `pixels` themselves where the two profiles are equal.

    Raises
    ------
    ImageError
        If the profiles do not fit the pixels or each other, or cannot be used.
    """
    if profile == target:
        return pixels
    grey = pixels.ndim == 2
    if not grey and target is not None and color_space(target) == "GRAY":
        raise ImageError(
            "cannot convert colour pixels to a grey profile; give an RGB profile, or None for sRGB"
        )
    samples = np.repeat(pixels[..., None], 3, axis=2) if grey and profile is None else pixels
    converted = _transform(
        samples, _srgb() if profile is None else profile, _srgb() if target is None else target
    )
    return np.ascontiguousarray(converted[..., 1]) if grey and target is None else converted


def color_space(profile: bytes) -> str:
    """Return the colour space that an ICC profile describes: "RGB", "GRAY", "CMYK", ...

    Examples
    --------
    >>> color_space(bytes(16) + b"GRAY" + bytes(108))
    'GRAY'
    """
    return profile[16:20].decode("latin-1").strip()


def is_usable(profile: bytes, pixels: NDArray[Any]) -> bool:
    """Return whether a profile fits these pixels, grey or RGB, and can be converted to sRGB."""
    try:
        convert(pixels[:1, :1], profile, None)
    except ImageError:
        return False
    return True


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
