"""The texts of a PNG, and profiles that ImageMagick and others write as texts.

Read here and not by Pillow, which gives up all of a file for one text that is damaged, and takes no more than
one of a megabyte.
"""

from __future__ import annotations

import struct
import zlib
from contextlib import suppress
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from relit.photo.codecs import photoshop
from relit.photo.codecs.metadata import EXIF_PREFIX
from relit.photo.photo import Text

if TYPE_CHECKING:
    from collections.abc import Iterable

    from relit.photo.photo import Metadata

_LARGEST = 1 << 24  # bytes of XMP; and of all other texts, unpacked
_MOST = 1000  # ten times as many as ImageMagick writes
_LONGEST_KEYWORD = 79
_XMP = "XML:com.adobe.xmp"
_XMP_PREFIX = b"http://ns.adobe.com/xap/1.0/\0"
_RAW = "Raw profile type "
#: Texts that are longer are packed.
_LONG = 1024


@dataclass
class Texts:
    """What the texts of a PNG hold: words, and metadata of other kinds."""

    text: list[Text] = field(default_factory=list)
    xmp: bytes | None = None
    raw: dict[str, bytes] = field(default_factory=dict)  # by its kind: exif, xmp, iptc, 8bim, icc

    @property
    def iptc(self) -> tuple[bytes | None, bytes | None]:
        """IPTC, and Photoshop's other resources."""
        iptc, others = photoshop.split(self.raw.get("8bim", b""))
        found = self.raw.get("iptc", b"")  # either IPTC alone, or in a resource
        alone, _ = photoshop.split(found)
        return iptc or alone or (found if found[:1] == b"\x1c" else None), others


def read_texts(chunks: Iterable[tuple[bytes, memoryview]]) -> Texts:
    """Read chunks of the kinds tEXt, zTXt and iTXt; what is damaged or too much is left out."""
    found, left = Texts(), _LARGEST
    for count, (kind, content) in enumerate(chunks):
        head, gap, rest = bytes(content[: _LONGEST_KEYWORD + 1]).partition(b"\0")
        keyword, body = head.decode("latin-1"), content[len(head) + 1 :]
        is_xmp = keyword == _XMP and kind == b"iTXt"
        if not head or not gap or (is_xmp and found.xmp) or (not is_xmp and (left <= 0 or count >= _MOST)):
            continue
        language = translated = b""
        packed = kind == b"zTXt"
        if packed:
            body = body[1:]
        elif kind == b"iTXt":
            packed = bytes(body[:1]) == b"\1"
            # A language and a keyword are short; what is not is no text.
            language, _, rest = bytes(body[2:2000]).partition(b"\0")
            translated, gap, _ = rest.partition(b"\0")
            if not gap:
                continue
            body = body[4 + len(language) + len(translated) :]
        room = _LARGEST if is_xmp else left
        text, size = _unpacked(body, room) if packed else (bytes(body[:room]), len(body))
        left -= 0 if is_xmp else size
        if text is None or size > room:
            continue
        if is_xmp:
            found.xmp = text
        elif keyword.startswith(_RAW):
            _add_raw(found.raw, keyword.removeprefix(_RAW).lower(), text)
        elif b"\0" not in text:
            encoding = "utf-8" if kind == b"iTXt" else "latin-1"
            words = (text, language, translated)
            told, *others = (word.decode(encoding, "replace") for word in words)
            found.text.append(Text(keyword, told, *others))
    return found


def inflate(data: bytes | memoryview) -> bytes | None:
    """Return the content of a compressed chunk; None where it is damaged, or larger than an honest one."""
    return _unpacked(data, _LARGEST)[0]


def write_texts(metadata: Metadata) -> list[tuple[bytes, bytes]]:
    """Return chunks for the XMP, the IPTC and the texts of a photo."""
    chunks = []
    if metadata.xmp:
        chunks.append((b"iTXt", _XMP.encode() + bytes(5) + metadata.xmp))
    if metadata.photoshop:
        chunks.append(_raw("8bim", photoshop.joined(metadata.iptc, metadata.photoshop)))
    elif metadata.iptc:
        chunks.append(_raw("iptc", metadata.iptc))
    return chunks + [_chunk(text) for text in metadata.text]


def _chunk(text: Text) -> tuple[bytes, bytes]:
    """Return the chunk for a text: in Latin-1 where that has all of it, as most readers expect."""
    keyword = text.keyword.encode("latin-1", "replace")[:_LONGEST_KEYWORD] + b"\0"
    if not text.language and not text.translated:
        with suppress(UnicodeEncodeError):
            words = text.text.encode("latin-1")
            if len(words) > _LONG:
                return b"zTXt", keyword + b"\0" + zlib.compress(words)
            return b"tEXt", keyword + words
    words = text.text.encode("utf-8", "replace")
    packed = len(words) > _LONG
    language = text.language.encode("ascii", "replace") + b"\0" + text.translated.encode() + b"\0"
    return b"iTXt", keyword + bytes([packed, 0]) + language + (zlib.compress(words) if packed else words)


def _raw(kind: str, data: bytes) -> tuple[bytes, bytes]:
    """Return a profile as ImageMagick writes it: there is no chunk of its own for IPTC."""
    digits = data.hex()
    lines = "\n".join(digits[at : at + 72] for at in range(0, len(digits), 72))
    text = f"\n{kind}\n{len(data):8}\n{lines}\n"
    return b"zTXt", f"{_RAW}{kind}".encode() + b"\0\0" + zlib.compress(text.encode())


def _add_raw(raw: dict[str, bytes], kind: str, text: bytes) -> None:
    """Add a profile that is told in hexadecimal, behind its name and its length; not what is cut short."""
    parts = text.lstrip(b"\n").split(b"\n", 2)
    with suppress(ValueError, IndexError):
        length = int(parts[1])
        data = bytes.fromhex(parts[2].decode("ascii"))
        if not 0 < length <= len(data):
            return
        data = data[:length]
        if kind == "app1":
            kind = "exif" if data.startswith(EXIF_PREFIX) else "xmp"
        if kind == "xmp":
            data = data.removeprefix(_XMP_PREFIX)
        raw.setdefault("icc" if kind == "icm" else kind, data)


def _unpacked(data: bytes | memoryview, most: int) -> tuple[bytes | None, int]:
    """Return what is packed, None where that is damaged or more than so much, and how much was unpacked."""
    inflater = zlib.decompressobj()
    try:
        content = inflater.decompress(data, most)
    except zlib.error:
        return None, most // 100  # some work was done, and nobody knows how much
    return content if inflater.eof else None, len(content)


def signed(kind: bytes, content: bytes) -> bytes:
    """Return a chunk with its length and its checksum."""
    return struct.pack(">I", len(content)) + kind + content + struct.pack(">I", zlib.crc32(kind + content))
