"""Films as a whole: what goes with the pictures stays, and who is interrupted goes on."""

import shutil
import subprocess
from fractions import Fraction
from pathlib import Path

import av
import numpy as np
import pytest

from relit.face.detect import detect_landmarks
from relit.face.landmarks import Landmarks
from relit.settings.options import TransferOptions
from relit.video import film as module
from relit.video.film import relight_video
from tests.video.clips import TAGS, face, frames, make, moving, packets

pytestmark = pytest.mark.slow
LIGHT = TransferOptions(light="split")


def relit(source, output, options=LIGHT, **more):
    return relight_video(str(source), str(output), options, **more)


def seconds(path):
    return [Fraction(one.pts * one.time_base) for one in frames(path)]


@pytest.fixture(scope="module")
def plain(tmp_path_factory):
    """A clip with all that can go with it, and what came of it."""
    folder = tmp_path_factory.mktemp("plain")
    chapters = [
        {
            "id": k,
            "start": 200 * k,
            "end": 200 * k + 200,
            "time_base": Fraction(1, 1000),
            "metadata": {"title": t},
        }
        for k, t in enumerate(("one", "two"))
    ]
    source = make(
        folder / "in.mkv", moving(12), tick=Fraction(1, 1000), times=[40 * k for k in range(12)],
        sound="libopus", subtitles="subrip", chapters=chapters, aspect=Fraction(4, 3),
    )  # fmt: skip
    made = relit(source, folder / "out.mkv")
    return source, folder / "out.mkv", made


def test_the_face_is_relit_and_the_rest_is_not(plain):
    source, output, made = plain
    before, after = (
        [one.to_ndarray(format="rgb24").astype(int) for one in frames(p)] for p in (source, output)
    )
    assert (made.frames, made.lit, made.shots, made.not_kept) == (12, 12, 1, [])
    for one, other in zip(before, after, strict=True):
        assert np.abs(one - other)[50:80, 40:90].mean() > 12
        assert np.abs(one - other)[:12, :12].mean() < 4
    sides = [one[50:90, 40:65].mean() - one[50:90, 70:100].mean() for one in (before[0], after[0])]
    assert abs(sides[1] - sides[0]) > 20


@pytest.mark.parametrize("kind", ["audio", "subtitle"])
def test_sound_and_subtitles_are_the_same_bytes(plain, kind):
    source, output, _ = plain
    assert packets(source, kind)
    assert packets(source, kind) == packets(output, kind)


def test_times_tags_chapters_and_the_shape_of_pixels_stay(plain):
    source, output, _ = plain
    assert seconds(source) == seconds(output)
    with av.open(str(source)) as one, av.open(str(output)) as other:
        for name in ("width", "height", "sample_aspect_ratio", "average_rate"):
            assert getattr(one.streams.video[0], name) == getattr(other.streams.video[0], name), name
        assert other.metadata["title"] == "A face"
        assert [(c["start"], c["end"], c["metadata"]) for c in one.chapters()] == [
            (c["start"], c["end"], c["metadata"]) for c in other.chapters()
        ]
    for one in frames(output):
        assert {name: int(getattr(one, name)) for name in TAGS} == TAGS


@pytest.mark.skipif(not shutil.which("ffprobe"), reason="needs ffprobe")
def test_ffprobe_says_the_same_of_both(plain):
    source, output, _ = plain
    entries = "stream=codec_name,width,height,pix_fmt,color_range,color_space,color_transfer,color_primaries"
    asked = ["ffprobe", "-v", "error", "-select_streams", "v", "-of", "csv", "-show_entries", entries]
    told = [subprocess.check_output([*asked, str(path)]) for path in (source, output)]
    assert told[0] == told[1]


def test_frames_that_come_unevenly(tmp_path):
    times = [0, 500, 1000, 1800, 1900, 4000, 4512, 5024]
    source = make(tmp_path / "in.mp4", moving(8), times=times)
    relit(source, tmp_path / "out.mp4")
    assert seconds(tmp_path / "out.mp4") == seconds(source) == [Fraction(one, 12800) for one in times]


