"""TIFF: read by tifffile in any depth and compression, written with deflate through Pillow's directories.

tifffile would also write the pixels, but not the EXIF and GPS directories; Pillow writes the directories,
but not 16 bits of RGB.
"""

from __future__ import annotations

import reprlib
from contextlib import suppress
from dataclasses import replace
from itertools import accumulate, islice
from typing import TYPE_CHECKING, Any, BinaryIO

import numpy as np
from PIL.ExifTags import Base

from relit.errors import ImageError
from relit.photo.codecs.geotiff import Geo, add_geo, read_geo
from relit.photo.codecs.metadata import resolution
from relit.photo.codecs.photoshop import iptc_of, split
from relit.photo.codecs.tiff_tags import HEADER, directory_of, exif_of
from relit.photo.photo import Metadata, Photo
from relit.photo.pixels import divide_by_alpha, full_of, to_depth

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from relit.photo.codecs import CheckSize

_IPTC, _PHOTOSHOP, _PHOTOSHOP_LAYERS = 33723, 34377, 37724
_STRIP_BYTES = 1 << 18
_MOST_PAGES = 64  # the photo and what is reduced from it
#: None, the fax codes, LZW, JPEG, deflate, PackBits, deflate by its old number, LZMA, and Zstandard: what is
#: in use for photos, and cannot unpack to more than the strip or tile takes.
_COMPRESSIONS = {1, 2, 3, 4, 5, 7, 8, 32773, 32946, 34925, 50000}


def decode_tiff(stream: BinaryIO, check_size: CheckSize) -> Photo:
    """Read a TIFF of one page; 1 to 7 bits become 8, 9 to 15 bits become 16."""
    import tifffile

    with tifffile.TiffFile(stream) as file:
        pages: Any = file.pages
        page = pages.first
        others = list(islice(pages, 1, _MOST_PAGES + 1))  # one at a time: they may go in a circle
        if len(others) == _MOST_PAGES or any(not other.is_reduced for other in others):
            raise ImageError("holds several pages; save one as a photo of its own")
        _check_page(page, check_size)
        samples = _samples(page)
        metadata = replace(_metadata(stream, page, read_geo(page.tags)), dpi=_resolution(page))
        return Photo.from_samples(samples, _bytes(page, Base.InterColorProfile), metadata)


def is_camera_raw(stream: BinaryIO) -> bool:
    """Return whether a TIFF starts with a preview, or with what a sensor saw."""
    import tifffile

    sensor = (tifffile.PHOTOMETRIC.CFA, tifffile.PHOTOMETRIC.LINEAR_RAW)
    try:
        with suppress(Exception), tifffile.TiffFile(stream) as file:
            page: Any = file.pages.first
            return page.is_reduced or page.photometric in sensor
        return False
    finally:
        stream.seek(0)


def read_metadata(stream: BinaryIO) -> Metadata:
    """Return the EXIF and XMP of a TIFF, or of what is like one; nothing where it is not.

    What else a camera's raw file tells is about what its sensor saw, and is not named as lost.
    """
    import tifffile

    stream.seek(0)
    with suppress(Exception), tifffile.TiffFile(stream) as file:
        return replace(_metadata(stream, file.pages.first), left_out=())
    return Metadata()


