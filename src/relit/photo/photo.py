"""Photos in and out of files: upright pixels at their own depth, and what travels with them.

Read: JPEG, PNG, TIFF, WebP, PPM/PGM and BMP, told by content, not by name; grey or RGB, with or without
alpha, of 8 or 16 bits, TIFF also in floating point. With an extra each, ``relit[heic]``, ``relit[raw]`` and
``relit[exr]``: HEIC, camera raw and OpenEXR. Written: the same but HEIC and camera raw, at the depth of the
pixels as far as the format has it.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO

import numpy as np

from relit.errors import ImageError, OutputError
from relit.photo.atomic_files import check_free
from relit.photo.codecs.formats import FORMATS, SUFFIXES, decode, identify
from relit.photo.codecs.jpeg import JpegSettings
from relit.photo.codecs.metadata import Metadata, put_upright
from relit.photo.codecs.raster import Raster, to_depth
from relit.photo.pixels import check_samples, size_and_dtype
from relit.photo.profile import color_space, convert, is_usable
from relit.photo.streams import name_of, open_source, place_of, put

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = [
    "DEFAULT_MAX_PIXELS",
    "PHOTO_SUFFIXES",
    "JpegSettings",
    "Metadata",
    "Photo",
    "check_destination",
    "in_one_profile",
    "read_image",
    "write_image",
]

#: More than any camera takes in one shot; as decoded RGB, 600 MB at 8 bits.
DEFAULT_MAX_PIXELS = 200_000_000
#: What names of the photos end with that `read_image` reads, in lower case; itself, it goes by content.
PHOTO_SUFFIXES = SUFFIXES
#: What a pixel may take on average before `max_pixels` counts it as more than one: 16 bits of RGB, from the
#: largest camera there is, 150 million px, are 900 MB. Decoding takes twice as much, and never above 2 GB.
_BYTES_A_PIXEL = 4.5
_SMALLEST_LIMIT = 1 << 26  # bytes of a file, whatever the pixels

_NAMES = {
    key.removeprefix("."): name
    for name, known in FORMATS.items()
    for key in (name.lower(), *known.extensions)
}
_EXTENSIONS = ", ".join(extension for known in FORMATS.values() for extension in known.extensions)


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
        EXIF, XMP and resolution.
    format : str or None
        "JPEG", "PNG", "TIFF", "WEBP", "PPM", "PGM", "BMP", "EXR", "HEIC" or "RAW": what it was read from.
    jpeg : JpegSettings or None
        How it was compressed, if it was read from a JPEG; a JPEG is written in the same way.

    Examples
    --------
    >>> photo = Photo(np.zeros((2, 3), np.uint8))
    >>> photo.alpha is None, photo.metadata
    (True, Metadata(exif=None, xmp=None, dpi=None))
    >>> photo
    Photo(3x2 grey uint8)
    """

    pixels: NDArray[Any]
    alpha: NDArray[Any] | None = None
    profile: bytes | None = None
    metadata: Metadata = field(default_factory=Metadata)
    format: str | None = None
    jpeg: JpegSettings | None = None

    def __repr__(self) -> str:
        """Return size and dtype, the format, and what travels with the pixels."""
        meta = self.metadata
        extras = {"alpha": self.alpha, "profile": self.profile, "EXIF": meta.exif, "XMP": meta.xmp}
        told = [self.format, *(name for name, value in extras.items() if value is not None)]
        return f"Photo({', '.join([size_and_dtype(self.pixels), *filter(None, told)])})"

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


def in_one_profile(target: Photo, reference: Photo) -> tuple[Photo, Photo]:
    """Return both photos in one colour space: the target's own, where it can be kept.

    A grey target that takes the colours of a reference goes to sRGB, since its profile knows no colours.

    Parameters
    ----------
    target, reference : Photo

    Returns
    -------
    target, reference : Photo

    Raises
    ------
    ImageError
        If a profile is damaged.

    Examples
    --------
    >>> grey, colour = Photo(np.zeros((2, 3), np.uint8)), Photo(np.zeros((2, 3, 3), np.uint8))
    >>> in_one_profile(grey, colour)[1] is colour
    True
    """
    if target.pixels.ndim == reference.pixels.ndim:
        return target, reference.to_profile(target.profile)
    if target.pixels.ndim == 2:
        target = target.to_profile(None)
    return target, reference.to_profile(None)


