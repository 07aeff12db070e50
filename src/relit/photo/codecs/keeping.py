"""What a format can hold of a photo's metadata, moved to where it has a place; and the names of the rest."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

from PIL.ExifTags import Base

from relit.photo.codecs.metadata import listed, with_texts
from relit.photo.photo import Metadata, Text

if TYPE_CHECKING:
    from collections.abc import Sequence

#: The fields of `Metadata` that JPEG, PNG, TIFF and PSD have a place for.
OF_PHOTOSHOP = ("exif", "xmp", "dpi", "iptc", "photoshop")
#: The fields of `Metadata` in words.
_NAMES = {
    "exif": "EXIF",
    "xmp": "XMP",
    "dpi": "the resolution",
    "iptc": "IPTC",
    "photoshop": "Photoshop's resources",
    "geo": "GeoTIFF",
}
_UNNAMED = ("left_out", "names_srgb")  # what is said already, and what all formats mean without a word
#: Keywords of PNG (11.3.3.2 of its specification) and the tags of EXIF and TIFF that mean the same. A comment
#: is a description there, as ImageMagick has it.
_TAGS = {
    "Description": Base.ImageDescription,
    "Author": Base.Artist,
    "Copyright": Base.Copyright,
    "Software": Base.Software,
    "Comment": Base.ImageDescription,
}
_COMMENT = "Comment"
#: Bytes of EXIF, of XMP, and of a comment that fit into a segment of a JPEG beside what tells their kind.
_SEGMENTS = {"exif": 65533 - 6, "xmp": 65533 - 29}
_LONGEST_COMMENT = 65533


def fitted(
    metadata: Metadata, holds: Sequence[str], *, segments: bool = False
) -> tuple[Metadata, tuple[str, ...]]:
    """Return what a format keeps of metadata, and in words what it cannot hold.

    Parameters
    ----------
    metadata : Metadata
    holds : sequence of str
        The fields of `Metadata` that the format has a place for.
    segments : bool, optional
        Whether EXIF, XMP and comments must fit a JPEG's segments.
    """
    lost, gone = [*metadata.left_out], [name for name in _UNNAMED if name not in holds]
    for name, most in _SEGMENTS.items() if segments else ():
        if len(getattr(metadata, name) or b"") > most:
            lost.append(f"{_NAMES[name]} of more than {most} bytes")
            gone.append(name)
    metadata, words = _with_words(_without(metadata, gone), holds, _SEGMENTS["exif"] if segments else None)
    gone = [name for name in _NAMES if getattr(metadata, name) and name not in holds]
    lost += [*words, *(_NAMES[name] for name in gone)]
    return _without(metadata, gone), tuple(dict.fromkeys(lost))


def _without(metadata: Metadata, names: Sequence[str]) -> Metadata:
    """Return metadata with some fields empty."""
    empty: dict[str, Any] = {name: getattr(Metadata(), name) for name in names}
    return replace(metadata, **empty)


def _with_words(metadata: Metadata, holds: Sequence[str], most: int | None) -> tuple[Metadata, list[str]]:
    """Move comments and texts to where a format has them; also return what has no place."""
    comments = tuple(Text(_COMMENT, _decoded(comment)) for comment in metadata.comments)
    if "text" in holds:
        return replace(metadata, text=metadata.text + comments, comments=()), []
    if "comments" not in holds:
        exif, lost = _told_by_exif(metadata.exif, metadata.text + comments, holds, most)
        return replace(metadata, exif=exif, text=(), comments=()), lost
    texts = tuple(text for text in metadata.text if text.keyword != _COMMENT)
    exif, lost = _told_by_exif(metadata.exif, texts, holds, most)
    told = tuple(_encoded(text) for text in metadata.text if text.keyword == _COMMENT)
    kept = tuple(comment for comment in metadata.comments + told if len(comment) <= _LONGEST_COMMENT)
    if len(kept) < len(metadata.comments + told):
        lost.append(f"a comment of more than {_LONGEST_COMMENT} bytes")
    return replace(metadata, exif=exif, text=(), comments=kept), lost


def _told_by_exif(
    exif: bytes | None, texts: Sequence[Text], holds: Sequence[str], most: int | None
) -> tuple[bytes | None, list[str]]:
    """Return EXIF with texts that it has a tag for, and in words those that it does not tell."""
    told: set[int] = set()
    wanted: dict[int, bytes] = {}
    for text in sorted(texts, key=lambda text: text.keyword == _COMMENT):  # a description before a comment
        if "exif" in holds and text.keyword in _TAGS:
            wanted.setdefault(_TAGS[text.keyword], _encoded(text))
    if wanted:
        exif, told = with_texts(exif, wanted, most)
    known = {(tag, wanted[tag]) for tag in told}
    rest = [text.keyword for text in texts if (_TAGS.get(text.keyword, 0), _encoded(text)) not in known]
    return exif, [*listed("text", rest)]


def _encoded(text: Text) -> bytes:
    """Return a text as UTF-8, which EXIF and comments are commonly read as."""
    return text.text.encode("utf-8", "replace")


def _decoded(comment: bytes) -> str:
    """Return a JPEG's comment as text: UTF-8 where it can be, else Latin-1."""
    try:
        text = comment.decode()
    except UnicodeDecodeError:
        text = comment.decode("latin-1")
    return text.replace("\0", "")
