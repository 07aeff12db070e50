"""What goes with the pictures of a clip, and where a part of it begins, in files of many kinds."""

import errno
from fractions import Fraction

import av
import numpy as np
import pytest

from relit.errors import ImageError, OutputError
from relit.settings.options import TransferOptions
from relit.video import segments
from relit.video.clip import frames as frames_of
from relit.video.clip import look_at
from relit.video.film import relight_video
from tests.video.clips import frames, make, moving, packets

pytestmark = [pytest.mark.slow, pytest.mark.rotating]
LIGHT = TransferOptions(light="split")
MS = Fraction(1, 1000)


def at(count):
    return [40 * k for k in range(count)]


@pytest.mark.parametrize(("name", "tick"), [("in.ts", Fraction(1, 90000)), ("in.mkv", MS), ("in.mp4", None)])
@pytest.mark.parametrize(("first", "last", "wanted"), [(0.48, None, 63), (1.0, 2.0, 25), (2.4, None, 15)])
def test_a_part_begins_where_it_is_asked_also_where_nothing_tells_where_that_is(
    tmp_path, name, tick, first, last, wanted
):
    tick = tick or Fraction(1, 12800)
    times = [int(Fraction(k, 25) / tick) for k in range(75)]
    source = make(
        tmp_path / name, moving(75, 64, 0.1), times=times, tick=tick,
        options={"g": "50", "keyint_min": "50", "sc_threshold": "0"},
    )  # fmt: skip
    found = list(frames_of(look_at(str(source)), first, last))
    assert len(found) == wanted
    clip = look_at(str(source))
    assert float(found[0].pts * clip.time_base) - clip.start == pytest.approx(first, abs=1e-3)


def test_times_that_run_backward_are_refused(tmp_path):
    tick = Fraction(1, 25)
    make(tmp_path / "in.avi", moving(8, 64), times=list(range(8)), tick=tick, options={"bf": "2"})
    seen = [one.pts for one in frames(tmp_path / "in.avi")]
    assert seen != sorted(seen)
    with pytest.raises(ImageError, match=r"in\.avi: its times run backward at .* convert it to MP4 first"):
        list(frames_of(look_at(str(tmp_path / "in.avi"))))


@pytest.fixture
def relit(tmp_path):
    def relit(source, output, options=LIGHT, **more):
        return relight_video(str(source), str(tmp_path / output), options, **more)

    return relit


def test_attached_files_stay_in_mkv_and_are_named_elsewhere(tmp_path, relit):
    source = tmp_path / "in.mkv"
    with av.open(str(source), "w") as film:
        stream = film.add_stream("libx264", rate=25)
        stream.width = stream.height = 128
        stream.disposition = av.stream.Disposition.default
        film.add_attachment("face.ttf", "application/x-truetype-font", b"\0\1\0\0 a font" * 9)
        for picture in moving(2):
            film.mux(stream.encode(av.VideoFrame.from_ndarray(picture, format="rgb24")))
        film.mux(stream.encode(None))
    assert relit(source, "out.mkv").not_kept == []
    with av.open(str(tmp_path / "out.mkv")) as film:
        (kept,) = film.streams.attachments
        assert (kept.name, kept.mimetype) == ("face.ttf", "application/x-truetype-font")
        assert bytes(kept.data) == b"\0\1\0\0 a font" * 9
        assert film.streams.video[0].disposition == av.stream.Disposition.default
    assert relit(source, "out.mp4").not_kept == ["a stream of attachment (unknown)"]


def test_chapters_of_mp4_are_no_lost_stream(tmp_path, relit):
    chapters = [
        {"id": k, "start": 80 * k, "end": 80 * k + 80, "time_base": MS, "metadata": {"title": str(k)}}
        for k in range(2)
    ]
    source = make(tmp_path / "in.mp4", moving(4), chapters=chapters)
    with av.open(str(source)) as clip:
        assert [one.type for one in clip.streams] == ["video", "data"]
    assert relit(source, "out.mp4").not_kept == []
    with av.open(str(tmp_path / "out.mp4")) as film:
        assert [one["metadata"]["title"] for one in film.chapters()] == ["0", "1"]


@pytest.mark.parametrize(
    ("part", "begin", "end"), [((0.16, None), 0, 140), ((None, 0.2), 100, 200), ((0.16, 0.24), 0, 80)]
)
def test_words_that_are_shown_at_an_end_are_cut_there(tmp_path, relit, part, begin, end):
    """They are shown from .1 s to .3 s."""
    source = make(tmp_path / "in.mkv", moving(12), times=at(12), tick=MS, subtitles="subrip")
    relit(source, "out.mkv", part=part)
    with av.open(str(tmp_path / "out.mkv")) as film:
        (words,) = (one for one in film.demux(subtitles=0) if one.size)
        assert (words.pts, words.pts + words.duration) == (begin, end)
    assert packets(tmp_path / "out.mkv", "subtitle")[0][1] == b"hello"


@pytest.mark.parametrize(
    ("name", "codec", "pix_fmt"),
    [
        ("out.mp4", "h264", "yuv420p"),
        ("out.mkv", "h264", "yuv420p10le"),
        ("out.mp4", "h265", "yuv420p"),
        ("out.webm", "vp9", "yuv420p"),
    ],
)
def test_a_factor_of_0_loses_nothing(tmp_path, relit, name, codec, pix_fmt):
    source = make(tmp_path / "in.mkv", moving(3), "libx264", pix_fmt, at(3), MS)
    relit(source, name, TransferOptions(light="split", strength=0), codec=codec, crf=0)
    for one, other in zip(frames(source), frames(tmp_path / name), strict=True):
        assert one.format.name == other.format.name
        for plane, there in zip(one.planes, other.planes, strict=True):
            left, right = (
                np.frombuffer(p, np.uint8).reshape(p.height, -1)[:, : p.width] for p in (plane, there)
            )
            assert (left == right).all()


def test_a_full_disk_is_told_and_what_was_done_is_kept(tmp_path, relit, monkeypatch):
    source = make(tmp_path / "in.mp4", moving(2))

    def full(*_given, **_more):
        raise OSError(errno.ENOSPC, "No space left on device")

    with monkeypatch.context() as patched:
        patched.setattr(segments.np, "savez", full)
        patched.setattr("relit.video.tracking.np.savez", np.savez)
        with pytest.raises(
            OutputError, match=r"out\.mp4: cannot be written \(No space left on device\); make"
        ):
            relit(source, "out.mp4")
    relit(source, "out.mp4")
    assert sorted(one.name for one in tmp_path.iterdir()) == ["in.mp4", "out.mp4"]
