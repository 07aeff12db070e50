"""The photo formats: how to tell them, what each can hold, and how it is read and written.

Codecs see no file names: `read_image` puts the name before the message of an error.
"""

from __future__ import annotations

import logging
import re
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, BinaryIO

import numpy as np

from relit.errors import ImageError
from relit.photo.codecs.extras import decode_exr, decode_heif, decode_raw, encode_exr, openexr
from relit.photo.codecs.jpeg import decode_jpeg, encode_jpeg
from relit.photo.codecs.keeping import OF_PHOTOSHOP, fitted
from relit.photo.codecs.pillow import decode_bmp, decode_webp, encode_bmp, encode_webp
from relit.photo.codecs.png import decode_png, encode_png
from relit.photo.codecs.pnm import decode_pnm, encode_pnm
from relit.photo.codecs.tiff import decode_tiff, encode_tiff, is_camera_raw, lost_in_tiff

if TYPE_CHECKING:
    from collections.abc import Callable

    from relit.photo.codecs import CheckSize
    from relit.photo.photo import Metadata, Photo

# They log what they find odd in a file, and Python prints that where no logging has been set up.
for _library in ("imagecodecs", "tifffile"):
    logging.getLogger(_library).addHandler(logging.NullHandler())


@dataclass(frozen=True)
class Readable:
    """A file format that can be read."""

    decode: Callable[[BinaryIO, CheckSize], Photo]  # of a seekable file; the photo is not yet upright
    signature: bytes  # pattern of what its files start with
    extensions: tuple[str, ...]  # what names of its files end with, the usual one first


@dataclass(frozen=True)
class Format(Readable):
    """A file format that can be read and written."""

    encode: Callable[[Photo], bytes]
    deepest: Any  # the largest depth it is written at: uint8, uint16 or float32
    alpha: bool = True  # whether it can hold alpha
    colour: bool = True  # whether it can hold colours
    profiles: tuple[str, ...] = ("GRAY", "RGB")  # colour spaces of the ICC profiles it can hold
    longest: int | None = None  # px of a side, where the format sets a limit
    library: Callable[[], Any] | None = None  # loads an optional library, or raises where that is missing
    holds: tuple[str, ...] = ()  # the fields of `Metadata` it has a place for
    segments: bool = False  # whether each of them must fit a JPEG's segment
    loses: Callable[[Metadata], tuple[str, ...]] = lambda _: ()  # in words, what it loses of what it holds

    def fit(self, metadata: Metadata) -> tuple[Metadata, tuple[str, ...]]:
        """Return what it keeps of metadata, and in words what it cannot hold."""
        kept, lost = fitted(metadata, self.holds, segments=self.segments)
        return kept, (*lost, *self.loses(kept))


_JPEG, _PNG, _TIFF = rb"\xff\xd8\xff", rb"\x89PNG\r\n\x1a\n", rb"II[*+]\0|MM\0[*+]"
_PPM, _PGM = rb"P[36][\s#]", rb"P[1245][\s#]"
_HEIC = rb"....ftyp(hei[cxms]|mif1(?!.*avi[fs]))"
# Canon, Panasonic, Olympus and Fujifilm; the raw files of others look like TIFFs.
_RAW = rb"II\*\0....CR\x02|II\x1a\0\0\0HEAPCCDR|....ftypcrx |IIU\0|IIR[OS]|MMOR|FUJIFILMCCD-RAW"
_RAW_SUFFIXES = (".dng", ".cr2", ".cr3", ".nef", ".arw", ".raf", ".orf", ".rw2", ".pef", ".srw")