def read_image(source: str | Path | BinaryIO, *, max_pixels: int = DEFAULT_MAX_PIXELS) -> Photo:
    """Read a photo.

    The type is told by content. EXIF orientation is applied. Palettes and bitmaps become RGB or grey;
    associated alpha in a TIFF or OpenEXR is divided out. Camera raw is developed to sRGB with the camera's
    white balance and no automatic brightening; the linear light of OpenEXR, which must lie in [0, 1], comes
    to the curve of sRGB. EXIF that cannot be parsed, and a colour profile that does
    not fit the pixels or is damaged, are left out.

    Parameters
    ----------
    source : str, Path or binary file
        Where to read; "-" is standard input. An open file is read from where it stands to its end.
    max_pixels : int, optional
        The largest width times height that is decoded, 200 million by default: a file of a few kilobytes
        can claim any size. Of pixels that take more than 4.5 bytes, such as RGB in floating point, fewer
        are allowed, so that reading stays below 2 GB.

    Returns
    -------
    Photo
        With pixels of dtype uint8, uint16 or float32: the file's own depth. The arrays are new.

    Raises
    ------
    ImageError
        If there is no such file, it cannot be opened or is damaged, it does not fit into memory, or it
        holds something else than one grey or RGB photo of at most `max_pixels`; or if its format takes an
        extra that is not installed.

    Examples
    --------
    >>> import io
    >>> file = io.BytesIO(b"P5 2 1 255 " + bytes([0, 255]))
    >>> photo = read_image(file)
    >>> photo.pixels, photo.format
    (array([[  0, 255]], dtype=uint8), 'PGM')
    """
    name = name_of(source)

    def check_size(width: int, height: int, depth: int = 3) -> None:
        if width * height == 0:
            raise ImageError(f"claims {width}x{height} px, which is no photo; get the file again")
        if width * height > max_pixels:
            raise ImageError(
                f"claims {width}x{height} px, more than the {max_pixels} px allowed; raise max_pixels if you "
                "trust the file"
            )
        if width * height * depth > max_pixels * _BYTES_A_PIXEL:
            raise ImageError(
                f"claims {width}x{height} px of {depth} bytes each, more than "
                f"{max_pixels * _BYTES_A_PIXEL / 1e6:.0f} MB; raise max_pixels if you trust the file"
            )

    with open_source(source, _SMALLEST_LIMIT + int(_BYTES_A_PIXEL * max_pixels)) as stream:
        try:
            found = identify(stream)
            return _upright(decode(stream, found, check_size), found)
        except ImageError as error:
            raise ImageError(f"{name}: {error}") from error.__cause__
        except MemoryError as error:
            raise ImageError(
                f"{name}: takes more memory than there is; make the photo smaller first"
            ) from error
        except OSError as error:  # a device, or a disk that fails
            raise ImageError(
                f"{name}: cannot be read ({error.strerror or error}); get the file again"
            ) from error


def write_image(
    destination: str | Path | BinaryIO,
    image: NDArray[Any] | Photo,
    *,
    like: Photo | None = None,
    format: str | None = None,  # noqa: A002
    overwrite: bool = False,
) -> None:
    """Write a photo; a file appears whole, or not at all.

    The depth is that of the pixels as far as the format has it, rounded to the nearest: JPEG, WebP and BMP
    have 8 bits, PNG, PPM and PGM up to 16, TIFF also float32, and OpenEXR always, as linear light. A photo
    that was read from a JPEG is written as JPEG with that file's own quantization tables and subsampling
    of colours, so that it loses no more than rounding, and progressive if that was; any other at quality
    95 with colours at full resolution. WebP is written at quality 95; the others are lossless. Where the
    format cannot hold the colour profile, the pixels are converted to sRGB. EXIF, XMP and resolution are
    kept as far as the format has a place for them.

    Parameters
    ----------
    destination : str, Path or binary file
        Where to write; "-" is standard output.
    image : Photo or ndarray, shape (H, W) or (H, W, 3)
        uint8, uint16, or floating point in [0, 1].
    like : Photo, optional
        For an array: the photo whose alpha, colour profile, metadata and JPEG settings it takes over. A
        grey profile does not go with colours, nor an RGB profile with grey.
    format : str, optional
        "JPEG", "PNG", "TIFF", "WEBP", "PPM", "PGM", "BMP" or "EXR". By default told by the name's
        extension; on a stream without one, the format of `like` (or of a Photo) if it can be written, else
        PNG.
    overwrite : bool, optional
        Whether a file that exists may be replaced.

    Raises
    ------
    ImageError
        If the array is no photo, or the format cannot hold it: alpha is never dropped silently.
    OutputError
        If the file exists already, its extension is not known, or it cannot be written.

    Examples
    --------
    >>> import io
    >>> file = io.BytesIO()
    >>> write_image(file, np.zeros((2, 3, 3)), format="png")
    >>> read_image(io.BytesIO(file.getvalue())).pixels.dtype
    dtype('uint16')
    """
    photo = _as_photo(image, like)
    kind = _format_of(destination, photo, format)
    _check_fits(photo, kind, name_of(destination))
    target = FORMATS[kind]
    if photo.profile and color_space(photo.profile) not in target.profiles:
        photo = photo.to_profile(None)
    dtype = min(photo.pixels.dtype, np.dtype(target.deepest), key=lambda depth: depth.itemsize)
    planes = [plane for plane in (photo.pixels, photo.alpha) if plane is not None]
    samples = np.dstack([to_depth(plane, dtype) for plane in planes])
    raster = Raster(samples, photo.profile, photo.metadata, photo.jpeg)
    put(target.encode(raster), destination, overwrite=overwrite)


