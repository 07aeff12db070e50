"""HEIF and camera raw files made after what once broke libheif and LibRaw: our own bytes."""

from __future__ import annotations

import struct
from typing import TYPE_CHECKING

from cve_tiffs import BYTE, DATA, LONG, RATIONAL, SHORT, tiff

if TYPE_CHECKING:
    from collections.abc import Iterator

    Files = Iterator[tuple[str, bytes]]


def box(kind: bytes, *contents: bytes) -> bytes:
    """Return a box of ISO BMFF."""
    content = b"".join(contents)
    return struct.pack(">I4s", len(content) + 8, kind) + content


def full(kind: bytes, *contents: bytes, version: int = 0) -> bytes:
    """Return a box with a version."""
    return box(kind, struct.pack(">I", version << 24), *contents)


_TYPE = box(b"ftyp", b"heic", bytes(4), b"mif1heic")


def heif(
    *more: bytes,
    items: int = 1,
    kind: bytes = b"hvc1",
    primary: int = 1,
    size: tuple[int, int] = (64, 64),
    data: bytes = bytes(64),
) -> bytes:
    """Return a HEIF of items that have their data in one place, with boxes added."""
    infos = [full(b"infe", struct.pack(">HH", n, 0), kind, b"\0", version=2) for n in range(1, items + 1)]
    where = [struct.pack(">HHHII", n, 0, 1, 0, len(data)) for n in range(1, items + 1)]
    owned = [struct.pack(">HBB", n, 1, 0x81) for n in range(1, items + 1)]
    meta = full(
        b"meta",
        full(b"hdlr", bytes(4), b"pict", bytes(13)),
        full(b"pitm", struct.pack(">H", primary)),
        full(b"iloc", b"\x44\0", struct.pack(">H", items), *where),
        full(b"iinf", struct.pack(">H", items), *infos),
        box(
            b"iprp",
            box(b"ipco", full(b"ispe", struct.pack(">II", *size))),
            full(b"ipma", struct.pack(">I", items), *owned),
        ),
        *more,
    )
    return _TYPE + meta + box(b"mdat", data)


def heifs() -> Files:
    """Items that refer to one another, or claim much.

    As in CVE-2019-11471, CVE-2020-23109, CVE-2023-0996, CVE-2024-41311.
    """

    def refer(kind: bytes, of: int, *to: int) -> bytes:
        return full(b"iref", box(kind, struct.pack(">HH", of, len(to)), *(struct.pack(">H", n) for n in to)))

    grid = struct.pack(">BBBBHH", 0, 0, 1, 1, 64, 64)
    yield "item-of-nothing.heic", heif()
    yield "item-of-no-kind.heic", heif(kind=b"xxxx")
    yield "primary-is-none.heic", heif(primary=77)
    yield "size-of-zero.heic", heif(size=(0, 0))
    yield "size-of-4-billion.heic", heif(size=(2**32 - 1, 2**32 - 1))
    yield "items-many.heic", heif(items=20_000)
    yield "derived-from-itself.heic", heif(refer(b"dimg", 1, 1), kind=b"iden")
    yield "derived-in-a-circle.heic", heif(refer(b"dimg", 1, 2) + refer(b"dimg", 2, 1), items=2, kind=b"iden")
    yield "grid-of-itself.heic", heif(refer(b"dimg", 1, 1, 1, 1, 1), kind=b"grid", data=grid)
    yield (
        "grids-in-grids.heic",
        heif(
            *[full(b"iref", *[box(b"dimg", struct.pack(">HH4H", n, 4, *[n + 1] * 4)) for n in range(1, 40)])],
            items=40,
            kind=b"grid",
            data=grid,
        ),
    )
    yield (
        "grid-of-256x256.heic",
        heif(refer(b"dimg", 1, 2), items=2, kind=b"grid", data=b"\0\1\xff\xff" + b"\xff" * 8),
    )
    yield "grid-of-nothing.heic", heif(kind=b"grid", data=b"")
    yield (
        "overlay-far.heic",
        heif(
            refer(b"dimg", 1, 2), items=2, kind=b"iovl", data=b"\0\1" + b"\xff" * 16 + b"\x7f\xff\xff\xff" * 2
        ),
    )
    yield "alpha-of-itself.heic", heif(refer(b"auxl", 1, 1), full(b"auxC", b"urn:mpeg:hevc:2015:auxid:1\0"))
    yield "thumbnail-of-itself.heic", heif(refer(b"thmb", 1, 1))
    yield "metadata-of-itself.heic", heif(refer(b"cdsc", 1, 1), kind=b"Exif")
    yield "references-beyond.heic", heif(full(b"iref", struct.pack(">I4sHH", 14, b"dimg", 1, 65535)))
    whole = heif()
    at = whole.index(b"iloc") + 8
    for name, patch in {
        "sizes-of-15": b"\xff\xff",
        "sizes-of-0": b"\0\0",
        "count-65535": b"\x44\0\xff\xff",
    }.items():
        yield f"places-{name}.heic", whole[:at] + patch + whole[at + len(patch) :]
    yield (
        "places-far.heic",
        whole.replace(
            struct.pack(">HHHII", 1, 0, 1, 0, 64), struct.pack(">HHHII", 1, 0, 1, 2**32 - 1, 2**32 - 1)
        ),
    )
    at = whole.index(b"ipma") + 4
    yield "properties-count-4-billion.heic", whole[: at + 4] + b"\xff" * 4 + whole[at + 8 :]
    yield (
        "properties-index-127.heic",
        whole.replace(struct.pack(">HBB", 1, 1, 0x81), struct.pack(">HBB", 1, 1, 0xFF)),
    )
    for kind in (b"meta", b"iinf", b"iprp", b"ipco", b"mdat"):
        at = whole.index(kind) - 4
        for length in (0, 1, 7, 2**32 - 1):
            yield (
                f"box-{kind.decode()}-of-{length}.heic",
                whole[:at] + struct.pack(">I", length) + whole[at + 4 :],
            )
    nested = b""
    for _ in range(3000):
        nested = box(b"ipco", nested)
    yield (
        "boxes-in-boxes.heic",
        _TYPE + full(b"meta", full(b"hdlr", bytes(4), b"pict", bytes(13)), box(b"iprp", nested)),
    )
    yield (
        "profile-of-4-gigabytes.heic",
        heif(box(b"iprp", box(b"ipco", struct.pack(">I4s4s", 2**32 - 1, b"colr", b"prof")))),
    )


