"""Clips whose frames no film of the kind asked for holds as they are."""

from fractions import Fraction

import av
import numpy as np
import pytest

from relit.settings.options import TransferOptions
from relit.video.film import relight_video
from tests.video.clips import face, frames, make, moving

pytestmark = [pytest.mark.slow, pytest.mark.rotating]


def relit(source, output, **more):
    return relight_video(str(source), str(output), TransferOptions(light="split"), **more)


def pictures(path):
    return [one.to_ndarray(format="rgb24").astype(int) for one in frames(path)]


def is_relit(before, after):
    """Whether the face is another, and the corner the same but for what the codec and chroma lose."""
    for one, other in zip(before, after, strict=True):
        assert one.shape == other.shape
        assert np.abs(one - other)[50:80, 40:90].mean() > 12
        assert np.abs(one - other)[:12, :12].mean() < 4
    return True


@pytest.mark.parametrize(
    ("name", "codec", "pix_fmt"),
    [
        ("in.mov", "qtrle", "rgb24"),
        ("in.mov", "png", "rgb24"),
        ("in.mkv", "ffv1", "bgr0"),
        ("in.mkv", "ffv1", "gbrp10le"),
        ("in.mkv", "libx264rgb", "rgb24"),
        ("in.gif", "gif", "rgb8"),
        ("in.avi", "rawvideo", "uyvy422"),
        ("in.mkv", "ffv1", "yuv444p"),
    ],
)
@pytest.mark.parametrize("lit", [True, False])
def test_colours_that_are_no_luma_and_chroma(tmp_path, name, codec, pix_fmt, lit):
    tick = {"mkv": Fraction(1, 1000), "gif": Fraction(1, 100), "avi": Fraction(1, 25)}.get(name[-3:])
    tick = tick or Fraction(1, 12800)
    times = [round(k / 25 / tick) for k in range(4)]
    # Where a clip begins without a face, its first frame is one that nothing is done to.
    flat = np.full((128, 128, 3), (30, 90, 40), np.uint8)
    shown = moving(4) if lit else [flat, flat, *moving(2)]
    source = make(tmp_path / name, shown, codec, pix_fmt, times, tick, tags={"color_range": 2})
    made = relit(source, tmp_path / "out.mp4", crf=4)
    assert made.lit == (4 if lit else 2)
    before, after = pictures(source), pictures(tmp_path / "out.mp4")
    assert is_relit(before[-made.lit :], after[-made.lit :])
    for one, other in zip(before[: -made.lit], after[: -made.lit], strict=True):
        assert np.abs(one - other).mean() < 4


@pytest.mark.parametrize("codec", ["h264", "h265", "vp9"])
@pytest.mark.parametrize("pix_fmt", ["yuvj420p", "yuvj422p"])
def test_sides_that_cannot_be_halved(tmp_path, codec, pix_fmt):
    odd = [one[:127, :125] for one in moving(3)]
    source = make(
        tmp_path / "in.avi", odd, "mjpeg", pix_fmt, [0, 1, 2], Fraction(1, 25), tags={"color_range": 2}
    )
    made = relit(source, tmp_path / "out.mp4", codec=codec, crf=4)
    assert made.lit == 3
    assert is_relit(pictures(source), pictures(tmp_path / "out.mp4"))


@pytest.mark.parametrize(("output", "kept"), [("out.mov", True), ("out.mp4", False)])
def test_transparency_is_kept_or_named(tmp_path, output, kept):
    source = tmp_path / "in.mov"
    with av.open(str(source), "w") as film:
        stream = film.add_stream("png", rate=25)
        stream.width = stream.height = 128
        stream.pix_fmt = "rgba"
        alpha = np.full((128, 128), 255, np.uint8)
        alpha[:, :40] = 51
        for k in range(2):
            frame = av.VideoFrame.from_ndarray(np.dstack([face(), alpha]), format="rgba")
            frame.pts = k
            film.mux(stream.encode(frame))
        film.mux(stream.encode(None))
    made = relit(source, tmp_path / output, codec="prores" if kept else None)
    assert made.not_kept == ([] if kept else ["transparency"])
    if kept:
        seen = frames(tmp_path / output)[0].to_ndarray(format="rgba")[..., 3]
        assert seen[:, :36].mean() == pytest.approx(51, abs=2)
        assert seen[:, 44:].mean() == pytest.approx(255, abs=2)
