"""HEIC: read by pillow-heif, at 8 to 12 bits."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, BinaryIO

import numpy as np

from relit.errors import ImageError
from relit.photo.codecs.extras import extra
from relit.photo.codecs.metadata import Metadata, put_upright
from relit.photo.codecs.raster import Raster, divide_by_alpha, rescale
from relit.photo.codecs.srgb import profile_of

if TYPE_CHECKING:
    from relit.photo.codecs.raster import CheckSize

#: Of ITU-T H.273: primaries that are not told; curves that start from another white than paper.
_UNTOLD = 2
_HDR = {16: "PQ", 18: "HLG"}


def decode_heif(stream: BinaryIO, check_size: CheckSize) -> Raster:
    """Read the primary image of a HEIC; 10 and 12 bits become 16."""
    library = extra("pillow_heif", "heic", "HEIC files")
    file = library.open_heif(stream, convert_hdr_to_8bit=False)
    image = file[file.primary_index]
    check_size(*image.size, 6)
    samples = np.asarray(image)
    samples = samples.reshape(*samples.shape[:2], -1)
    if samples.dtype == np.uint16:  # pillow-heif shifts fewer bits to the left
        bits = image.info["bit_depth"]
        samples = rescale(samples >> (16 - bits), 2**bits - 1, np.uint16)
    if image.premultiplied_alpha:
        samples = samples.copy()
        divide_by_alpha(samples)
    told = Metadata(image.info["exif"], image.info.get("xmp"))
    # libheif has turned the pixels already, as the file's own box tells; EXIF only repeats it.
    _orientation, metadata = put_upright(told)
    return Raster(samples, _profile(image.info), metadata)


def _profile(info: dict[str, Any]) -> bytes | None:
    """Return the ICC profile of a HEIC, or one of the primaries that it names instead."""
    if profile := info.get("icc_profile"):
        return bytes(profile)
    named = info.get("nclx_profile", {})
    if curve := _HDR.get(named.get("transfer_characteristics")):
        raise ImageError(f"holds HDR colours ({curve}); export it with standard range (SDR) first")
    if named.get("color_primaries", _UNTOLD) == _UNTOLD:
        return None
    points = ("red", "green", "blue", "white")
    return profile_of([named[f"color_primary_{point}_{axis}"] for point in points for axis in "xy"])
