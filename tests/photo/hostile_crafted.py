"""Files made to harm: decompression bombs, wild claims, circles, and what once went wrong here."""

from __future__ import annotations

from typing import TYPE_CHECKING

from crafted_cves import cves
from crafted_landmarks import landmarks
from crafted_metadata import metadata
from crafted_photos import bmps, jpegs, others, pngs, pnms, webps
from crafted_texts import texts
from crafted_tiffs import tiffs
from hostile_corpus import Case

if TYPE_CHECKING:
    from collections.abc import Iterator


def crafted(*kinds: str) -> Iterator[Case]:
    """Yield every crafted file, or those of some kinds; the large ones are made one at a time."""
    parts = {
        "png": pngs,
        "jpeg": jpegs,
        "tiff": tiffs,
        "webp": webps,
        "pnm": pnms,
        "bmp": bmps,
        "other": others,
        "metadata": metadata,
        "texts": texts,
        "landmarks": landmarks,
        "cves": cves,
    }
    for kind in kinds or parts:
        for name, data in parts[kind]():
            yield Case(name, f".{name.rpartition('.')[2]}", data)
