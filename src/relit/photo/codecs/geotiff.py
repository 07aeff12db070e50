"""GeoTIFF: tags that lay the pixels of a TIFF on the earth. They hold as long as no pixel moves."""

from __future__ import annotations

from contextlib import suppress
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from PIL.TiffImagePlugin import ImageFileDirectory_v2

Geo = tuple[tuple[int, bytes | tuple[float, ...]], ...]
_ASCII, _SHORT, _DOUBLE = 2, 3, 12
#: The tags of OGC 19-008r4, chapter 7, and their types.
_TAGS = {33550: _DOUBLE, 33922: _DOUBLE, 34264: _DOUBLE, 34735: _SHORT, 34736: _DOUBLE, 34737: _ASCII}
_MOST = 65535  # numbers or letters, as many as a key can point at


def read_geo(tags: Any) -> Geo:
    """Return the GeoTIFF among tifffile's tags; none of it where one of them is odd."""
    found: list[tuple[int, bytes | tuple[float, ...]]] = []
    with suppress(Exception):  # tifffile raises all kinds of things on damage, when it looks at a value
        for code, kind in _TAGS.items():
            tag = tags.get(code)
            if tag is None:
                continue
            if int(tag.dtype) != kind or not 0 < tag.count <= _MOST:
                return ()
            value = tag.value
            if kind == _ASCII:
                found.append((code, value.encode("latin-1")))
            else:
                found.append((code, value if isinstance(value, tuple) else (value,)))
        return tuple(found)
    return ()


def add_geo(directory: ImageFileDirectory_v2, geo: Geo) -> None:
    """Add GeoTIFF to a directory."""
    for code, value in geo:
        directory.tagtype[code] = _TAGS[code]
        directory[code] = value
