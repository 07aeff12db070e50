"""Camera raw: developed by LibRaw, through rawpy."""

from __future__ import annotations

from typing import TYPE_CHECKING, BinaryIO

from relit.errors import ImageError
from relit.photo.codecs.extras import extra
from relit.photo.codecs.metadata import put_upright
from relit.photo.codecs.raster import Raster
from relit.photo.codecs.tiff import read_metadata

if TYPE_CHECKING:
    from relit.photo.codecs.raster import CheckSize


def decode_raw(stream: BinaryIO, check_size: CheckSize) -> Raster:
    """Develop a camera raw file to 16-bit sRGB, upright, as the camera balanced and exposed it."""
    rawpy = extra("rawpy", "raw", "camera raw files")
    try:
        opened = rawpy.imread(stream)
    except rawpy.LibRawFileUnsupportedError as error:
        raise ImageError(
            "starts with a preview, as camera raw files do, but is none that LibRaw knows; "
            "save the photo alone"
        ) from error
    with opened as raw:
        check_size(raw.sizes.width, raw.sizes.height, 6)
        samples = raw.postprocess(
            output_bps=16,
            output_color=rawpy.ColorSpace.sRGB,
            gamma=(2.4, 12.92),
            use_camera_wb=True,
            no_auto_bright=True,  # it would burn out the brightest 1 % of every photo
        )
    # LibRaw has turned the pixels already, as EXIF tells.
    _orientation, metadata = put_upright(read_metadata(stream))
    return Raster(samples, None, metadata)