# fmt: off
READ_ONLY: dict[str, Readable] = {
    "RAW": Readable(decode_raw, _RAW, _RAW_SUFFIXES),
    "HEIC": Readable(decode_heif, _HEIC, (".heic", ".heif", ".hif")),
}
FORMATS: dict[str, Format] = {
    "JPEG": Format(decode_jpeg, _JPEG, (".jpg", ".jpeg"), encode_jpeg, np.uint8, alpha=False, longest=65500,
                   holds=(*OF_PHOTOSHOP, "comments"), segments=True),
    "PNG": Format(decode_png, _PNG, (".png",), encode_png, np.uint16,
                  holds=(*OF_PHOTOSHOP, "text", "names_srgb")),
    "TIFF": Format(decode_tiff, _TIFF, (".tif", ".tiff"), encode_tiff, np.float32,
                   holds=(*OF_PHOTOSHOP, "geo"), loses=lost_in_tiff),
    "WEBP": Format(decode_webp, rb"RIFF....WEBP", (".webp",), encode_webp, np.uint8,
                   profiles=("RGB",), longest=16383, holds=("exif", "xmp")),  # grey is stored as RGB
    "PPM": Format(decode_pnm, _PPM, (".ppm", ".pnm"), encode_pnm, np.uint16, alpha=False, profiles=()),
    "PGM": Format(decode_pnm, _PGM, (".pgm",), encode_pnm, np.uint16, alpha=False, colour=False, profiles=()),
    "BMP": Format(decode_bmp, rb"BM", (".bmp",), encode_bmp, np.uint8, alpha=False, profiles=(),
                  holds=("dpi",)),
    "EXR": Format(decode_exr, rb"v/1\x01", (".exr",), encode_exr, np.float32, profiles=(), library=openexr),
}
# fmt: on

_OTHERS = {
    "a GIF": rb"GIF8",
    "an animated HEIC": rb"....ftyp(hev|msf1(?!.*avi[fs]))",
    "an AVIF": rb"....ftyp(avi|mif1|msf1)",
    "a video": rb"....ftyp",
    "a JPEG XL": rb"\xff\x0a|\0\0\0\x0cJXL ",
    "a JPEG 2000": rb"\0\0\0\x0cjP  |\xff\x4f\xff\x51",
    "a Photoshop": rb"8BPS",
    "an OpenRaster": rb"PK\x03\x04.{26}mimetypeimage/openraster",
    "a PDF": rb"%PDF",
    "a text": rb"[^\0-\x08\x0e-\x1f]*$",
    "an unknown": rb"",
}


def _readable() -> dict[str, Readable]:
    return {**READ_ONLY, **FORMATS}


#: What names of photos end with, in lower case.
SUFFIXES = frozenset(suffix for known in _readable().values() for suffix in known.extensions)


def decode(stream: BinaryIO, check_size: CheckSize) -> Photo:
    """Decode a seekable binary file of any format, recognized by its content; the photo is not yet upright.

    Parameters
    ----------
    stream : seekable binary file
    check_size : callable
        Called with width and height as soon as they are known, before any pixel is decoded; may raise.

    Raises
    ------
    ImageError
        If the file is of no format that can be read, is damaged, or holds something else than one grey or
        RGB photo.
    """
    name = _identify(stream)
    try:
        return replace(_readable()[name].decode(stream, check_size), format=name)
    except (ImageError, MemoryError):
        raise
    except Exception as error:
        # There is hardly an exception that decoders do not raise on damaged data.
        raise ImageError(f"the {name} data is damaged or cut short; get the file again") from error


def _identify(stream: BinaryIO) -> str:
    """Return the name of a file's format; where it is none of ours, the error names what was found."""
    head = stream.read(64)
    stream.seek(0)
    if not head:
        raise ImageError("is empty; get the file again")
    for name, known in _readable().items():
        if re.match(known.signature, head, re.DOTALL):
            return "RAW" if name == "TIFF" and is_camera_raw(stream) else name
    found = next(name for name, signature in _OTHERS.items() if re.match(signature, head, re.DOTALL))
    raise ImageError(f"found {found} file; convert it to JPEG, PNG, TIFF, WebP, PPM, PGM or BMP first")
