"""Times of decoding, codecs by names of files, and segments that are joined."""

import os
import subprocess
import sys
from fractions import Fraction
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from relit.errors import OptionError, OutputError
from relit.video.clip import look_at
from relit.video.encoding import Settings, decode_times
from tests.video.clips import make, moving


@given(st.lists(st.integers(-(10**6), 10**9), min_size=1, max_size=40, unique=True))
def test_packets_are_decoded_in_order_and_before_they_are_shown(pts):
    made = decode_times(pts)
    assert len(made) == len(pts)
    assert all(one < other for one, other in pairwise(made))
    assert all(decoded <= shown for decoded, shown in zip(made, pts, strict=True))


@pytest.fixture(scope="module")
def clip(tmp_path_factory):
    return look_at(str(make(tmp_path_factory.mktemp("clip") / "in.mp4", moving(3))))


@pytest.mark.parametrize(
    ("name", "codec"), [("a.mp4", "h264"), ("a.MOV", "h264"), ("a.mkv", "h264"), ("a.webm", "vp9")]
)
def test_the_codec_stays_where_it_can(clip, name, codec):
    assert Settings.of(name, clip, None, None).codec == codec


def test_what_cannot_be_is_refused(clip):
    with pytest.raises(OutputError, match=r"expected a name in \.mp4"):
        Settings.of("a.gif", clip, None, None)
    with pytest.raises(OptionError, match=r"a \.webm file holds vp9, got 'prores'"):
        Settings.of("a.webm", clip, "prores", None)
    with pytest.raises(OptionError, match="prores has none"):
        Settings.of("a.mov", clip, "prores", 20)
    with pytest.raises(OptionError, match="0 to 51"):
        Settings.of("a.mp4", clip, "h264", 52)


MAKE = """
import sys
from pathlib import Path
from relit.video.clip import frames, look_at
from relit.video.encoding import Settings
from relit.video.segments import encode
clip = look_at(sys.argv[1])
encode(Path(sys.argv[2]), frames(clip), Settings.of("a.mkv", clip, sys.argv[3], None), clip, 1.0)
"""


@pytest.mark.slow
@pytest.mark.parametrize("codec", ["h264", "h265", "vp9", "prores"])
def test_what_is_written_does_not_lean_on_memory_that_never_was(tmp_path, codec):
    # 100 px are no multiple of 16: encoders pad. glibc fills what it gives with what is asked.
    source = make(
        tmp_path / "in.mkv", moving(8, side=100), tick=Fraction(1, 1000), times=[40 * k for k in range(8)]
    )
    made = set()
    for fill in ("0", "85", "170"):
        asked = [sys.executable, "-c", MAKE, str(source), str(tmp_path / "a.segment"), codec]
        subprocess.run(asked, check=True, env={**os.environ, "MALLOC_PERTURB_": fill})
        made.add((tmp_path / "a.segment").read_bytes())
    assert len(made) == 1
