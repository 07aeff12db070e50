"""OpenEXR files made after what once broke OpenEXR: our own bytes, of the same class."""

from __future__ import annotations

import struct
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    Files = Iterator[tuple[str, bytes]]


def attribute(name: str, kind: str, value: bytes) -> bytes:
    """Return an attribute of an OpenEXR header."""
    return name.encode() + b"\0" + kind.encode() + b"\0" + struct.pack("<I", len(value)) + value


def channels(*names: str, kind: int = 2, step: tuple[int, int] = (1, 1)) -> bytes:
    """Return a list of channels, of floats unless told."""
    return b"".join(n.encode() + b"\0" + struct.pack("<iB3xii", kind, 0, *step) for n in names) + b"\0"


def exr(
    changed: Mapping[str, tuple[str, bytes] | None], *, flags: int = 2, body: bytes | None = None
) -> bytes:
    """Return an OpenEXR of 4x4 in RGB, with some attributes changed, added, or left out by None."""
    window = struct.pack("<iiii", 0, 0, 3, 3)
    plain: dict[str, tuple[str, bytes] | None] = {
        "channels": ("chlist", channels("B", "G", "R")),
        "compression": ("compression", b"\0"),
        "dataWindow": ("box2i", window),
        "displayWindow": ("box2i", window),
        "lineOrder": ("lineOrder", b"\0"),
        "pixelAspectRatio": ("float", struct.pack("<f", 1)),
        "screenWindowCenter": ("v2f", bytes(8)),
        "screenWindowWidth": ("float", struct.pack("<f", 1)),
    }
    given = plain | dict(changed)
    head = b"v/1\x01" + struct.pack("<I", flags)
    head += b"".join(attribute(name, *field) for name, field in given.items() if field) + b"\0"
    if body is None:
        lines = b"".join(struct.pack("<ii", y, 48) + bytes(48) for y in range(4))
        body = b"".join(struct.pack("<Q", len(head) + 32 + 56 * y) for y in range(4)) + lines
    return head + body


def exrs() -> Files:
    """Windows, channels, tiles and parts that lie.

    As in CVE-2017-9110, CVE-2020-11758, -11760, -16588, CVE-2021-3474.
    """
    yield "plain.exr", exr({})
    for name, box in {
        "backwards": (3, 3, 0, 0),
        "negative": (-(2**31), -(2**31), 2**31 - 1, 2**31 - 1),
        "huge": (0, 0, 2**30, 2**30),
        "row": (0, 0, 2**31 - 2, 0),
        "far": (2**31 - 4, 2**31 - 4, 2**31 - 1, 2**31 - 1),
        "below-zero": (-2, -2, 1, 1),
    }.items():
        for which in ("dataWindow", "displayWindow"):
            yield f"{which.lower()}-{name}.exr", exr({which: ("box2i", struct.pack("<iiii", *box))})
    for name, value in {
        "none": b"\0",
        "unended": channels("R")[:-1],
        "many": channels(*(f"c{i}" for i in range(3000))),
        "twice": channels("R", "R", "R"),
        "kind-of-9": channels("B", "G", "R", kind=9),
        "step-of-0": channels("B", "G", "R", step=(0, 0)),
        "step-of-minus-1": channels("B", "G", "R", step=(-1, -1)),
        "step-huge": channels("B", "G", "R", step=(2**31 - 1, 1)),
        "whole-numbers": channels("B", "G", "R", kind=0),
        "long-name": channels("R" * 300),
    }.items():
        yield f"channels-{name}.exr", exr({"channels": ("chlist", value)})
    for kind in range(1, 12):
        yield f"compression-{kind}.exr", exr({"compression": ("compression", bytes([kind]))})
    for size in ((0, 0), (2**32 - 1, 2**32 - 1), (1, 2**31)):
        for mode in (0, 2, 0xFF):
            tiles = ("tiledesc", struct.pack("<IIB", *size, mode))
            yield f"tiles-{size[0]}x{size[1]}-{mode}.exr", exr({"tiles": tiles}, flags=0x202, body=bytes(99))
    deep = {
        "type": ("string", b"deepscanline"),
        "version": ("int", struct.pack("<i", 1)),
        "maxSamplesPerPixel": ("int", b"\xff\xff\xff\x7f"),
    }
    yield "deep-counts.exr", exr(deep, flags=0x802, body=struct.pack("<Q", 600) * 4 + b"\xff" * 400)
    yield "deep-of-one-part-flag.exr", exr({}, flags=0x802)
    yield "parts-without-end.exr", exr({}, flags=0x1002)
    yield (
        "parts-that-name-none.exr",
        exr({"chunkCount": ("int", b"\xff\xff\xff\x7f"), "type": ("string", b"x" * 99)}, flags=0x1002),
    )
    yield "offsets-far.exr", exr({}, body=b"\xff" * 32 + bytes(200))
    yield "offsets-zero.exr", exr({}, body=bytes(232))
    yield "offsets-same.exr", exr({}, body=struct.pack("<Q", 400) * 4 + bytes(400))
    for name in ("channels", "compression", "dataWindow", "lineOrder"):
        yield f"no-{name.lower()}.exr", exr({name: None})
    yield "chromaticities-of-zero.exr", exr({"chromaticities": ("chromaticities", bytes(32))})
    yield "chromaticities-of-nan.exr", exr({"chromaticities": ("chromaticities", b"\xff" * 32)})
    yield "preview-claims.exr", exr({"preview": ("preview", struct.pack("<II", 2**31, 2**31))})
    yield "text-vector-short.exr", exr({"v": ("stringvector", b"\xff\xff\xff\x7f")})
    yield (
        "attribute-of-2-gigabytes.exr",
        b"v/1\x01\2\0\0\0" + attribute("a", "string", b"")[:-4] + b"\xff\xff\xff\x7f",
    )
    yield "attribute-of-minus-1.exr", b"v/1\x01\2\0\0\0" + attribute("a", "string", b"")[:-4] + b"\xff" * 4
    yield "version-9.exr", exr({}, flags=9)


PARTS = (exrs,)
