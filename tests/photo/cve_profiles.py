"""Photos whose colour profile is made after what once broke lcms, ColorSync and iccDEV: our own bytes."""

from __future__ import annotations

import struct
import zlib
from typing import TYPE_CHECKING

from hostile_corpus import photos, png, png_chunks, profile

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    Files = Iterator[tuple[str, bytes]]


def icc(tags: Sequence[tuple[bytes, bytes]], *, count: int | None = None, space: bytes = b"RGB ") -> bytes:
    """Return a profile of tags, whose count may lie."""
    head = profile()[:128]
    start, table, body = 132 + 12 * len(tags), b"", b""
    for name, content in tags:
        table += struct.pack(">4sII", name, start + len(body), len(content))
        body += content.ljust(-(-len(content) // 4) * 4, b"\0")
    whole = (
        head[:16]
        + space
        + head[20:]
        + struct.pack(">I", len(tags) if count is None else count)
        + table
        + body
    )
    return struct.pack(">I", len(whole)) + whole[4:]


def _in_png(content: bytes) -> bytes:
    first, *rest = [
        chunk for chunk in png_chunks(photos()["rgb.png"]) if chunk[0] in (b"IHDR", b"IDAT", b"IEND")
    ]
    return png(first, (b"iCCP", b"p\0\0" + zlib.compress(content)), *rest)


def tables() -> Files:
    """Tables of tags that overlap, repeat and lie far: CVE-2013-4160, CVE-2016-10165, CVE-2022-26730."""
    good = profile()
    for count in (0, 1, 101, 2**16, 2**31, 2**32 // 12 + 1):
        yield f"profile-tags-{count}.png", _in_png(good[:128] + struct.pack(">I", count) + good[132:])
    entries = range(132, 132 + 12 * struct.unpack_from(">I", good, 128)[0], 12)
    same = bytearray(good)
    for at in entries:
        same[at + 4 : at + 12] = struct.pack(">II", 128, len(good) - 128)
    yield "profile-tags-overlap.png", _in_png(bytes(same))
    for name, offset, size in (
        ("far", 2**32 - 8, 16),
        ("in-the-header", 0, 128),
        ("of-4-gigabytes", 200, 2**32 - 1),
        ("of-nothing", 200, 0),
        ("wraps", 2**32 - 4, 8),
    ):
        changed = bytearray(good)
        for at in entries:
            changed[at + 4 : at + 12] = struct.pack(">II", offset, size)
        yield f"profile-tags-{name}.png", _in_png(bytes(changed))
    yield "profile-tag-twice.png", _in_png(icc([(b"wtpt", b"XYZ " + bytes(16))] * 90))
    for size in (0, 127, 128, 2**32 - 1):
        yield f"profile-claims-{size}.png", _in_png(struct.pack(">I", size) + good[4:])
    for at, name in ((8, "version"), (12, "class"), (20, "connection"), (36, "signature"), (64, "intent")):
        yield f"profile-{name}-wild.png", _in_png(good[:at] + b"\xff" * 4 + good[at + 4 :])


def contents() -> Files:
    """Curves, tables of colours and texts of wild sizes: CVE-2013-4276, CVE-2018-16435, CVE-2023-46866."""
    white = (b"wtpt", b"XYZ \0\0\0\0" + struct.pack(">iii", 63190, 65536, 54061))
    corners = [(name + b"XYZ", b"XYZ \0\0\0\0" + bytes(12)) for name in (b"r", b"g", b"b")]
    curves = {
        "of-nothing": b"curv\0\0\0\0",
        "of-4-billion": b"curv\0\0\0\0\xff\xff\xff\xff",
        "of-0-gamma": b"curv" + struct.pack(">IIH", 0, 1, 0),
        "backwards": b"curv"
        + struct.pack(">II", 0, 256)
        + b"".join(struct.pack(">H", 65535 - 257 * n) for n in range(256)),
        "parametric-of-99": b"para" + struct.pack(">IHH", 0, 99, 0) + bytes(28),
        "parametric-by-zero": b"para" + struct.pack(">IHH", 0, 4, 0) + bytes(28),
        "parametric-cut": b"para" + struct.pack(">IHH", 0, 3, 0) + b"\xff" * 4,
        "of-another-kind": b"text\0\0\0\0" + b"x" * 40,
    }
    for name, curve in curves.items():
        yield (
            f"curve-{name}.png",
            _in_png(icc([white, *corners, *[(c + b"TRC", curve) for c in (b"r", b"g", b"b")]])),
        )
    for kind in (b"mft1", b"mft2", b"mAB "):
        for name, counts in {
            "3-3-255": (3, 3, 255),
            "15-15-9": (15, 15, 9),
            "0-0-0": (0, 0, 0),
            "255-1-2": (255, 1, 2),
        }.items():
            table = kind + bytes(4) + bytes([*counts, 0]) + bytes(36) + b"\xff" * 200
            yield (
                f"table-{kind.decode().strip()}-{name}.png",
                _in_png(icc([white, (b"A2B0", table), (b"B2A0", table)])),
            )
    offsets = struct.pack(">5I", 12, 12, 12, 12, 12)
    yield (
        "table-parts-of-itself.png",
        _in_png(icc([white, (b"A2B0", b"mAB " + bytes(4) + b"\3\3\0\0" + offsets)])),
    )
    for name, text in {
        "length-4-billion": b"desc\0\0\0\0\xff\xff\xff\xff",
        "length-0": b"desc" + bytes(8),
        "of-no-ascii": b"desc\0\0\0\0\0\0\0\x04\xff\xfe\xfd\xfc",
        "names-4-billion": b"mluc\0\0\0\0\xff\xff\xff\xff\0\0\0\x0c",
        "name-far": b"mluc" + struct.pack(">III", 0, 1, 12) + b"enUS" + b"\xff" * 8,
        "record-of-0": b"mluc" + struct.pack(">III", 0, 900, 0),
    }.items():
        yield f"description-{name}.png", _in_png(icc([white, (b"desc", text), (b"cprt", text)]))
    yield "colours-named.png", _in_png(icc([white, (b"ncl2", b"ncl2" + bytes(8) + b"\xff" * 8 + bytes(64))]))
    yield "sequence-of-4-billion.png", _in_png(icc([white, (b"pseq", b"pseq\0\0\0\0\xff\xff\xff\xff")]))
    yield (
        "elements-in-elements.png",
        _in_png(icc([white, (b"D2B0", b"mpet" + struct.pack(">IHHI", 0, 3, 3, 2**31) + b"\0\0\0\0" * 9)])),
    )
    for space in (b"15CL", b"FCLR", b"Lab ", b"YCbr", b"\0\0\0\0"):
        yield f"colours-of-{space.hex()}.png", _in_png(icc([white, *corners], space=space))


PARTS = (tables, contents)
