"""What is kept of a film while it is made: for one run at a time, of the same settings, no longer."""

import os

import pytest

from relit.errors import ImageError, OutputError
from relit.video.state import kept_state


@pytest.fixture
def film(tmp_path):
    return tmp_path / "film.mp4"


def stopped(film, given, error=KeyboardInterrupt, tracked=True):
    """Begin a film, and be stopped by an error in the middle."""

    def run():
        with kept_state(film, given) as folder:
            if tracked:
                (folder / "track.npz").write_bytes(b"track")
            raise error

    with pytest.raises(error):
        run()


def names(film):
    return sorted(path.name for path in film.parent.iterdir())


def test_nothing_stays_when_it_is_whole(film):
    with kept_state(film, ["loop"]) as folder:
        (folder / "track.npz").write_bytes(b"track")
    assert names(film) == []


def test_who_starts_again_finds_what_was_done(film):
    stopped(film, ["loop"])
    assert names(film) == [".film.mp4.relit-video"]
    with kept_state(film, ["loop"]) as folder:
        assert (folder / "track.npz").read_bytes() == b"track"


def test_other_settings_begin_anew(film):
    stopped(film, ["loop"])
    with kept_state(film, ["split"]) as folder:
        assert not (folder / "track.npz").exists()


@pytest.mark.parametrize(("error", "tracked"), [(ImageError, True), (KeyboardInterrupt, False)])
def test_nothing_stays_of_what_would_fail_again_or_had_hardly_begun(film, error, tracked):
    stopped(film, ["loop"], error, tracked)
    assert names(film) == []


def test_a_second_run_is_refused_and_takes_nothing_away(film):
    with kept_state(film, ["loop"]) as folder:
        told = rf"film\.mp4: another run is at work here \(process {os.getpid()} on "
        with pytest.raises(OutputError, match=told), kept_state(film, ["split"]):
            pytest.fail("two are at work")
        assert (folder / "given.json").exists()


def test_a_file_in_the_way_is_told(film):
    film.with_name(".film.mp4.relit-video").write_bytes(b"a user's")
    told = r"relit-video: cannot be written \(.*\); choose another place"
    with pytest.raises(OutputError, match=told), kept_state(film, ["loop"]):
        pytest.fail("a file is no folder")
    assert names(film) == [".film.mp4.relit-video"]
