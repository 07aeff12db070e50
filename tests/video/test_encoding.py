"""Times of decoding, codecs by names of files, and segments that are joined."""

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
