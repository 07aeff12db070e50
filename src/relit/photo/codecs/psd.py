"""PSD: Photoshop's own format, which Krita, GIMP and Affinity open as well.

Adobe's "Photoshop File Format Specification" has the format. Libraries write it with 8 bits alone.
"""

from __future__ import annotations

import struct
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import cv2
import numpy as np

from relit.photo.codecs.photoshop import joined, numbers, resource
from relit.photo.pixels import full_of, to_unit

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from relit.photo.layers import Layer, Layers
    from relit.photo.photo import Photo

_GREY, _RGB = 1, 3  # modes of colour
_RUNS = 1  # compression, row by row, by PackBits
_MODES = {"normal": b"norm", "multiply": b"mul ", "color-dodge": b"div "}
_HIDDEN, _FLAGS_COUNT = 2, 8  # flags of a layer; the second says that another one means something
_RESOLUTION, _PROFILE, _EXIF, _XMP = 1005, 1039, 1058, 1060  # numbers of resources
_PER_INCH, _INCHES = 1, 1  # units of the resolution, and to show sizes in


def encode_psd(layers: Layers) -> bytes:
    """Write layers as a PSD, with 8 or 16 bits."""
    picture = layers.picture
    height, width, channels = picture.samples.shape
    bits = 8 * picture.pixels.itemsize
    mode = _GREY if picture.is_grey else _RGB
    head = struct.pack(">4sH6xHIIHH", b"8BPS", 1, channels, height, width, bits, mode)
    lengths, rows = _packed(_planes(_on_white(picture)))
    parts = [
        head,
        *_block(b""),  # no table of colours
        *_block(_resources(picture)),
        *_block(*_layer_section(layers, bits)),
        struct.pack(">H", _RUNS),
        lengths,
        rows,
    ]
    return b"".join(parts)


def _layer_section(layers: Layers, bits: int) -> list[bytes]:
    """Return the layers, from the lowest, and where files of 8 bits, and of more, have them."""
    below = layers.layers[::-1]
    coded = [_coded(layer) for layer in below]
    # Below 0, to say that the whole picture's alpha is what can be seen through, and no channel to save.
    count = -len(below) if layers.picture.alpha is not None else len(below)
    records = b"".join(record for record, _ in coded)
    info = [struct.pack(">h", count), records, *(data for _, data in coded)]
    if bits == 8:
        return [*_block(*info, align=2), *_block(b"")]
    return [*_block(b""), *_block(b""), b"8BIMLr16", *_block(*info, align=4)]


def _coded(layer: Layer) -> tuple[bytes, bytes]:
    """Return the record of a layer, and its pixels."""
    height, width = layer.photo.pixels.shape[:2]
    planes = _planes(layer.photo)
    numbers = [*range(len(planes))]
    if layer.photo.alpha is not None:
        numbers[-1] = -1
    packed = [_even(struct.pack(">H", _RUNS), *_packed([plane])) for plane in planes]
    record = struct.pack(">4iH", layer.top, layer.left, layer.top + height, layer.left + width, len(planes))
    for number, data in zip(numbers, packed, strict=True):
        record += struct.pack(">hI", number, len(data))
    flags = _FLAGS_COUNT | (0 if layer.visible else _HIDDEN)
    record += struct.pack(">4s4sBBBx", b"8BIM", _MODES[layer.mode], 255, 0, flags)
    name = layer.name.encode("mac-roman", "replace")[:255]
    told = bytes([len(name)]) + name
    unicode = struct.pack(">I", len(layer.name)) + layer.name.encode("utf-16-be")
    extra = [*_block(b""), *_block(b""), told + bytes(-len(told) % 4), b"8BIMluni", *_block(unicode, align=4)]
    return record + b"".join(_block(*extra)), b"".join(packed)


def _even(*parts: bytes) -> bytes:
    """Return parts filled up to an even length, where Pillow looks for the next channel."""
    data = b"".join(parts)
    return data + bytes(len(data) % 2)


def _on_white(picture: Photo) -> Photo:
    """Return a picture with its colours laid on white as far as one sees through them, as Photoshop does.

    Readers undo that.
    """
    if picture.alpha is None:
        return picture
    full = full_of(picture.pixels.dtype)
    alpha = to_unit(picture.alpha) if picture.is_grey else to_unit(picture.alpha)[..., None]
    laid = np.rint(full - alpha * (full - picture.pixels.astype(np.float32)))
    return replace(picture, pixels=laid.astype(picture.pixels.dtype))


def _planes(photo: Photo) -> list[NDArray[Any]]:
    """Return the channels of a photo, alpha last."""
    return [np.asarray(plane) for plane in cv2.split(photo.samples)]


def _packed(planes: Sequence[NDArray[Any]]) -> tuple[bytes, bytes]:
    """Return how long each row of channels is when packed, and the rows."""
    import imagecodecs

    rows = [
        imagecodecs.packbits_encode(row)
        for plane in planes
        for row in plane.astype(plane.dtype.newbyteorder(">"), copy=False).view(np.uint8)
    ]
    return struct.pack(f">{len(rows)}H", *map(len, rows)), b"".join(rows)


def _resources(photo: Photo) -> bytes:
    """Return the profile and the metadata of a photo."""
    metadata, found = photo.metadata, {}
    others = joined(metadata.iptc, metadata.photoshop)
    if metadata.dpi:
        dots = [(round(count * 0x10000), _PER_INCH, _INCHES) for count in metadata.dpi]
        found[_RESOLUTION] = b"".join(struct.pack(">IHH", *axis) for axis in dots)
    kept = {_PROFILE: photo.profile, _EXIF: metadata.exif, _XMP: metadata.xmp}
    found |= {number: data for number, data in kept.items() if data}
    told = numbers(others)
    return others + b"".join(resource(number, data) for number, data in found.items() if number not in told)


def _block(*parts: bytes, align: int = 1) -> list[bytes]:
    """Return parts with their length before them, filled up to a multiple of so many bytes."""
    length = sum(map(len, parts))
    fill = -length % align
    return [struct.pack(">I", length + fill), *parts, bytes(fill)]