def test_ten_bits_in_prores_with_alpha(tmp_path):
    source = make(tmp_path / "in.mov", moving(3), "prores_ks", "yuva444p10le", options={"profile": "4444"})
    relit(source, tmp_path / "out.mov")
    for one, other in zip(frames(source), frames(tmp_path / "out.mov"), strict=True):
        assert other.format.name == one.format.name
    with av.open(str(tmp_path / "out.mov")) as film:
        assert film.streams.video[0].codec_context.name == "prores"


@pytest.mark.parametrize(
    ("name", "codec", "pix_fmt", "wanted"),
    [
        ("a.mp4", "libx265", "yuv420p10le", "hevc"),
        ("a.webm", "libvpx-vp9", "yuv420p", "vp9"),
        ("a.mov", "prores_ks", "yuv422p10le", "prores"),
        ("a.mkv", "libx264", "yuv444p", "h264"),
    ],
)
def test_codecs_and_depths_stay(tmp_path, name, codec, pix_fmt, wanted):
    options = {"x265-params": "log-level=error"} if codec == "libx265" else {}
    tick = Fraction(1, 1000) if name.endswith(("webm", "mkv")) else Fraction(1, 12800)
    times = [40 * k for k in range(4)] if tick == Fraction(1, 1000) else None
    source = make(tmp_path / name, moving(4), codec, pix_fmt, tick=tick, times=times, options=options)
    output = tmp_path / f"out{Path(name).suffix}"
    relit(source, output)
    with av.open(str(output)) as film:
        assert film.streams.video[0].codec_context.name in (wanted, f"lib{wanted}")
    assert {one.format.name for one in frames(output)} == {one.format.name for one in frames(source)}
    assert seconds(output) == seconds(source)


