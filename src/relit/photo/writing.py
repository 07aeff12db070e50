"""Photos into files.

Written are JPEG, PNG, TIFF, WebP, PPM/PGM and BMP, and OpenEXR with the extra ``relit[exr]``, at the depth of
the pixels as far as the format has it.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from relit.errors import ImageError, OutputError
from relit.photo.atomic_files import check_free
from relit.photo.codecs.formats import FORMATS
from relit.photo.codecs.jpeg import finer_subsampling
from relit.photo.photo import Photo
from relit.photo.pixels import check_samples, to_depth
from relit.photo.profile import color_space
from relit.photo.streams import destination_of, name_of, save

if TYPE_CHECKING:
    from collections.abc import Iterable

    from numpy.typing import NDArray

    from relit.photo.streams import FileOrName

#: Extension → format; a format's name is one more.
_KINDS = {end: kind for kind, known in FORMATS.items() for end in (*known.extensions, f".{kind.lower()}")}
_EXTENSIONS = tuple(extension for known in FORMATS.values() for extension in known.extensions)


def write_image(
    destination: FileOrName,
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
    format cannot hold the colour profile, the pixels are converted to sRGB. EXIF, XMP, IPTC, texts and
    resolution are kept as far as the format has a place for them; `not_kept` tells the rest.

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
        "JPEG", "PNG", "TIFF", "WEBP", "PPM", "PGM", "BMP" or "EXR". By default taken from the
        name's extension; on a stream without one, the format of `like` (or of a Photo) if it can be written,
        else PNG.
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
    >>> from relit.photo.reading import read_image
    >>> file = io.BytesIO()
    >>> write_image(file, np.zeros((2, 3, 3)), format="png")
    >>> read_image(io.BytesIO(file.getvalue())).pixels.dtype
    dtype('uint16')
    """
    photo = joined(image, like)
    kind = _format_of(destination, photo, format)
    _check_fits(photo, kind, name_of(destination))
    known = FORMATS[kind]
    if photo.profile and color_space(photo.profile) not in known.profiles:
        photo = photo.to_profile(None)
    dtype = min(photo.pixels.dtype, np.dtype(known.deepest), key=lambda depth: depth.itemsize)
    alpha = None if photo.alpha is None else to_depth(photo.alpha, dtype)
    metadata, _ = known.fit(photo.metadata)
    photo = replace(photo, pixels=to_depth(photo.pixels, dtype), alpha=alpha, metadata=metadata)
    save(known.encode(photo), destination, overwrite=overwrite)


def check_destination(
    destination: FileOrName,
    *,
    like: Photo | None = None,
    format: str | None = None,  # noqa: A002
    overwrite: bool = False,
    beside: Iterable[str] = (),
) -> None:
    """Refuse a destination that `write_image` would refuse, before any work goes into the photo.

    Parameters
    ----------
    destination, format, overwrite
        As for `write_image`, and so are the errors.
    like : Photo, optional
        A photo like the one to be written: of its size, and with colours and alpha if it has them.
    beside : iterable of str, optional
        Extensions that the caller writes in another way, for the message.

    Examples
    --------
    >>> check_destination("face.gif")  # doctest: +ELLIPSIS
    Traceback (most recent call last):
        ...
    relit.errors.OutputError: face.gif: no format to write goes by '.gif'; use one of .jpg, ...
    """
    kind = _format_of(destination, like, format, beside)
    if like is not None:
        _check_fits(like, kind, name_of(destination))
    path = destination_of(destination)
    if isinstance(path, Path):
        check_free(path, overwrite=overwrite)


def not_kept(
    destination: FileOrName,
    photo: Photo,
    *,
    format: str | None = None,  # noqa: A002
) -> tuple[str, ...]:
    """Return, in words, what a photo holds beside its pixels that `write_image` cannot keep.

    Parameters
    ----------
    destination, format
        As for `write_image`.
    photo : Photo

    Returns
    -------
    tuple of str
        Empty where all is kept.

    Raises
    ------
    OutputError
        If the format is not known.

    Examples
    --------
    >>> from relit.photo.photo import Metadata
    >>> photo = Photo(np.zeros((2, 3), np.uint8), metadata=Metadata(iptc=bytes(5), dpi=(300, 300)))
    >>> not_kept("face.webp", photo), not_kept("face.tif", photo)
    (('the resolution', 'IPTC'), ())
    """
    kind = _format_of(destination, photo, format)
    _, lost = FORMATS[kind].fit(photo.metadata)
    finer = finer_subsampling(photo.jpeg) if kind == "JPEG" else None
    return (*lost, finer) if finer else lost


def joined(image: NDArray[Any] | Photo, like: Photo | None) -> Photo:
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
    space = "GRAY" if photo.is_grey else "RGB"
    return photo if photo.profile and color_space(photo.profile) == space else replace(photo, profile=None)


def _format_of(
    destination: FileOrName, like: Photo | None, given: str | None, beside: Iterable[str] = ()
) -> str:
    """Return the name of the format to write."""
    name = name_of(destination)
    if given is None:
        given = Path(name).suffix
        if not given and not isinstance(destination_of(destination), Path):
            given = like.format if like and like.format in FORMATS else "PNG"
    known = ", ".join((*_EXTENSIONS, *beside))
    if not given:
        if isinstance(destination, (str, Path)) and destination and Path(destination).is_dir():
            raise OutputError(f"{name}: is a folder; give the name of a file in it")
        raise OutputError(f"{name}: the name has no extension to tell the format; use one of {known}")
    kind = _KINDS.get("." + given.lower().removeprefix("."))
    if kind is None:
        raise OutputError(f"{name}: no format to write goes by {given!r}; use one of {known}")
    if library := FORMATS[kind].library:
        try:
            library()
        except ImageError as error:
            raise OutputError(f"{name}: {error}") from error
    return kind


def _check_fits(photo: Photo, kind: str, destination: str) -> None:
    """Refuse a photo that a format cannot hold."""
    known = FORMATS[kind]
    height, width = photo.pixels.shape[:2]
    problem = None
    if photo.alpha is not None and not known.alpha:
        problem = f"{kind} cannot hold the photo's alpha; write PNG, TIFF or WebP, or leave alpha out"
    elif not photo.is_grey and not known.colour:
        problem = f"{kind} cannot hold colours; write PPM, or another format"
    elif known.longest and max(height, width) > known.longest:
        problem = (
            f"{width}x{height} px is too large for {kind}, which ends at {known.longest}; write PNG or TIFF"
        )
    if problem:
        raise ImageError(f"{destination}: {problem}")
