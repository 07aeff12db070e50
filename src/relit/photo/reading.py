"""Photos out of files.

Read are JPEG, PNG, TIFF, WebP, PPM/PGM and BMP; grey or RGB, with or without alpha, of 8 or 16 bits, TIFF
also in floating point. With an extra each, ``relit[heic]``, ``relit[raw]`` and ``relit[exr]``: HEIC, camera
raw and OpenEXR.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from relit.errors import ImageError
from relit.photo.codecs.formats import SUFFIXES, decode
from relit.photo.codecs.metadata import put_upright
from relit.photo.profile import is_usable
from relit.photo.streams import name_of, open_source

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from relit.photo.photo import Photo
    from relit.photo.streams import FileOrName

#: More than any camera takes in one shot; as decoded RGB, 600 MB at 8 bits.
DEFAULT_MAX_PIXELS = 200_000_000
#: What names of the photos end with that `read_image` reads, in lower case; itself, it goes by content.
PHOTO_SUFFIXES = SUFFIXES
#: What a pixel may take on average before `max_pixels` counts it as more than one: 16 bits of RGB, from the
#: largest camera there is, 150 million px, are 900 MB. Decoding takes twice as much, and never above 2 GB.
_BYTES_A_PIXEL = 4.5
_SMALLEST_LIMIT = 1 << 26  # bytes of a file, whatever the pixels


def read_image(source: FileOrName, *, max_pixels: int = DEFAULT_MAX_PIXELS) -> Photo:
    """Read a photo.

    The format is recognized by content, not by name. EXIF orientation is applied. Palettes and bitmaps become
    RGB or grey; associated alpha in a TIFF or OpenEXR is divided out. Camera raw is developed to sRGB with
    the camera's white balance and no automatic brightening; the linear light of OpenEXR, which must lie in
    [0, 1], comes to the curve of sRGB. EXIF that cannot be parsed, and a colour profile that does not fit the
    pixels or is damaged, are left out; `not_kept` tells so.

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
    return _upright(_decoded(source, max_pixels))


class _SizeTold(BaseException):
    """Ends decoding once the size is known: no error, so that none who handles errors takes it for one."""


def claimed_size(source: FileOrName, *, max_pixels: int = DEFAULT_MAX_PIXELS) -> tuple[int, int, int]:
    """Return width, height and bytes a pixel that a photo claims to have; no pixel is decoded.

    Parameters
    ----------
    source, max_pixels
        As of `read_image`.

    Raises
    ------
    ImageError
        As `read_image` does, of what the head of the file tells.

    Examples
    --------
    >>> import io
    >>> claimed_size(io.BytesIO(b"P5 2 1 255 "))
    (2, 1, 3)
    """

    def tell(*size: int) -> None:
        raise _SizeTold(size)

    try:
        _decoded(source, max_pixels, tell)
    except _SizeTold as told:
        return told.args[0]  # type: ignore[no-any-return]
    raise AssertionError("decoders tell the size first")


def _decoded(
    source: FileOrName, max_pixels: int, tell: Callable[[int, int, int], None] = lambda *_: None
) -> Photo:
    """Return a photo as it lies in its file; its size is told before its pixels are decoded."""
    name = name_of(source)

    def check_size(width: int, height: int, depth: int = 3) -> None:
        """Refuse a size that is too large, at so many bytes a pixel."""
        claim, advice = f"claims {width}x{height} px", "raise max_pixels if you trust the file"
        if width * height == 0:
            raise ImageError(f"{claim}, which is no photo; get the file again")
        if width * height > max_pixels:
            raise ImageError(f"{claim}, more than the {max_pixels} px allowed; {advice}")
        if width * height * depth > (most := max_pixels * _BYTES_A_PIXEL):
            raise ImageError(f"{claim} of {depth} bytes each, more than {most / 1e6:.0f} MB; {advice}")
        tell(width, height, depth)

    with open_source(source, _SMALLEST_LIMIT + int(_BYTES_A_PIXEL * max_pixels)) as stream:
        try:
            return decode(stream, check_size)
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


def _upright(photo: Photo) -> Photo:
    """Apply the EXIF orientation, and leave out a profile that cannot be used."""
    orientation, metadata = put_upright(photo.metadata)
    profile = photo.profile

    def turned(plane: NDArray[Any]) -> NDArray[Any]:
        if orientation > 4:
            plane = plane.swapaxes(0, 1)
        if orientation in (2, 3, 6, 7):
            plane = plane[:, ::-1]
        if orientation in (3, 4, 7, 8):
            plane = plane[::-1]
        return np.ascontiguousarray(plane)

    pixels = turned(photo.pixels)
    if profile and not is_usable(profile, pixels):
        profile = None
        metadata = replace(metadata, left_out=(*metadata.left_out, "a colour profile that cannot be used"))
    return replace(
        photo,
        pixels=pixels,
        alpha=None if photo.alpha is None else turned(photo.alpha),
        profile=profile,
        metadata=metadata,
        jpeg=photo.jpeg.transposed() if photo.jpeg and orientation > 4 else photo.jpeg,
    )
