"""The photo formats: how to tell them, what each can hold, and how it is read and written.

No codec knows file names: what is wrong with a file, they say in messages that `relit.photo.photo` puts its
name before.
"""

from __future__ import annotations

import logging
import re
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any, BinaryIO

import numpy as np

from relit.errors import ImageError
from relit.photo.codecs.exr import decode_exr, encode_exr, openexr
from relit.photo.codecs.heif import decode_heif
from relit.photo.codecs.pillow import decode_with_pillow, encode_bmp, encode_jpeg, encode_webp
from relit.photo.codecs.png import decode_png, encode_png
from relit.photo.codecs.pnm import decode_pnm, encode_pnm
from relit.photo.codecs.raw import decode_raw
from relit.photo.codecs.tiff import decode_tiff, encode_tiff, is_camera_raw

if TYPE_CHECKING:
    from collections.abc import Callable

    from relit.photo.codecs.raster import CheckSize, Raster

# They log what they find odd in a file, and Python prints that where no logging has been set up.
for _library in ("imagecodecs", "tifffile"):
    logging.getLogger(_library).addHandler(logging.NullHandler())


@dataclass(frozen=True, kw_only=True)
class Readable:
    """A file format that can be read.

    Attributes
    ----------
    decode : callable
        Reads a `Raster` from a seekable binary file.
    signature : bytes
        Pattern of what its files start with.
    extensions : tuple of str
        What names of its files end with, the usual one first.
    """

    decode: Callable[[BinaryIO, CheckSize], Raster]
    signature: bytes
    extensions: tuple[str, ...]


@dataclass(frozen=True, kw_only=True)
class Format(Readable):
    """A file format that can be read and written.

    Attributes
    ----------
    encode : callable
        Turns a `Raster` into bytes.
    deepest : dtype
        The largest depth it is written at: uint8, uint16 or float32.
    alpha, colour : bool
        Whether it can hold alpha, and colours.
    profiles : tuple of str
        Colour spaces of the ICC profiles it can hold.
    longest : int or None
        The longest side in px, where the format sets one.
    library : callable or None
        Loads the optional library that it takes; raises where that is missing.
    """

    encode: Callable[[Raster], bytes]
    deepest: Any
    alpha: bool = True
    colour: bool = True
    profiles: tuple[str, ...] = ("GRAY", "RGB")
    longest: int | None = None
    library: Callable[[], Any] | None = None


FORMATS: dict[str, Format] = {
    "JPEG": Format(
        decode=partial(decode_with_pillow, name="JPEG"),
        encode=encode_jpeg,
        signature=rb"\xff\xd8\xff",
        extensions=(".jpg", ".jpeg"),
        deepest=np.uint8,
        alpha=False,
        longest=65500,
    ),
    "PNG": Format(
        decode=decode_png,
        encode=encode_png,
        signature=rb"\x89PNG\r\n\x1a\n",
        extensions=(".png",),
        deepest=np.uint16,
    ),
    "TIFF": Format(
        decode=decode_tiff,
        encode=encode_tiff,
        signature=rb"II[*+]\0|MM\0[*+]",
        extensions=(".tif", ".tiff"),
        deepest=np.float32,
    ),
    "WEBP": Format(
        decode=partial(decode_with_pillow, name="WEBP"),
        encode=encode_webp,
        signature=rb"RIFF....WEBP",
        extensions=(".webp",),
        deepest=np.uint8,
        profiles=("RGB",),  # grey is stored as RGB
        longest=16383,
    ),
    "PPM": Format(
        decode=decode_pnm,
        encode=encode_pnm,
        signature=rb"P[36][\s#]",
        extensions=(".ppm", ".pnm"),
        deepest=np.uint16,
        alpha=False,
        profiles=(),
    ),
    "PGM": Format(
        decode=decode_pnm,
        encode=encode_pnm,
        signature=rb"P[1245][\s#]",
        extensions=(".pgm",),
        deepest=np.uint16,
        alpha=False,
        colour=False,
        profiles=(),
    ),
    "BMP": Format(
        decode=partial(decode_with_pillow, name="BMP"),
        encode=encode_bmp,
        signature=rb"BM",
        extensions=(".bmp",),
        deepest=np.uint8,
        alpha=False,
        profiles=(),
    ),
    "EXR": Format(
        decode=decode_exr,
        encode=encode_exr,
        signature=rb"v/1\x01",
        extensions=(".exr",),
        deepest=np.float32,
        profiles=(),
        library=openexr,
    ),
}

READ_ONLY: dict[str, Readable] = {
    # Canon, Panasonic, Olympus and Fujifilm; the raw files of others look like TIFFs.
    "RAW": Readable(
        decode=decode_raw,
        signature=rb"II\*\0....CR\x02|II\x1a\0\0\0HEAPCCDR|....ftypcrx |IIU\0|IIR[OS]|MMOR|FUJIFILMCCD-RAW",
        extensions=(".dng", ".cr2", ".cr3", ".nef", ".arw", ".raf", ".orf", ".rw2", ".pef", ".srw"),
    ),
    "HEIC": Readable(
        decode=decode_heif,
        signature=rb"....ftyp(hei[cxms]|mif1(?!.*avi[fs]))",
        extensions=(".heic", ".heif", ".hif"),
    ),
}

_OTHERS = {
    "a GIF": rb"GIF8",
    "an animated HEIC": rb"....ftyp(hev|msf1(?!.*avi[fs]))",
    "an AVIF": rb"....ftyp(avi|mif1|msf1)",
    "a video": rb"....ftyp",
    "a JPEG XL": rb"\xff\x0a|\0\0\0\x0cJXL ",
    "a JPEG 2000": rb"\0\0\0\x0cjP  |\xff\x4f\xff\x51",
    "a Photoshop": rb"8BPS",
    "a PDF": rb"%PDF",
    "a text": rb"[^\0-\x08\x0e-\x1f]*$",
    "an unknown": rb"",
}


#: What names of photos end with, in lower case.
SUFFIXES = frozenset(
    extension for known in (*FORMATS.values(), *READ_ONLY.values()) for extension in known.extensions
)


def _readable() -> dict[str, Readable]:
    return {**READ_ONLY, **FORMATS}


def identify(stream: BinaryIO) -> str:
    """Return the format of a seekable binary file, told by its content.

    Raises
    ------
    ImageError
        If it is none that can be read; the message says what was found instead.
    """
    head = stream.read(64)
    stream.seek(0)
    if not head:
        raise ImageError("is empty; get the file again")
    for name, known in _readable().items():
        if re.match(known.signature, head, re.DOTALL):
            return "RAW" if name == "TIFF" and is_camera_raw(stream) else name
    found = next(name for name, signature in _OTHERS.items() if re.match(signature, head, re.DOTALL))
    raise ImageError(f"found {found} file; convert it to JPEG, PNG, TIFF, WebP, PPM, PGM or BMP first")


def decode(stream: BinaryIO, name: str, check_size: CheckSize) -> Raster:
    """Decode a file of a known format.

    Parameters
    ----------
    stream : seekable binary file
    name : str
        The format, as `identify` returns it.
    check_size : callable
        Called with width and height as soon as they are known, before any pixel is decoded; may raise.

    Raises
    ------
    ImageError
        If the file is damaged, or holds something else than one grey or RGB photo.
    """
    try:
        return _readable()[name].decode(stream, check_size)
    except (ImageError, MemoryError):
        raise
    except Exception as error:
        # There is hardly an exception that decoders do not raise on damaged data.
        raise ImageError(f"the {name} data is damaged or cut short; get the file again") from error