def raws() -> Files:
    """Camera raw of wild tables.

    As in CVE-2017-13735, CVE-2018-5805, CVE-2020-15503, CVE-2020-35530, CVE-2021-32142.
    """
    raw = {
        256: (LONG, [64]),
        257: (LONG, [64]),
        278: (LONG, [64]),
        254: (LONG, [0]),
        258: (SHORT, [16]),
        262: (SHORT, [32803]),
        271: (2, b"Maker\0"),
        272: (2, b"Model\0"),
        33421: (SHORT, [2, 2]),
        33422: (BYTE, [0, 1, 1, 2]),
        50706: (BYTE, [1, 4, 0, 0]),
        50708: (2, b"Maker Model\0"),
        279: (LONG, [8192]),
    }
    data = bytes(range(256)) * 32
    yield "plain.dng", tiff(raw, data)
    changes = {
        "linearization-of-nothing": {50712: (SHORT, [])},
        "linearization-long": {50712: (SHORT, [65535] * 9000)},
        "black-repeats-0": {50713: (SHORT, [0, 0]), 50714: (LONG, [0])},
        "black-repeats-65535": {50713: (SHORT, [65535, 65535]), 50714: (LONG, [1] * 99)},
        "white-of-0": {50717: (LONG, [0])},
        "active-area-backwards": {50829: (LONG, [8, 8, 0, 0])},
        "active-area-far": {50829: (LONG, [0, 0, 2**32 - 1, 2**32 - 1])},
        "crop-by-zero": {50719: (RATIONAL, [1, 0, 1, 0]), 50720: (RATIONAL, [0, 0, 0, 0])},
        "mosaic-of-255": {33421: (SHORT, [255, 255]), 33422: (BYTE, [9] * 300)},
        "mosaic-of-nothing": {33421: (SHORT, [0, 0]), 33422: (BYTE, [])},
        "matrix-by-zero": {50721: (10, [1, 0] * 9)},
        "neutral-of-zero": {50728: (RATIONAL, [0, 1] * 3)},
        "samples-255": {277: (SHORT, [255])},
        "claims-65535": {256: (LONG, [65535]), 257: (LONG, [65535])},
        "lossless-jpeg-of-nothing": {259: (SHORT, [7])},
        "sub-directory-is-itself": {330: (LONG, [8] * 9)},
        "maker-note-is-itself": {34665: (LONG, [8]), 37500: (7, [0] * 99)},
        "strip-far": {273: (LONG, [2**32 - 1])},
        "bits-of-1": {258: (SHORT, [1])},
        "opcodes-of-4-billion": {51008: (7, b"\xff" * 90), 51009: (7, b"\0\0\0\1" + b"\xff" * 60)},
    }
    for name, change in changes.items():
        yield f"{name}.dng", tiff({**raw, **change}, data)  # type: ignore[dict-item]
    lossless = (
        b"\xff\xd8\xff\xc3\0\x0b\x10"
        + struct.pack(">HH", 65535, 65535)
        + b"\1\1\x11\0\xff\xc4\0\x14\0"
        + bytes(16)
        + b"\xff" * 40
    )
    yield "lossless-jpeg-claims.dng", tiff({**raw, 259: (SHORT, [7]), 273: (LONG, [DATA])}, lossless)
    heads = {
        "cr2": b"II*\0\x10\0\0\0CR\2\0" + bytes(200),
        "orf": b"IIRO\x08\0\0\0" + b"\xff" * 200,
        "rw2": b"IIU\0\x18\0\0\0" + b"\xff" * 200,
        "raf": b"FUJIFILMCCD-RAW 0201" + b"\xff" * 200,
        "crw": b"II\x1a\0\0\0HEAPCCDR" + b"\xff" * 200,
        "cr3": box(b"ftyp", b"crx \0\0\0\1crx ") + box(b"moov", b"\xff" * 200),
    }
    for name, head in heads.items():
        yield f"head-only-{name}.dng", head
        yield f"zeros-behind-{name}.dng", head + bytes(100_000)


PARTS = (heifs, raws)