@pytest.mark.parametrize("turned", [90, 180, -90])
def test_a_phone_held_upright(tmp_path, turned):
    lying = [np.ascontiguousarray(np.rot90(one, -turned // 90)) for one in moving(3)]
    source = make(tmp_path / "in.mp4", lying, turned=turned)
    assert {one.rotation for one in frames(source)} <= {turned, -turned, turned % 360}
    made = relit(source, tmp_path / "out.mp4")
    assert made.lit == 3
    assert [one.rotation for one in frames(tmp_path / "out.mp4")] == [one.rotation for one in frames(source)]


def test_a_part_begins_at_zero_with_its_sound(tmp_path):
    source = make(tmp_path / "in.mp4", moving(12), sound="aac")
    made = relit(source, tmp_path / "out.mp4", part=(0.16, 0.36))
    assert made.frames == 5
    assert seconds(tmp_path / "out.mp4") == [Fraction(k, 25) for k in range(5)]
    sound = packets(tmp_path / "out.mp4", "audio")
    whole = {data for _, data in packets(source, "audio")}
    assert 8 <= len(sound) <= 11
    assert all(data in whole for _, data in sound)


def test_one_frame(tmp_path):
    made = relit(make(tmp_path / "in.mp4", moving(1)), tmp_path / "out.mp4")
    assert (made.frames, made.lit, len(frames(tmp_path / "out.mp4"))) == (1, 1, 1)


def test_a_cut_to_another_scene(tmp_path):
    flat = np.full((128, 128, 3), (30, 90, 40), np.uint8)
    source = make(tmp_path / "in.mp4", moving(6) + [flat] * 5 + moving(6))
    made = relit(source, tmp_path / "out.mp4", crf=0)
    assert (made.shots, made.lit) == (3, 12)
    before, after = (
        [one.to_ndarray(format="rgb24") for one in frames(p)] for p in (source, tmp_path / "out.mp4")
    )
    assert (before[8] == after[8]).all()
    # No fading at a cut: the face is lit at once.
    step = [np.abs(before[k].astype(int) - after[k])[50:80, 40:90].mean() for k in (0, 5, 11, 16)]
    assert min(step) > 0.7 * max(step)


def test_a_light_that_moves(tmp_path):
    left, right = (
        [np.clip(face() * (0.6 + s * np.linspace(-0.5, 0.5, 128)[:, None]), 0, 255).astype(np.uint8)]
        for s in (-1, 1)
    )
    make(tmp_path / "in.mp4", moving(40, step=0.2))
    make(tmp_path / "light.mp4", left * 20 + right * 20)
    relit(
        tmp_path / "in.mp4",
        tmp_path / "out.mp4",
        TransferOptions(),
        reference_video=str(tmp_path / "light.mp4"),
    )
    made = [one.to_ndarray(format="gray").astype(float) for one in frames(tmp_path / "out.mp4")]
    sides = [one[50:90, 35:60].mean() - one[50:90, 75:100].mean() for one in made]
    assert sides[2] - sides[-3] > 15


@pytest.fixture
def kept(tmp_path, monkeypatch):
    """A clip of several segments."""
    monkeypatch.setattr(module, "_SEGMENT", 4)
    return make(tmp_path / "in.mp4", moving(12), sound="aac")


def test_who_is_stopped_goes_on_to_the_same_bytes(kept, tmp_path, monkeypatch):
    relit(kept, tmp_path / "whole.mp4")
    real, done = module.encode, []

    def stopping(path, *given):
        if len(done) == 2:
            raise KeyboardInterrupt
        done.append(path.name)
        real(path, *given)

    monkeypatch.setattr(module, "encode", stopping)
    with pytest.raises(KeyboardInterrupt):
        relit(kept, tmp_path / "out.mp4")
    assert not (tmp_path / "out.mp4").exists()
    monkeypatch.setattr(module, "encode", lambda path, *given: (done.append(path.name), real(path, *given)))
    relit(kept, tmp_path / "out.mp4")
    assert len(done) == len(set(done)) == 3
    assert (tmp_path / "out.mp4").read_bytes() == (tmp_path / "whole.mp4").read_bytes()
    assert sorted(one.name for one in tmp_path.iterdir()) == ["in.mp4", "out.mp4", "whole.mp4"]


def test_other_settings_begin_anew(kept, tmp_path, monkeypatch):
    real = module.join
    monkeypatch.setattr(module, "join", lambda *_: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        relit(kept, tmp_path / "out.mp4")
    monkeypatch.setattr(module, "join", real)
    done, encode = [], module.encode
    monkeypatch.setattr(module, "encode", lambda *given: (done.append(1), encode(*given)))
    relit(kept, tmp_path / "out.mp4", TransferOptions(light="loop"))
    assert len(done) == 3


def test_another_face_in_the_reference_begins_anew(kept, tmp_path, monkeypatch):
    """And not with one light before where it was stopped and another after."""
    light = np.ascontiguousarray(np.hstack([face(), face()[:, ::-1] // 2]))
    # Found by columns: the face here, and the same 128 px farther right.
    here = detect_landmarks(face())
    there = Landmarks(here.points + np.array([128, 0, 0]), here.scheme)

    def run(name, landmarks):
        relit(kept, tmp_path / name, TransferOptions(), references=[light], reference_landmarks=[landmarks])

    real = module.encode

    def stopping(path, *given):
        if int(path.stem):
            raise KeyboardInterrupt
        real(path, *given)

    monkeypatch.setattr(module, "encode", stopping)
    with pytest.raises(KeyboardInterrupt):
        run("out.mp4", here)
    monkeypatch.setattr(module, "encode", real)
    run("out.mp4", there)
    run("whole.mp4", there)
    assert (tmp_path / "out.mp4").read_bytes() == (tmp_path / "whole.mp4").read_bytes()


def test_who_goes_on_is_told_how_sure_the_light_of_all_is(kept, tmp_path, monkeypatch):
    """Also of what was lit before it was stopped."""
    told = iter([0.3, 0.9, 0.8])
    real = module.Lights.prepare

    def prepare(lights, *given):
        real(lights, *given)
        lights.confidence = min(lights.confidence, next(told))

    monkeypatch.setattr(module.Lights, "prepare", prepare)
    join = module.join
    monkeypatch.setattr(module, "join", lambda *_: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        relit(kept, tmp_path / "out.mp4")
    monkeypatch.setattr(module, "join", join)
    assert relit(kept, tmp_path / "out.mp4").confidence == 0.3


def test_the_same_bytes_on_any_number_of_threads(kept, tmp_path, monkeypatch):
    for count in (1, 3):
        monkeypatch.setattr(module, "available", lambda count=count: count)
        monkeypatch.setattr("relit.video.lights.available", lambda count=count: count)
        relit(kept, tmp_path / f"{count}.mp4")
    assert (tmp_path / "1.mp4").read_bytes() == (tmp_path / "3.mp4").read_bytes()