def encode_tiff(photo: Photo) -> bytes:
    """Write a TIFF, lossless, at 8 or 16 bits or in float32."""
    import imagecodecs

    samples, metadata = photo.samples, photo.metadata
    height, width, channels = samples.shape
    is_float = samples.dtype.kind == "f"
    predict = imagecodecs.floatpred_encode if is_float else imagecodecs.delta_encode
    rows = min(height, max(1, _STRIP_BYTES // samples[0].nbytes))
    little = samples.astype(samples.dtype.newbyteorder("<"), copy=False)
    strips = [
        bytes(imagecodecs.deflate_encode(predict(little[top : top + rows], axis=1).tobytes()))
        for top in range(0, height, rows)
    ]

    directory, _ = directory_of(metadata.exif)
    directory[Base.Orientation] = 1
    directory[Base.ImageWidth], directory[Base.ImageLength] = width, height
    directory[Base.BitsPerSample] = (8 * samples.itemsize,) * channels
    directory[Base.Compression] = 8  # deflate
    directory[Base.PhotometricInterpretation] = 1 if photo.is_grey else 2  # black at 0, or RGB
    starts = accumulate(map(len, strips[:-1]), initial=0)
    directory[Base.StripOffsets] = tuple(starts)  # to which Pillow adds where the first one starts
    directory[Base.StripByteCounts] = tuple(map(len, strips))
    directory[Base.RowsPerStrip] = rows
    directory[Base.SamplesPerPixel] = channels
    directory[Base.PlanarConfiguration] = 1  # channels side by side
    directory[Base.Predictor] = 3 if is_float else 2
    directory[Base.SampleFormat] = (3 if is_float else 1,) * channels
    if photo.alpha is not None:
        directory[Base.ExtraSamples] = 2  # alpha the colours are not multiplied with
    if metadata.dpi:
        directory[Base.XResolution], directory[Base.YResolution] = metadata.dpi
        directory[Base.ResolutionUnit] = 2  # inches
    if metadata.xmp:
        directory[Base.XMLPacket] = metadata.xmp
    if metadata.iptc:
        directory[_IPTC] = metadata.iptc
    if metadata.photoshop:
        directory[_PHOTOSHOP] = metadata.photoshop
    add_geo(directory, metadata.geo)
    if photo.profile:
        directory[Base.InterColorProfile] = photo.profile
    return HEADER + directory.tobytes(len(HEADER)) + b"".join(strips)


def lost_in_tiff(metadata: Metadata) -> tuple[str, ...]:
    """Return, in words, what `encode_tiff` loses of an EXIF block."""
    return directory_of(metadata.exif)[1]


def _check_page(page: Any, check_size: CheckSize) -> None:
    """Refuse what is too large, takes more to decode than the picture does, or is not all there."""
    depth = page.samplesperpixel * max(1, page.bitspersample // 8)
    check_size(page.imagewidth, page.imagelength, depth)
    if page.compression not in _COMPRESSIONS:
        raise ImageError(f"is compressed with {_called(page.compression)}; save it with deflate, LZW or none")
    if 0 in page.databytecounts:  # which tifffile takes for black
        raise ImageError("lacks a part of its picture; get the file again")
    if page.is_tiled:
        check_size(page.tilewidth, page.tilelength, depth)


def _metadata(stream: BinaryIO, page: Any, geo: Geo = ()) -> Metadata:
    tags, kept = page.tags, {code for code, _ in geo}
    orientation = tags.valueof(Base.Orientation, default=1)
    exif, lost = exif_of(stream, [tag.code for tag in tags if tag.code not in kept], orientation)
    iptc, photoshop = split(_bytes(page, _PHOTOSHOP) or b"")
    alone = iptc_of(_bytes(page, _IPTC) or b"")
    # ImageMagick cuts the one that stands alone to a quarter.
    iptc = iptc if iptc and iptc.startswith(alone or b"") else alone
    left_out = (*lost, "Photoshop's layers") if _PHOTOSHOP_LAYERS in tags else lost
    xmp = _bytes(page, Base.XMLPacket)
    return Metadata(exif, xmp, iptc=iptc, photoshop=photoshop, geo=geo, left_out=left_out)


def _called(value: object) -> str:
    """Return what to call the value of a tag, which in a damaged file may be anything."""
    return str(getattr(value, "name", None) or reprlib.repr(value))


def _samples(page: Any) -> NDArray[Any]:
    """Decode a page of grey or RGB, with or without alpha."""
    from tifffile import COMPRESSION, EXTRASAMPLE, PHOTOMETRIC, PLANARCONFIG

    grey = (PHOTOMETRIC.MINISWHITE, PHOTOMETRIC.MINISBLACK, PHOTOMETRIC.PALETTE)
    colours = {PHOTOMETRIC.RGB: 3, **dict.fromkeys(grey, 1)}
    if page.compression == COMPRESSION.JPEG:
        colours[PHOTOMETRIC.YCBCR] = 3  # decoding it gives RGB
    if page.photometric not in colours:
        raise ImageError(f"holds {_called(page.photometric)} colours; convert it to RGB or grey first")
    extra = page.samplesperpixel - colours[page.photometric]
    if extra not in (0, 1) or page.imagedepth != 1:
        raise ImageError("holds more than grey or RGB and alpha; save these alone")

    samples = page.asarray()
    if page.planarconfig == PLANARCONFIG.SEPARATE and page.samplesperpixel > 1:
        samples = np.moveaxis(samples, 0, -1)
    samples = samples.reshape(page.imagelength, page.imagewidth, page.samplesperpixel)
    if page.photometric == PHOTOMETRIC.PALETTE:
        return np.moveaxis((page.colormap >> 8).astype(np.uint8)[:, samples[..., 0]], 0, -1)
    samples = _whole_range(samples, page.bitspersample)
    if page.photometric == PHOTOMETRIC.MINISWHITE:
        samples[..., 0] = full_of(samples.dtype) - samples[..., 0]
    if extra and page.extrasamples[:1] == (EXTRASAMPLE.ASSOCALPHA,):
        divide_by_alpha(samples)
    return samples


def _whole_range(samples: NDArray[Any], bits: int) -> NDArray[Any]:
    """Return samples of so many bits as uint8, uint16, or float32 in [0, 1]."""
    if samples.dtype.kind == "f":
        low, high = samples.min(), samples.max()
        if not (low >= 0 and high <= 1):
            raise ImageError(f"holds floating point values from {low:g} to {high:g}; bring them into [0, 1]")
        return samples.astype(np.float32)
    if samples.dtype.kind not in "bu" or bits > 16:
        raise ImageError(f"holds {samples.dtype} values; save it with 8 or 16 bits, or floats in [0, 1]")
    return to_depth(samples, np.uint8 if bits <= 8 else np.uint16, 2**bits - 1)


def _bytes(page: Any, tag: int) -> bytes | None:
    """Return the value of a tag that holds bytes, which tifffile may take for numbers."""
    value: Any = page.tags.valueof(tag)
    return value if isinstance(value, bytes) else None


def _resolution(page: Any) -> tuple[float, float] | None:
    per_inch = {2: 1.0, 3: 2.54}.get(page.tags.valueof(Base.ResolutionUnit, default=2), 0.0)
    try:
        (a, b), (c, d) = (page.tags.valueof(tag) for tag in (Base.XResolution, Base.YResolution))
        return resolution(a / b * per_inch, c / d * per_inch)
    except (TypeError, ValueError, ZeroDivisionError):
        return None
