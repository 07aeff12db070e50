"""The texts of a PNG, and profiles that ImageMagick and others write as texts.

Read here and not by Pillow, which gives up all of a file for one text that is damaged, and takes no more than
one of a megabyte.
"""

from __future__ import annotations

import struct
import zlib
from contextlib import suppress
from dataclasses import dataclass, field
from itertools import starmap
from typing import TYPE_CHECKING, NamedTuple

from relit.photo.codecs import photoshop
from relit.photo.codecs.metadata import EXIF_PREFIX
from relit.photo.photo import Text

if TYPE_CHECKING:
    from collections.abc import Iterable

    from relit.photo.photo import Metadata

_LARGEST = 1 << 24  # bytes of XMP; and of all other texts, unpacked
_MOST = 1000  # ten times as many as ImageMagick writes
_LONGEST_KEYWORD, _LONGEST_WORDS = 79, 2000
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
        return iptc or photoshop.iptc_of(found) or photoshop.split(found)[0], others


class _Chunk(NamedTuple):
    """A chunk of text, not yet unpacked."""

    keyword: str
    body: memoryview
    packed: bool
    encoding: str
    language: bytes = b""
    translated: bytes = b""

    def content(self, most: int) -> tuple[bytes | None, int]:
        """Return what it says, None where that is damaged or more than so much, and how much there was."""
        if self.packed:
            return _unpacked(self.body, most)
        size = len(self.body)
        return (bytes(self.body), size) if size <= most else (None, 0)


def read_texts(chunks: Iterable[tuple[bytes, memoryview]]) -> Texts:
    """Read chunks of the kinds tEXt, zTXt and iTXt; what is damaged or too much is left out."""
    found, left, count = Texts(), _LARGEST, 0
    met_xmp = False
    for chunk in filter(None, starmap(_opened, chunks)):
        if chunk.keyword == _XMP and chunk.encoding == "utf-8":
            if not met_xmp:  # the first counts, whatever it holds
                found.xmp, _ = chunk.content(_LARGEST)
                met_xmp = True
            continue
        count += 1
        if count > _MOST or left <= 0:
            continue
        text, size = chunk.content(left)
        left -= size
        if text is None:
            continue
        if chunk.keyword.startswith(_RAW):
            _add_raw(found.raw, chunk.keyword.removeprefix(_RAW).lower(), text)
        elif b"\0" not in text:
            parts = (text, chunk.language, chunk.translated)
            words = [part.decode(chunk.encoding, "replace") for part in parts]
            found.text.append(Text(chunk.keyword, *words))
    return found


def _opened(kind: bytes, content: memoryview) -> _Chunk | None:
    """Return the parts of a chunk of text; None where it is none."""
    head, gap, _ = bytes(content[: _LONGEST_KEYWORD + 1]).partition(b"\0")
    keyword, body = head.decode("latin-1"), content[len(head) + 1 :]
    if not gap or not keyword or not keyword.isprintable():
        return None
    if kind != b"iTXt":
        packed = kind == b"zTXt"
        return _Chunk(keyword, body[packed:], packed, "latin-1")
    # A language and a keyword are short; what is not is no text.
    language, _, rest = bytes(body[2:_LONGEST_WORDS]).partition(b"\0")
    translated, gap, _ = rest.partition(b"\0")
    if not gap:
        return None
    text = body[4 + len(language) + len(translated) :]
    return _Chunk(keyword, text, bytes(body[:1]) == b"\1", "utf-8", language, translated)


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
