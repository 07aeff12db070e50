"""`relit video` on the command line: what it makes, and what it refuses in one line."""

import json
import sys

import numpy as np
import pytest
from PIL import Image

from relit.video.clip import look_at, missing_end
from tests.video.clips import TAGS, frames, make, moving


@pytest.fixture
def clips(place):
    """The working folder, which holds small clips and files that are none."""
    make(place / "in.mp4", moving(4))
    make(place / "ref.mp4", moving(2))
    return place


@pytest.mark.parametrize(
    ("command", "message"),
    [
        ("video in.mp4 reference.png", "Missing option '-o'"),
        ("video in.mp4 -o out.mp4", "Give a REFERENCE, or --light, and not both."),
        ("video in.mp4 reference.png --light loop -o out.mp4", "Give a REFERENCE, or --light, and not both."),
        ("video in.mp4 in.mp4 in.mp4 -o out.mp4", "Give one video as REFERENCE, or photos."),
        ("video - --light loop -o out.mp4", "A video cannot come from stdin"),
        ("video in.mp4 --light loop -o out.mp4 --from 1:99", "'1:99' is not a time"),
        ("video in.mp4 --light loop -o out.mp4 --from 2 --to 1", "--to: expected more than 2 s"),
        ("video in.mp4 --light loop -o out.mp4 --from 99", "in.mp4: has no frame in the time asked for"),
        ("video in.mp4 --light loop -o in.mp4", "in.mp4: exists already; use --force"),
        ("video in.mp4 --light loop -o in.mp4 --force", "in.mp4: is a video that is read"),
        ("video in.mp4 ref.mp4 -o ref.mp4 --force", "ref.mp4: is a video that is read"),
        ("video in.mp4 ref.mp4 --reference-face 7 -o out.mp4", "ref.mp4: no face 7"),
        ("video in.mp4 ref.mp4 --reference-landmarks a.pts -o out.mp4", "leave it out of a video REFERENCE"),
        ("video in.mp4 --light loop --reference-end loop -o out.mp4", "--reference-end loop is for a video"),
        ("video in.mp4 --light loop -o out.gif", "out.gif: expected a name in .mp4"),
        ("video in.mp4 --light loop -o no/out.mp4", "no/out.mp4: there is no folder no"),
        ("video in.mp4 --light loop -o out.webm --codec h264", "--codec: a .webm file holds vp9, got 'h264'"),
        ("video in.mp4 --light loop -o out.mp4 --crf 99", "--crf: expected 0 to 51 with h264, got 99"),
        (
            "video in.mp4 --light loop -o out.mp4 --face 2",
            "no face 2 (counted from 0, the largest first) found",
        ),
        ("video missing.mp4 --light loop -o out.mp4", "missing.mp4: there is no such file; check the name"),
        ("video . --light loop -o out.mp4", ".: is a folder; give a video file"),
        ("video in.mp4 missing.jpg -o out.mp4", "missing.jpg: there is no such file"),
    ],
)
def test_what_is_asked_wrongly(clips, fail, command, message):
    assert clips.exists()
    assert message in fail(command, code=(1, 2))


def test_files_that_are_no_videos(clips, fail):
    whole = (clips / "in.mp4").read_bytes()
    (clips / "text.mp4").write_text("Dear diary, today I am a film.\n")
    (clips / "empty.mp4").write_bytes(b"")
    (clips / "cut.mp4").write_bytes(whole[: len(whole) // 2])
    make(clips / "noface.mp4", [np.full((64, 64, 3), 90, np.uint8)] * 3)
    make(clips / "tiny.mkv", [np.full((8, 8, 3), 90, np.uint8)] * 3, "ffv1")
    make(clips / "wide.mp4", moving(2), tags={**TAGS, "color_trc": 16})
    for name, message in (
        ("text.mp4", "text.mp4: is no video that can be read"),
        ("empty.mp4", "empty.mp4: is no video that can be read"),
        ("cut.mp4", "cut.mp4: is no video that can be read, or is cut off"),
        ("noface.mp4", "noface.mp4: no face found in any frame"),
        ("tiny.mkv", "tiny.mkv: expected a video of 16 px a side or more, found 8x8"),
        ("wide.mp4", "wide.mp4: is in a high dynamic range (PQ)"),
        ("target.png", "target.png: is a photo; relight it by relit transfer"),
    ):
        assert message in fail(f"video {name} --light loop -o out.mp4")


def test_without_pyav(fail, monkeypatch):
    monkeypatch.setitem(sys.modules, "av", None)
    assert "pip install 'relit[video]'" in fail("video in.mp4 --light loop -o out.mp4", code=2)


@pytest.mark.slow
def test_a_film_and_its_sheet(clips, run):
    told = json.loads(run("video in.mp4 reference.png -o out.mp4 --sheet sheet.png --from 0.04 --json").out)
    assert (told["frames"], told["relit"], told["shots"]) == (3, 3, 1)
    assert len(frames(clips / "out.mp4")) == 3
    with Image.open(clips / "sheet.png") as sheet:
        assert sheet.size == (3 * 128, 2 * 128)


@pytest.mark.slow
def test_a_file_that_is_cut_off_is_told(clips, run):
    make(clips / "whole.mkv", moving(30), options={"g": "1"})
    assert missing_end(look_at(str(clips / "whole.mkv"))) == 0
    data = (clips / "whole.mkv").read_bytes()
    (clips / "cut.mkv").write_bytes(data[: len(data) // 2])
    done = run("video cut.mkv --light loop -o out.mkv --json")
    told = json.loads(done.out)
    shown = len(frames(clips / "out.mkv"))
    assert shown == told["frames"] < 18
    assert told["missing_seconds"] == pytest.approx((30 - shown) / 25, abs=0.05)
    assert f"cut.mkv: ends {told['missing_seconds']:.1f} s sooner than it says" in done.err