def check_destination(
    destination: str | Path | BinaryIO,
    *,
    like: Photo | None = None,
    format: str | None = None,  # noqa: A002
    overwrite: bool = False,
) -> None:
    """Refuse a place that `write_image` would refuse, before any work goes into the photo.

    Parameters
    ----------
    destination, format, overwrite
        As for `write_image`.
    like : Photo, optional
        A photo like the one to be written: of its size, and with colours and alpha if it has them.

    Raises
    ------
    ImageError
        If the format cannot hold such a photo.
    OutputError
        If the file exists already, its folder does not, the format is not known, or it takes an extra that
        is not installed.

    Examples
    --------
    >>> check_destination("face.gif")  # doctest: +ELLIPSIS
    Traceback (most recent call last):
        ...
    relit.errors.OutputError: face.gif: no format to write goes by '.gif'; use one of .jpg, ...
    """
    kind = _format_of(destination, like, format)
    if like is not None:
        _check_fits(like, kind, name_of(destination))
    place = place_of(destination)
    if isinstance(place, Path):
        check_free(place, overwrite=overwrite)


def _upright(raster: Raster, name: str) -> Photo:
    orientation, metadata = put_upright(raster.metadata)
    samples, jpeg = raster.samples, raster.jpeg
    if orientation > 4:
        samples, jpeg = samples.swapaxes(0, 1), jpeg and jpeg.turned()
    if orientation in (2, 3, 6, 7):
        samples = samples[:, ::-1]
    if orientation in (3, 4, 7, 8):
        samples = samples[::-1]
    channels = samples.shape[2]
    pixels = np.ascontiguousarray(samples[..., :3] if channels >= 3 else samples[..., 0])
    alpha = np.ascontiguousarray(samples[..., -1]) if channels in (2, 4) else None
    profile = raster.profile if raster.profile and is_usable(raster.profile, pixels) else None
    return Photo(pixels, alpha, profile, metadata, name, jpeg)


def _as_photo(image: NDArray[Any] | Photo, like: Photo | None) -> Photo:
    """Join an array with what it takes over, and check that the whole can be written."""
    if isinstance(image, Photo):
        if like is not None:
            raise ImageError("like: goes with an array; a Photo has its own alpha, profile and metadata")
        photo = image
    else:
        photo = replace(like, pixels=image) if like else Photo(image)
    check_samples(photo.pixels, "image")
    if photo.alpha is not None:
        check_samples(photo.alpha, "alpha")
        if photo.alpha.shape != (shape := photo.pixels.shape[:2]):
            raise ImageError(f"alpha: expected shape {shape}, as the image has, got {photo.alpha.shape}")
    space = "GRAY" if photo.pixels.ndim == 2 else "RGB"
    return photo if photo.profile and color_space(photo.profile) == space else replace(photo, profile=None)


def _format_of(destination: str | Path | BinaryIO, like: Photo | None, given: str | None) -> str:
    if given is None:
        given = Path(name_of(destination)).suffix
        if not given and not isinstance(place_of(destination), Path):
            given = like.format if like and like.format in FORMATS else "PNG"
    if not given:
        raise OutputError(
            f"{name_of(destination)}: the name has no extension to tell the format; use one of {_EXTENSIONS}"
        )
    try:
        name = _NAMES[given.lower().removeprefix(".")]
        if library := FORMATS[name].library:
            library()
    except ImageError as error:
        raise OutputError(f"{name_of(destination)}: {error}") from error
    except KeyError:
        raise OutputError(
            f"{name_of(destination)}: no format to write goes by {given!r}; use one of {_EXTENSIONS}"
        ) from None
    return name


def _check_fits(photo: Photo, name: str, destination: str) -> None:
    target = FORMATS[name]
    if photo.alpha is not None and not target.alpha:
        raise ImageError(
            f"{destination}: {name} cannot hold the photo's alpha; write PNG, TIFF or WebP, "
            "or leave alpha out"
        )
    if photo.pixels.ndim == 3 and not target.colour:
        raise ImageError(f"{destination}: {name} cannot hold colours; write PPM, or another format")
    height, width = photo.pixels.shape[:2]
    if target.longest and max(height, width) > target.longest:
        raise ImageError(
            f"{destination}: {width}x{height} px is too large for {name}, which ends at {target.longest}; "
            "write PNG or TIFF"
        )
