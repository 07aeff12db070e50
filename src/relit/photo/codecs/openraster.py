"""OpenRaster: a ZIP of PNGs and a list of them, which Krita, GIMP and MyPaint open as layers.

https://www.openraster.org has the format.
"""

from __future__ import annotations

import io
import zipfile
from typing import TYPE_CHECKING
from xml.etree import ElementTree as ET

import cv2
import numpy as np

from relit.photo.codecs.png import encode_png
from relit.photo.photo import Photo
from relit.photo.pixels import to_depth

if TYPE_CHECKING:
    from relit.photo.layers import Layers

_VERSION = "0.0.3"
_THUMBNAIL = 256  # px of a side at most
_MODES = {"normal": "svg:src-over", "multiply": "svg:multiply", "color-dodge": "svg:color-dodge"}


def encode_openraster(layers: Layers) -> bytes:
    """Write layers as an OpenRaster, of PNGs with 8 or 16 bits."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as archive:

        def add(name: str, data: bytes) -> None:
            archive.writestr(zipfile.ZipInfo(name), data)  # stored as it is, and without the time of day

        add("mimetype", b"image/openraster")  # first, so that it is at a fixed place
        add("stack.xml", _stack(layers))
        picture = encode_png(layers.picture)
        for number, layer in enumerate(layers.layers):
            same = layer.photo is layers.picture
            add(f"data/layer{number}.png", picture if same else encode_png(layer.photo))
        add("mergedimage.png", picture)
        add("Thumbnails/thumbnail.png", encode_png(_thumbnail(layers.picture)))
    return buffer.getvalue()


def _stack(layers: Layers) -> bytes:
    """Return the list of layers as XML."""
    height, width = layers.picture.pixels.shape[:2]
    attributes = {"version": _VERSION, "w": str(width), "h": str(height)}
    if dpi := layers.picture.metadata.dpi:
        attributes |= dict(zip(("xres", "yres"), (str(round(dots)) for dots in dpi), strict=True))
    root = ET.Element("image", attributes)
    stack = ET.SubElement(root, "stack")
    for number, layer in enumerate(layers.layers):
        shown = {
            "name": layer.name,
            "src": f"data/layer{number}.png",
            "x": str(layer.left),
            "y": str(layer.top),
            "opacity": "1.0",
            "visibility": "visible" if layer.visible else "hidden",
            "composite-op": _MODES[layer.mode],
        }
        ET.SubElement(stack, "layer", shown)
    return bytes(ET.tostring(root, encoding="UTF-8", xml_declaration=True))


def _thumbnail(picture: Photo) -> Photo:
    """Return a picture with 8 bits in sRGB, as large as a thumbnail may be, and no larger than it is."""
    samples = picture.samples
    height, width = samples.shape[:2]
    scale = min(_THUMBNAIL / max(height, width), 1)
    size = max(round(width * scale), 1), max(round(height * scale), 1)
    small = np.asarray(cv2.resize(samples, size, interpolation=cv2.INTER_AREA))
    return Photo.from_samples(to_depth(small, np.uint8), picture.profile).to_profile(None)
