"""Frames as upright RGB pixels, and relit pixels back into frames as they are stored.

A pixel that the relighting leaves alone keeps the samples that were decoded: it does not go through RGB.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import cv2
import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

# Of ITU-T H.273; what is not told is by the frame's height, as players have it.
_MATRICES = {1: "ITU709", 4: "FCC", 5: "ITU601", 6: "ITU601", 7: "SMPTE240M", 9: "BT2020"}
_SMALL = 720  # rows below which a video that does not say is as of BT.601
#: Of swscale: bilinear chroma, at full precision, by the same arithmetic on every processor.
_HOW = 0x2 | 0x40000 | 0x2000 | 0x80000
_FULL = 2  # FFmpeg's number of the full range
#: Formats whose planes can be written: each holds one component, of 8 bits or 9 to 16 in two bytes.
PLANAR = ("yuv", "yuvj", "yuva", "gray")


def matrix_of(frame: Any) -> str:
    """Return by which matrix a frame's luma and chroma are made of RGB."""
    known = _MATRICES.get(int(frame.colorspace))
    return known or ("ITU709" if frame.height >= _SMALL else "ITU601")


def _range_of(frame: Any) -> str:
    full = int(frame.color_range) == _FULL or frame.format.name.startswith(("yuvj", "gbr", "rgb"))
    return "JPEG" if full else "MPEG"


def bits_of(frame: Any) -> int:
    """Return how many bits a sample has."""
    return int(max(one.bits for one in frame.format.components))


def has_alpha(frame: Any) -> bool:
    """Return whether a frame tells how transparent it is."""
    return any(one.is_alpha for one in frame.format.components)


def writable(frame: Any) -> Any:
    """Return a frame whose planes can be written, in the format that is nearest to its own, as most are.

    What an encoder is told of a frame, its matrix and range, is that of what this returns.
    """
    kind = frame.format
    if kind.name.startswith(PLANAR) and not kind.name.endswith("be"):
        return frame
    halved = kind.chroma_width(64) < 64, kind.chroma_height(64) < 64
    chroma = {(True, True): "420", (True, False): "422"}.get(halved, "444")
    alpha, depth = "a" * has_alpha(frame), "10le" if bits_of(frame) > 8 else ""
    made = frame.reformat(
        format=f"yuv{alpha}{chroma}p{depth}",
        src_colorspace=matrix_of(frame),
        dst_colorspace=matrix_of(frame),
        src_color_range=_range_of(frame),
        dst_color_range="MPEG",
        interpolation=_HOW,
        threads=1,
    )
    made.pts, made.color_primaries, made.color_trc = frame.pts, frame.color_primaries, frame.color_trc
    return made


def turns_of(frame: Any) -> int:
    """Return by how many quarters, counterclockwise, a frame is to be turned to be seen upright."""
    return round(float(frame.rotation) / 90) % 4


def to_rgb(frame: Any, *, small: bool = False) -> NDArray[Any]:
    """Return a frame upright, (H, W, 3): of 8 bits if it has so many, or `small`; else of 16."""
    deep = bits_of(frame) > 8 and not small
    made = frame.reformat(
        format="rgb48le" if deep else "rgb24",
        src_colorspace=matrix_of(frame),
        dst_colorspace="DEFAULT",
        src_color_range=_range_of(frame),
        dst_color_range="JPEG",
        interpolation=_HOW,
        threads=1,
    )
    return np.ascontiguousarray(np.rot90(made.to_ndarray(), turns_of(frame)))


def put_change(frame: Any, before: NDArray[Any], after: NDArray[Any]) -> Any:
    """Return a frame to whose samples is added by what two upright pictures, (H, W, 3), differ.

    Where they do not, it keeps the samples that were decoded, to the bit; and where they do, what subsampled
    chroma lost on the way to RGB is not lost from the frame.
    """
    back = -turns_of(frame)
    frame = writable(frame)
    old, new = (_stored(frame, np.ascontiguousarray(np.rot90(one, back))) for one in (before, after))
    frame.make_writable()
    deep = bits_of(frame) > 8
    most = (1 << bits_of(frame)) - 1
    for number in range(min(len(frame.planes), 3)):  # a fourth is alpha
        here, less, more = (
            _samples(one.planes[number], np.uint16 if deep else np.uint8) for one in (frame, old, new)
        )
        made = cv2.subtract(more, less, dtype=cv2.CV_32S)
        made = np.clip(cv2.add(made, here, dtype=cv2.CV_32S), 0, most)
        np.copyto(here, made, casting="unsafe")
    return frame


def _stored(frame: Any, pixels: NDArray[Any]) -> Any:
    """Return RGB pixels as a frame like another."""
    import av

    rgb = av.VideoFrame.from_ndarray(pixels, format="rgb48le" if pixels.dtype == np.uint16 else "rgb24")
    return rgb.reformat(
        format=frame.format.name,
        src_colorspace="DEFAULT",
        dst_colorspace=matrix_of(frame),
        src_color_range="JPEG",
        dst_color_range=_range_of(frame),
        interpolation=_HOW,
        threads=1,
    )


def _samples(plane: Any, kind: type) -> NDArray[Any]:
    """Return the samples of a plane, which are those of the frame itself."""
    size = np.dtype(kind).itemsize
    rows: NDArray[Any] = np.frombuffer(plane, kind).reshape(plane.height, plane.line_size // size)
    return rows[:, : plane.width]
