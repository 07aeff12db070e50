"""TIFF files whose pixels are made after what once broke libtiff: packed, predicted, subsampled."""

from __future__ import annotations

import struct
import zlib
from typing import TYPE_CHECKING

from cve_tiffs import DATA, LONG, RATIONAL, SHORT, tiff, tiles

if TYPE_CHECKING:
    from cve_tiffs import Field, Files


def packed() -> Files:
    """Packed pixels that overrun.

    As in PackBits, LZW (CVE-2009-2285, CVE-2018-8905), fax (CVE-2011-0192), and so on.
    """

    def of(kind: int, data: bytes, **more: Field) -> bytes:
        own = {int(tag[1:]): field for tag, field in more.items()}
        return tiff({259: (SHORT, [kind]), 279: (LONG, [len(data)])} | own, data)

    one, three = (SHORT, [1]), (SHORT, [3])
    yield "packbits-overrun.tif", of(32773, b"\x81\x07" * 400)
    yield "packbits-cut-in-a-run.tif", of(32773, b"\x7f")
    yield "packbits-no-operation.tif", of(32773, b"\x80" * 4000)
    yield "lzw-code-before-the-table.tif", of(5, b"\x80\x7f\xff\xff\xff" * 9)
    yield "lzw-no-clear.tif", of(5, b"\x01\x02\x03\x04" * 9)
    yield "lzw-clear-without-end.tif", of(5, b"\x80\x40\x20\x10\x08\x04\x02\x01" * 500)
    yield "lzw-old-bit-order.tif", of(5, b"\0\x01" + b"\xff" * 90)
    yield "deflate-overrun.tif", of(8, zlib.compress(bytes(4_000_000)))
    yield "deflate-of-nothing.tif", of(8, zlib.compress(b""))
    yield "deflate-without-header.tif", of(32946, zlib.compress(bytes(64))[2:])
    for kind, name in ((2, "runs"), (3, "group-3"), (4, "group-4")):
        yield f"fax-{name}-overrun.tif", of(kind, b"\x00\x40" * 900, t258=one, t256=(LONG, [17]))
        yield f"fax-{name}-of-ones.tif", of(kind, b"\xff" * 900, t258=one, t292=(LONG, [2**32 - 1]))
    yield "thunderscan-of-8-bits.tif", of(32809, b"\xc1\x3f" * 90)
    yield "thunderscan-overrun.tif", of(32809, b"\x3f" * 900, t258=(SHORT, [4]))
    yield "next-overrun.tif", of(32766, b"\0" + b"\x40\0\xff\xff\xff" * 90, t258=(SHORT, [2]))
    yield "pixarlog-overrun.tif", of(32909, zlib.compress(bytes(100_000)), t277=three)
    yield "jbig-of-zeros.tif", of(34661, bytes(90), t258=one)
    yield "lzma-of-nonsense.tif", of(34925, b"\xfd7zXZ\0" + bytes(90))
    yield "zstd-claims-much.tif", of(50000, b"\x28\xb5\x2f\xfd\xe0" + b"\xff" * 8 + bytes(40))
    yield (
        "lerc-claims-much.tif",
        of(34887, b"Lerc2 " + struct.pack("<iIiii", 4, 0, 2**31 - 1, 2**31 - 1, 1) + bytes(90)),
    )
    yield (
        "jpeg-2000-claims-much.tif",
        of(34712, b"\xff\x4f\xff\x51\0\x2f\0\0" + b"\x7f\xff\xff\xff" * 8 + b"\0\1\7\1\1"),
    )
    for kind in (34676, 34677):
        for sample in (32844, 32845):
            yield (
                f"logluv-{kind}-{sample}.tif",
                of(kind, b"\x81\xff" * 90, t262=(SHORT, [sample]), t258=(SHORT, [16])),
            )
    yield "logluv-of-one-sample.tif", of(34676, b"\xff" * 90, t262=(SHORT, [32845]), t258=(SHORT, [32]))


def predicted() -> Files:
    """Predictors where they cannot be: CVE-2016-9535, CVE-2016-9533, CVE-2017-5563."""
    for predictor, bits, form in (
        (2, 1, 1),
        (2, 7, 1),
        (2, 24, 1),
        (2, 64, 1),
        (3, 8, 1),
        (3, 16, 1),
        (3, 32, 1),
        (3, 64, 3),
        (9, 8, 1),
    ):
        data = zlib.compress(bytes(8 * bits))
        yield (
            f"predictor-{predictor}-of-{bits}-bits-form-{form}.tif",
            tiff(
                {
                    258: (SHORT, [bits]),
                    259: (SHORT, [8]),
                    279: (LONG, [len(data)]),
                    317: (SHORT, [predictor]),
                    339: (SHORT, [form]),
                },
                data,
            ),
        )
    yield "predictor-without-packing.tif", tiff({317: (SHORT, [2])})
    yield (
        "predictor-of-odd-tiles.tif",
        tiff(tiles(17, 3, t259=(SHORT, [5]), t317=(SHORT, [2]), t258=(SHORT, [16])), b"\x80\0" * 40),
    )


def colours() -> Files:
    """Subsampling and JPEG tables that make no sense.

    As in CVE-2013-1960, CVE-2014-8128, CVE-2016-5323, CVE-2020-5310.
    """
    for across, down in ((0, 0), (3, 3), (1, 4), (4, 1), (16, 16), (65535, 1)):
        fields = {262: (SHORT, [6]), 277: (SHORT, [3]), 258: (SHORT, [8] * 3), 530: (SHORT, [across, down])}
        yield f"subsampling-{across}x{down}.tif", tiff(fields, bytes(192))
        packed_fields = fields | {259: (SHORT, [8]), 279: (LONG, [20])}
        yield f"subsampling-{across}x{down}-packed.tif", tiff(packed_fields, zlib.compress(bytes(192)))
    ycc = {262: (SHORT, [6]), 277: (SHORT, [3]), 258: (SHORT, [8] * 3)}
    yield "coefficients-of-zero.tif", tiff(ycc | {529: (RATIONAL, [1, 3, 0, 1, 0, 0])}, bytes(192))
    yield (
        "white-by-zero.tif",
        tiff(ycc | {532: (RATIONAL, [0, 0] * 6), 318: (RATIONAL, [0, 0, 0, 0])}, bytes(192)),
    )
    jpeg = {259: (SHORT, [7])}
    for name, tables in {
        "empty": b"",
        "start": b"\xff\xd8",
        "wild": b"\xff\xd8\xff\xc4\xff\xff" + b"\xff" * 99,
    }.items():
        yield f"jpeg-tables-{name}.tif", tiff(jpeg | {347: (7, tables)}, b"\xff\xd8\xff\xd9" + bytes(60))
    old = {259: (SHORT, [6]), 512: (SHORT, [1])}
    yield "old-jpeg-interchange-far.tif", tiff(old | {513: (LONG, [2**32 - 1]), 514: (LONG, [2**32 - 1])})
    yield (
        "old-jpeg-tables-far.tif",
        tiff(old | {519: (LONG, [2**31]), 520: (LONG, [2**31]), 521: (LONG, [2**31])}),
    )
    yield "old-jpeg-restarts.tif", tiff(old | {515: (SHORT, [65535]), 513: (LONG, [DATA]), 514: (LONG, [64])})
    yield (
        "lab-of-16-bits.tif",
        tiff({262: (SHORT, [8]), 277: (SHORT, [3]), 258: (SHORT, [16] * 3)}, bytes(384)),
    )
    yield "mask-of-8-bits.tif", tiff({262: (SHORT, [4])})


PARTS = (packed, predicted, colours)
