"""What an EXIF block and a TIFF's directory share, moved from one to the other; and the names of the rest."""

from __future__ import annotations

import struct
from contextlib import suppress
from typing import TYPE_CHECKING, Any, BinaryIO

from PIL import Image
from PIL.ExifTags import IFD, TAGS, Base
from PIL.TiffImagePlugin import ImageFileDirectory_v2

from relit.photo.codecs.metadata import UNREADABLE, listed, tags_of
from relit.photo.codecs.pillow import quiet_pillow

if TYPE_CHECKING:
    from collections.abc import Iterable

#: Bytes that a TIFF begins with: little-endian, the directory at 8.
HEADER = b"II*\0\x08\0\0\0"
#: The last are Windows' own, and further directories.
_SHARED = {
    *(Base.ImageDescription, Base.Make, Base.Model, Base.Software, Base.DateTime, Base.Artist),
    *(Base.HostComputer, Base.Rating, Base.RatingPercent, Base.Copyright, Base.DocumentName, Base.PageName),
    *(Base.XPTitle, Base.XPComment, Base.XPAuthor, Base.XPKeywords, Base.XPSubject),
    *(IFD.Exif, IFD.GPSInfo),
}
#: What tells how pixels lie in a file, what their colours are, and which pictures go with them, which is all
#: told anew; the resolution, XMP, IPTC, Photoshop's resources and layers, and the profile, which are kept or
#: named for themselves; and what fills up a directory.
_ELSEWHERE = {
    *(*range(254, 269), 273, 274, *range(277, 285), *range(288, 302), *range(317, 348), *range(512, 533)),
    *(700, 33723, 34377, 34675, 37724, 59932),
}


def exif_of(stream: BinaryIO, tags: Iterable[int], orientation: int) -> tuple[bytes | None, tuple[str, ...]]:
    """Gather in an EXIF block what a TIFF has of these tags in its directory; and in words what is lost."""
    source = Image.Exif()
    with quiet_pillow(), suppress(Exception):
        stream.seek(0)
        source.load_from_fp(stream)
    found, lost = _moved(source, tags, "TIFF tags")
    if not found and orientation == 1:
        return None, lost
    exif = Image.Exif()
    exif.update({**found, Base.Orientation: orientation})
    return exif.tobytes(), lost


def directory_of(block: bytes | None) -> tuple[ImageFileDirectory_v2, tuple[str, ...]]:
    """Start a directory with what it shares with an EXIF block; and return in words what is lost."""
    directory, source = ImageFileDirectory_v2(HEADER), Image.Exif()
    if not block:
        return directory, ()
    try:
        tags = tags_of(block)
    except struct.error:
        return directory, (UNREADABLE,)
    with quiet_pillow(), suppress(Exception):
        source.load(block)
    found, lost = _moved(source, tags, "EXIF tags")
    for tag, value in found.items():
        directory[tag] = value
    return directory, lost


def _moved(source: Image.Exif, tags: Iterable[int], what: str) -> tuple[dict[int, Any], tuple[str, ...]]:
    """Return the values of those tags that are shared and can be written, and in words the others."""
    found: dict[int, Any] = {}
    with quiet_pillow():
        for tag in _SHARED.intersection(tags):
            # That a value is odd is found out here or there, and then Pillow raises all kinds of things.
            with suppress(Exception):
                value, trial = _value(source, tag), ImageFileDirectory_v2(HEADER)
                trial[tag] = value
                trial.tobytes()
                if value != {}:  # a directory that cannot be read
                    found[tag] = value
    return found, listed(what, (TAGS.get(tag, str(tag)) for tag in tags if tag not in {*found, *_ELSEWHERE}))


def _value(source: Image.Exif, tag: int) -> Any:
    """Return the value of a tag: of a directory, all that is in it."""
    if tag not in (IFD.Exif, IFD.GPSInfo):
        value = source[tag]
        # Pillow reads text as Latin-1, and writes it as ASCII with question marks; bytes it leaves alone.
        return value.encode("latin-1") if isinstance(value, str) else value
    values = source.get_ifd(tag)
    return {**values, IFD.Interop: source.get_ifd(IFD.Interop)} if IFD.Interop in values else values
