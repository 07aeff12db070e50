"""WebP, BMP, and what JPEG needs as well: images that Pillow opens and saves."""

from __future__ import annotations

import io
import threading
import warnings
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, BinaryIO

import numpy as np
from PIL import Image

from relit.errors import ImageError
from relit.photo.codecs.metadata import resolution
from relit.photo.photo import Metadata, Photo

if TYPE_CHECKING:
    from collections.abc import Iterator
    from types import ModuleType

    from numpy.typing import NDArray

    from relit.photo.codecs import CheckSize
    from relit.photo.photo import JpegSettings

_MODES = {"1": "L", "L": "L", "P": "RGB", "RGB": "RGB", "RGBA": "RGBA"}
#: Of WebP, and of a JPEG that has no settings of its own.
QUALITY = 95
_PILLOW = threading.Lock()
_ROWS = 256
#: Damage may ask for work without end: 10 million px in run lengths, a byte at a time in Python, take 1 s.
_RUNS, _MOST_IN_RUNS = (1, 2), 10_000_000


@contextmanager
def pillow_setting(module: ModuleType, name: str, value: int | None) -> Iterator[None]:
    """Change a setting of Pillow, which belongs to the whole process: one thread at a time."""
    with _PILLOW:
        before = getattr(module, name)
        setattr(module, name, value)
        try:
            yield
        finally:
            setattr(module, name, before)


@contextmanager
def quiet_pillow() -> Iterator[None]:
    """Keep Pillow from warning of odd metadata, which is left out, and from its own limit on pixels.

    Only for as long as a header is parsed: warning filters, too, belong to the whole process.
    """
    with pillow_setting(Image, "MAX_IMAGE_PIXELS", None), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        yield


def open_image(stream: BinaryIO, check_size: CheckSize, name: str) -> Image.Image:
    """Open a file of a known format, and refuse what is not one grey or RGB image."""
    with quiet_pillow():
        image = Image.open(stream, formats=(name,))
    check_size(*image.size)
    # An MPO is a JPEG with further pictures behind the photo, such as a gain map.
    if image.format != "MPO" and getattr(image, "is_animated", False):
        raise ImageError("animated; save one frame as a photo of its own")
    if image.mode not in _MODES:
        raise ImageError(f"holds {image.mode} colours; convert it to RGB or grey first")
    return image


def photo_from(
    image: Image.Image, samples: NDArray[Any] | None = None, jpeg: JpegSettings | None = None
) -> Photo:
    """Return an image and its metadata as a photo; palettes become RGB, single bits 8."""
    samples, info = _samples(image) if samples is None else samples, image.info
    metadata = Metadata(info.get("exif"), info.get("xmp"), resolution(*info.get("dpi", (0, 0))))
    return Photo.from_samples(samples, info.get("icc_profile"), metadata, jpeg)


def _samples(image: Image.Image) -> NDArray[Any]:
    """Return the pixels as an array, part by part: `np.array(image)` copies the whole several times."""
    if image.mode != (mode := _MODES[image.mode]):
        image = image.convert(mode)
    samples = np.empty((image.height, image.width, len(mode)), np.uint8)
    for top in range(0, image.height, _ROWS):
        part = image.crop((0, top, image.width, min(top + _ROWS, image.height)))
        samples[top : top + _ROWS] = np.asarray(part).reshape(part.height, part.width, -1)
    return samples


def save_image(photo: Photo, name: str, **options: Any) -> bytes:
    """Return a photo of 8 bits as a file of a format that Pillow saves, with its resolution."""
    samples = photo.samples
    buffer = io.BytesIO()
    image = Image.fromarray(samples[..., 0] if samples.shape[2] == 1 else samples)
    image.save(buffer, name, dpi=photo.metadata.dpi or (0, 0), **options)
    return buffer.getvalue()


def decode_webp(stream: BinaryIO, check_size: CheckSize) -> Photo:
    """Read a WebP; its pixels without Pillow, which keeps four copies of the whole."""
    import imagecodecs

    image = open_image(stream, check_size, "WEBP")
    stream.seek(0)
    return photo_from(image, np.asarray(imagecodecs.webp_decode(stream.read())))


def encode_webp(photo: Photo) -> bytes:
    """Write a lossy WebP at quality 95; alpha, and the colours where it is 0, are kept."""
    return save_image(
        photo,
        "WEBP",
        quality=QUALITY,
        exact=True,
        icc_profile=photo.profile,
        exif=photo.metadata.exif or b"",
        xmp=photo.metadata.xmp or b"",
    )


def decode_bmp(stream: BinaryIO, check_size: CheckSize) -> Photo:
    """Read a BMP."""
    image = open_image(stream, check_size, "BMP")
    if image.info["compression"] in _RUNS and image.width * image.height > _MOST_IN_RUNS:
        raise ImageError("holds a large picture in run lengths; save it as PNG")
    return photo_from(image)


def encode_bmp(photo: Photo) -> bytes:
    """Write a BMP, lossless, with no more metadata than the resolution."""
    return save_image(photo, "BMP")
