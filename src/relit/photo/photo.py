"""A photo: upright pixels, and what travels with them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from relit.photo.channels import first_of
from relit.photo.pixels import size_and_dtype
from relit.photo.profile import convert

if TYPE_CHECKING:
    from numpy.typing import NDArray


class Text(NamedTuple):
    """A text in a PNG: what it is, "Author" or "Copyright" for instance, and what it says."""

    keyword: str
    text: str
    language: str = ""
    translated: str = ""  # the keyword in that language


@dataclass(frozen=True)
class Metadata:
    """Metadata that travels with a photo.

    Attributes
    ----------
    exif : bytes or None
        EXIF block, starting with its TIFF header. Its Orientation is 1, as the pixels are upright, and
        its thumbnail, which would still show the old light, is unlinked.
    xmp : bytes or None
        XMP packet.
    dpi : (float, float) or None
        Horizontal and vertical resolution in pixels per inch.
    iptc : bytes or None
        IPTC-IIM: the datasets, one after the other.
    photoshop : bytes or None
        Photoshop's other image resources, such as paths and the copyright flag; without thumbnails.
    comments : tuple of bytes
        Comments of a JPEG, whose encoding no standard tells.
    text : tuple of Text
        Texts of a PNG.
    geo : tuple of (int, bytes or tuple of numbers)
        Tags of GeoTIFF and their values, which hold for these pixels as they lie.
    names_srgb : bool
        Whether a PNG says that its colours are sRGB, in whatever way; others are so without a word.
    left_out : tuple of str
        What else the file told that does not travel, in words.
    """

    exif: bytes | None = None
    xmp: bytes | None = None
    dpi: tuple[float, float] | None = None
    iptc: bytes | None = None
    photoshop: bytes | None = None
    comments: tuple[bytes, ...] = ()
    text: tuple[Text, ...] = ()
    geo: tuple[tuple[int, bytes | tuple[float, ...]], ...] = ()
    names_srgb: bool = False
    left_out: tuple[str, ...] = ()


@dataclass(frozen=True)
class JpegSettings:
    """How a JPEG is compressed.

    Attributes
    ----------
    tables : tuple of tuples of 64 ints
        What each component's coefficients are quantized by, row by row: one table for grey, two for
        brightness and colour alike, or three.
    subsampling : (int, int)
        How many px across, and how many down, share a colour: (1, 1) is 4:4:4, (2, 1) 4:2:2, (2, 2)
        4:2:0.
    progressive : bool
        Whether it is stored coarse to fine.
    rgb : bool
        Whether it holds red, green and blue, not brightness and colour.
    """

    tables: tuple[tuple[int, ...], ...]
    subsampling: tuple[int, int] = (1, 1)
    progressive: bool = False
    rgb: bool = False

    def transposed(self) -> JpegSettings:
        """Return the settings of the same photo with rows and columns exchanged."""
        tables = tuple(tuple(np.reshape(table, (8, 8)).T.ravel().tolist()) for table in self.tables)
        return replace(self, tables=tables, subsampling=self.subsampling[::-1])


@dataclass(frozen=True, eq=False)
class Photo:
    """A photo: upright pixels, and what travels with them.

    Attributes
    ----------
    pixels : ndarray, shape (H, W) or (H, W, 3)
        Grey or RGB, in the space of `profile`; uint8, uint16, or float32 in [0, 1].
    alpha : ndarray of the same dtype, shape (H, W), or None
        Opacity, kept aside; the pixels are not multiplied with it.
    profile : bytes or None
        ICC profile of the pixels; None for sRGB, or for plain grey.
    metadata : Metadata
        EXIF, XMP, IPTC, texts, resolution.
    format : str or None
        "JPEG", "PNG", "TIFF", "WEBP", "PPM", "PGM", "BMP", "EXR", "HEIC" or "RAW": what it was read from.
    jpeg : JpegSettings or None
        How it was compressed, if it was read from a JPEG; a JPEG is written in the same way.

    Examples
    --------
    >>> photo = Photo(np.zeros((2, 3), np.uint8))
    >>> photo.alpha is None, photo.metadata == Metadata()
    (True, True)
    >>> photo
    Photo(3x2 grey uint8)
    """

    pixels: NDArray[Any]
    alpha: NDArray[Any] | None = None
    profile: bytes | None = None
    metadata: Metadata = Metadata()
    format: str | None = None
    jpeg: JpegSettings | None = None

    def __repr__(self) -> str:
        """Return size and dtype, the format, and what travels with the pixels."""
        meta = self.metadata
        extras = {"alpha": self.alpha, "profile": self.profile, "EXIF": meta.exif, "XMP": meta.xmp}
        extras |= {"IPTC": meta.iptc}
        told = [self.format, *(name for name, value in extras.items() if value is not None)]
        return f"Photo({', '.join([size_and_dtype(self.pixels), *filter(None, told)])})"

    @classmethod
    def from_samples(
        cls,
        samples: NDArray[Any],
        profile: bytes | None = None,
        metadata: Metadata = Metadata(),
        jpeg: JpegSettings | None = None,
    ) -> Photo:
        """Return a photo of samples as they lie in a file, ``(H, W)`` or ``(H, W, C)``, alpha behind."""
        samples = samples.reshape(*samples.shape[:2], -1)
        channels = samples.shape[2]
        pixels = samples[..., :3] if channels >= 3 else samples[..., 0]
        if channels == 4 and samples.dtype.itemsize < 8:  # of wider ones no photo is made
            pixels = first_of(samples, 3)
        return cls(pixels, samples[..., -1] if channels in (2, 4) else None, profile, metadata, jpeg=jpeg)

    @property
    def samples(self) -> NDArray[Any]:
        """The pixels as they lie in a file, ``(H, W, C)``, alpha behind."""
        if self.alpha is None:
            return np.ascontiguousarray(self.pixels).reshape(*self.pixels.shape[:2], -1)
        return np.dstack([self.pixels, self.alpha])

    @property
    def is_grey(self) -> bool:
        """Whether the pixels are ``(H, W)``."""
        return self.pixels.ndim == 2

    def to_profile(self, profile: bytes | None) -> Photo:
        """Return the photo with its pixels in another colour profile, at their own bit depth.

        Colours outside the new profile's gamut are clipped to it.

        Parameters
        ----------
        profile : bytes or None
            ICC profile; None for sRGB, where a grey photo stays grey. Another RGB profile makes a grey
            photo's pixels ``(H, W, 3)``.

        Returns
        -------
        Photo
            This one, if it is in that profile already.

        Raises
        ------
        ImageError
            If the profile is neither RGB nor grey, is grey where the photo is not, or is damaged.

        Examples
        --------
        >>> photo = Photo(np.full((2, 3), 128, np.uint8))
        >>> photo.to_profile(None) is photo
        True
        """
        pixels = convert(self.pixels, self.profile, profile)
        return self if pixels is self.pixels else replace(self, pixels=pixels, profile=profile)

    def to_profile_of(self, other: Photo) -> Photo:
        """Return the photo in another photo's profile; in sRGB where only one of the two is grey.

        Errors are those of `to_profile`.

        Examples
        --------
        >>> grey, colour = Photo(np.zeros((2, 3), np.uint8)), Photo(np.zeros((2, 3, 3), np.uint8))
        >>> colour.to_profile_of(grey) is colour
        True
        """
        return self.to_profile(other.profile if self.is_grey == other.is_grey else None)
