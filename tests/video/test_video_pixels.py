"""Frames in RGB and back, checked by the matrices of BT.601, BT.709 and BT.2020 written out here."""

import av
import numpy as np
import pytest

from relit.video.pixels import bits_of, put_change, to_rgb

KR_KB = {1: (0.2126, 0.0722), 6: (0.299, 0.114), 9: (0.2627, 0.0593)}


def frame_of(planes, pix_fmt, matrix=1, span=1):
    height, width = planes[0].shape
    frame = av.VideoFrame(width, height, pix_fmt)
    for plane, values in zip(frame.planes, planes, strict=True):
        rows = np.frombuffer(plane, values.dtype).reshape(plane.height, -1)
        rows[:, : values.shape[1]] = values
    frame.colorspace, frame.color_range = matrix, span
    return frame


def planes_of(frame):
    kind = np.uint16 if bits_of(frame) > 8 else np.uint8
    return [
        np.frombuffer(plane, kind).reshape(plane.height, -1)[:, : plane.width].copy()
        for plane in frame.planes
    ]


def rgb_by_hand(y, u, v, matrix, span, bits):
    top = 2**bits - 1
    if span == 1:
        scale = 2 ** (bits - 8)
        y, u, v = (
            (one - zero * scale) / (size * scale)
            for one, zero, size in ((y, 16, 219), (u, 128, 224), (v, 128, 224))
        )
    else:
        y, u, v = y / top, (u - 2 ** (bits - 1)) / top, (v - 2 ** (bits - 1)) / top
    kr, kb = KR_KB[matrix]
    red, blue = y + 2 * (1 - kr) * v, y + 2 * (1 - kb) * u
    green = (y - kr * red - kb * blue) / (1 - kr - kb)
    return np.clip(np.stack([red, green, blue], axis=-1), 0, 1)


@pytest.mark.parametrize("matrix", [1, 6, 9])
@pytest.mark.parametrize("span", [1, 2])
@pytest.mark.parametrize(("pix_fmt", "bits"), [("yuv444p", 8), ("yuv444p10le", 10)])
def test_colours_are_those_of_the_standard(matrix, span, pix_fmt, bits):
    random = np.random.default_rng(matrix)
    kind, scale = (np.uint8, 1) if bits == 8 else (np.uint16, 4)
    y = random.integers(60 * scale, 180 * scale, (32, 48)).astype(kind)
    u, v = (random.integers(110 * scale, 146 * scale, (32, 48)).astype(kind) for _ in range(2))
    got = to_rgb(frame_of([y, u, v], pix_fmt, matrix, span))
    assert got.dtype == (np.uint8 if bits == 8 else np.uint16)
    wanted = rgb_by_hand(y.astype(float), u.astype(float), v.astype(float), matrix, span, bits)
    assert np.abs(got / np.iinfo(got.dtype).max - wanted).max() < (
        1.6 / 255 if bits == 8 else 4 / 1023
    )  # swscale has white of 16 bits at 65280


def some_frame(pix_fmt, seed=0):
    random = np.random.default_rng(seed)
    frame = av.VideoFrame(48, 32, pix_fmt)
    deep = bits_of(frame) > 8
    planes = [
        random.integers(64 if deep else 16, 900 if deep else 230, (one.height, one.width)).astype(
            np.uint16 if deep else np.uint8
        )
        for one in frame.planes
    ]
    return frame_of(planes, pix_fmt)


FORMATS = [
    "yuv420p",
    "yuv422p",
    "yuv444p",
    "yuv420p10le",
    "yuv422p10le",
    "yuva444p10le",
    "gray",
    "yuv420p12le",
]


@pytest.mark.parametrize("pix_fmt", FORMATS)
def test_what_is_not_changed_stays_to_the_bit(pix_fmt):
    frame = some_frame(pix_fmt)
    before, pixels = planes_of(frame), to_rgb(frame)
    after = pixels.copy()
    half = np.iinfo(pixels.dtype).max // 2
    after[:16, :24] = half
    made = put_change(frame, pixels, after)
    assert made.format.name == pix_fmt
    for one, other in zip(before, planes_of(made), strict=True):
        rows, columns = one.shape
        # The change ends on a block of chroma; filters of chroma reach one sample farther.
        kept = np.ones(one.shape, bool)
        kept[: rows // 2 + 2, : columns // 2 + 2] = False
        assert (one[kept] == other[kept]).all()


def test_a_change_is_made():
    planes = [np.full((32, 48), value, np.uint8) for value in (100, 128, 128)]
    frame = frame_of(planes, "yuv444p")
    pixels = to_rgb(frame)
    made = put_change(frame, pixels, (pixels // 2).astype(np.uint8))
    assert np.abs(to_rgb(made).astype(int) - pixels // 2).max() <= 1


def test_a_format_of_other_kind_is_taken_to_one_that_can_be_written():
    picture = np.random.default_rng(0).integers(0, 256, (32, 48, 3), np.uint8)
    frame = av.VideoFrame.from_ndarray(picture, format="rgb24")
    frame.color_range = 2
    assert (to_rgb(frame) == picture).all()
    made = put_change(frame, picture, picture)
    assert made.format.name == "yuv444p"
