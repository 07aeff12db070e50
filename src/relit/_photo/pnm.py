"""PNM: portable bit-, grey- and pixmaps, plain or binary, of 8 or 16 bits."""

from __future__ import annotations

from typing import TYPE_CHECKING, BinaryIO

import numpy as np

from relit._photo.raster import Raster, rescale
from relit.errors import ImageError

if TYPE_CHECKING:
    from relit._photo.raster import CheckSize


def decode_pnm(stream: BinaryIO, check_size: CheckSize) -> Raster:
    """Read the first image of a PNM file, its values spread over the whole range of 8 or 16 bits."""
    import netpbmfile

    image = netpbmfile.NetpbmFile(stream)
    check_size(image.width, image.height)
    if not 0 < image.maxval <= 65535:
        raise ImageError(f"states {image.maxval} as its largest value; it must be 1 to 65535")
    samples = image.asarray().reshape(-1, image.height, image.width, image.depth)[0]
    if image.magicnumber in ("P1", "P4"):
        samples = ~samples  # in bitmaps, 1 is ink
    return Raster(rescale(samples, image.maxval, np.uint8 if image.maxval < 256 else np.uint16))


def encode_pnm(raster: Raster) -> bytes:
    """Write a binary PGM or PPM, whichever the samples are."""
    samples = raster.samples
    height, width, channels = samples.shape
    kind = 5 if channels == 1 else 6
    header = f"P{kind}\n{width} {height}\n{np.iinfo(samples.dtype).max}\n".encode()
    return header + samples.astype(samples.dtype.newbyteorder(">"), copy=False).tobytes()
