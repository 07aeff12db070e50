"""PNM: portable bit-, grey- and pixmaps, plain or binary, of 8 or 16 bits.

Read here and not by a library: Pillow takes 16 bits of RGB down to 8, and netpbmfile's pattern for the header
goes through comments in exponential time.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any, BinaryIO

import numpy as np

from relit.errors import ImageError
from relit.photo.photo import Photo
from relit.photo.pixels import to_depth

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from relit.photo.codecs import CheckSize

_GAP = rb"(?:\s|#[^\r\n]*[\r\n])++"
_START = re.compile(rb"P([1-6])" + _GAP + rb"([0-9]{1,10})" + _GAP + rb"([0-9]{1,10})")
_MAXIMUM = re.compile(_GAP + rb"([0-9]{1,10})")
_COMMENT = re.compile(rb"#[^\r\n]*")
_BLANKS = b" \t\n\v\f\r"


def decode_pnm(stream: BinaryIO, check_size: CheckSize) -> Photo:
    """Read the first image of a PNM file, its values spread over the whole range of 8 or 16 bits."""
    data = stream.read()
    start = _START.match(data)
    if start is None:
        raise ImageError("does not state its width and height; get the file again")
    kind, width, height = map(int, start.groups())
    check_size(width, height)
    if kind in (1, 4):
        bits = (_plain_bits if kind == 1 else _bits)(data, start.end(), width, height)
        return Photo.from_samples(np.where(bits, np.uint8(0), np.uint8(255)))  # 1 is ink
    stated = _MAXIMUM.match(data, start.end())
    maximum = int(stated[1]) if stated else 0
    if stated is None or not 0 < maximum <= 65535:
        raise ImageError(f"states {maximum} as its largest value; it must be 1 to 65535")
    depth = 3 if kind in (3, 6) else 1
    count = width * height * depth
    if kind in (2, 3):
        values = _plain_values(data[stated.end() :], count)
    else:
        values = np.frombuffer(data, ">u2" if maximum > 255 else np.uint8, count, stated.end() + 1)
    dtype = np.uint8 if maximum < 256 else np.uint16
    return Photo.from_samples(to_depth(values.reshape(height, width, depth), dtype, maximum))


def encode_pnm(photo: Photo) -> bytes:
    """Write a binary PGM or PPM, whichever the samples are."""
    samples = photo.samples
    height, width, channels = samples.shape
    kind = 5 if channels == 1 else 6
    header = f"P{kind}\n{width} {height}\n{np.iinfo(samples.dtype).max}\n".encode()
    return header + samples.astype(samples.dtype.newbyteorder(">"), copy=False).tobytes()


def _bits(data: bytes, end: int, width: int, height: int) -> NDArray[Any]:
    row = -(-width // 8)
    packed = np.frombuffer(data, np.uint8, row * height, end + 1).reshape(height, row)
    return np.unpackbits(packed, axis=1, count=width)


def _plain_bits(data: bytes, end: int, width: int, height: int) -> NDArray[Any]:
    digits = _COMMENT.sub(b"", data[end:]).translate(None, _BLANKS)
    bits = np.frombuffer(digits, np.uint8, width * height) - ord("0")
    if bits.max() > 1:
        raise ImageError("holds something else than bits; get the file again")
    return bits.reshape(height, width)


def _plain_values(text: bytes, count: int) -> NDArray[Any]:
    text = _COMMENT.sub(b"", text).strip()  # NumPy takes blanks alone for a 0
    if text.translate(None, b"0123456789" + _BLANKS):
        raise ImageError("holds something else than numbers; get the file again")
    values = np.fromstring(text, np.uint32, sep=" ")
    if len(values) < count:
        raise ImageError(f"holds {len(values)} values instead of {count}; get the file again")
    return values[:count]
