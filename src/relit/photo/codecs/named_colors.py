"""Colours that a file names instead of having a profile: by numbers of ITU-T H.273, or as PNG does."""

from __future__ import annotations

import struct
from typing import TYPE_CHECKING

from relit.errors import ImageError
from relit.photo.codecs.png_text import inflate
from relit.photo.profile import SRGB_PRIMARIES, grey_with_gamma, rgb_profile

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

#: Of ITU-T H.273, table 3: curves that start from another white than paper.
_HDR = {16: "PQ", 18: "HLG"}
_D65, _C = (0.3127, 0.3290), (0.310, 0.316)
#: Of ITU-T H.273, table 2: x and y of red, green, blue and white.
_PRIMARIES: dict[int, tuple[float, ...]] = {
    1: SRGB_PRIMARIES,  # BT.709
    4: (0.67, 0.33, 0.21, 0.71, 0.14, 0.08, *_C),  # BT.470 M
    5: (0.64, 0.33, 0.29, 0.60, 0.15, 0.06, *_D65),  # BT.470 BG
    6: (0.630, 0.340, 0.310, 0.595, 0.155, 0.070, *_D65),  # BT.601
    7: (0.630, 0.340, 0.310, 0.595, 0.155, 0.070, *_D65),  # SMPTE 240
    8: (0.681, 0.319, 0.243, 0.692, 0.145, 0.049, *_C),  # film
    9: (0.708, 0.292, 0.170, 0.797, 0.131, 0.046, *_D65),  # BT.2020
    11: (0.680, 0.320, 0.265, 0.690, 0.150, 0.060, 0.314, 0.351),  # DCI-P3
    12: (0.680, 0.320, 0.265, 0.690, 0.150, 0.060, *_D65),  # Display P3
    22: (0.630, 0.340, 0.295, 0.605, 0.155, 0.077, *_D65),  # EBU 3213
}
#: Of ITU-T H.273, table 3: exponents; None is the curve of sRGB. That of BT.709 and its kin (1, 6, 14, 15)
#: is a camera's and not a display's; photos with it are shown by the curve of sRGB, as browsers do.
_GAMMAS = {1: None, 6: None, 14: None, 15: None, 13: None, 4: 2.2, 5: 2.8, 8: 1.0}
#: libpng takes exponents within 5 % for the same (PNG_GAMMA_THRESHOLD). 2.2 stands for sRGB: the PNG
#: specification has encoders of sRGB write gAMA 45455 for readers that know no sRGB chunk (11.3.2.5).
_SAME, _LIKE_SRGB = 0.05, 2.2
_GAMMA_RANGE = (0.1, 10)
_SAME_PRIMARIES = 0.005


def refuse_hdr(transfer: int) -> None:
    """Refuse light that is brighter than paper."""
    if curve := _HDR.get(transfer):
        raise ImageError(f"holds HDR colours ({curve}); export it with standard range (SDR) first")


def png_profile(chunks: Mapping[bytes, bytes], raw: bytes | None, *, grey: bool) -> bytes | None:
    """Return the ICC profile that the chunks of a PNG describe; None for sRGB, and where none does.

    Of several, the first counts, as the PNG specification has it (4.3): cICP, iCCP, sRGB, then gAMA and cHRM.
    What is damaged, or names no colours that are known, counts as missing. `raw` is a profile that was
    written as a text.
    """
    named = chunks.get(b"cICP", b"")
    if len(named) == 4 and named[2] == 0:
        primaries, transfer, _matrix, full = named
        refuse_hdr(transfer)
        if transfer in _GAMMAS and (grey or primaries in _PRIMARIES):
            if not full:
                raise ImageError("holds narrow-range colours, as videos do; export it with full range first")
            return _described(_PRIMARIES.get(primaries, SRGB_PRIMARIES), _GAMMAS[transfer], grey=grey)
    if profile := inflate(chunks.get(b"iCCP", b"").partition(b"\0")[2][1:]) or raw:
        return profile
    if b"sRGB" in chunks:
        return None
    gamma, primaries_ = _gamma(chunks.get(b"gAMA", b"")), _chromaticities(chunks.get(b"cHRM", b""))
    if gamma and abs(gamma / _LIKE_SRGB - 1) < _SAME and (grey or primaries_ == SRGB_PRIMARIES):
        gamma = None
    return _described(primaries_, gamma, grey=grey)


def _described(primaries: Sequence[float], gamma: float | None, *, grey: bool) -> bytes | None:
    """Return a profile of primaries and an exponent; None for sRGB."""
    if grey:
        return None if gamma is None else grey_with_gamma(gamma)
    return rgb_profile(primaries, gamma)


def _gamma(chunk: bytes) -> float | None:
    """Return the exponent that decodes a PNG's values; None where the chunk tells none."""
    stated = int.from_bytes(chunk) / 100_000 if len(chunk) == 4 else 0
    low, high = _GAMMA_RANGE
    return 1 / stated if low <= stated <= high else None


def _chromaticities(chunk: bytes) -> tuple[float, ...]:
    """Return the primaries that a PNG states, white behind; sRGB's where it states none that can be."""
    if len(chunk) != 32:
        return SRGB_PRIMARIES
    white_x, white_y, *others = (count / 100_000 for count in struct.unpack(">8I", chunk))
    stated = (*others, white_x, white_y)
    points = [*zip(stated[::2], stated[1::2], strict=True)]
    (rx, ry), (gx, gy), (bx, by), _ = points
    area = abs((gx - rx) * (by - ry) - (bx - rx) * (gy - ry)) / 2
    if any(y <= 0 or x + y > 1 for x, y in points) or area < 0.01:
        return SRGB_PRIMARIES
    near = all(abs(a - b) < _SAME_PRIMARIES for a, b in zip(stated, SRGB_PRIMARIES, strict=True))
    return SRGB_PRIMARIES if near else stated
