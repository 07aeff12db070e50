"""Clocks that are wrong: times of files from the future, or set back, and a clock that jumps between runs."""

import datetime as dt
import itertools
import json
import os
import time

import pytest
from PIL import Image

from relit.batch import cache
from relit.batch import run as runs
from relit.batch.cache import DiskCache
from relit.batch.run import Counts
from relit.cli.progress import _line
from relit.ltv import decomposition as ltv
from tests.batch.caches import entries, picture

DAY = 86_400 * 10**9
TIMES = {"1970": 1, "yesterday": -DAY, "tomorrow": DAY, "2100": 130 * 365 * DAY}


def set_time(path, when):
    at = when if when > 300 * DAY or when == 1 else time.time_ns() + when
    os.utime(path, ns=(at, at))


@pytest.mark.parametrize("when", TIMES.values(), ids=TIMES)
def test_what_changed_is_seen_whatever_its_time_says(place, run, when):
    """A photo is put in place of another of the same size and time, as tools that keep times do."""
    (place / "m.csv").write_text("target,target_landmarks,output\nphoto.bmp,target.csv,a.png\n")
    photo = place / "photo.bmp"
    with Image.open(place / "target.png") as picture:
        picture.save(photo)
        picture.transpose(Image.Transpose.FLIP_LEFT_RIGHT).save(place / "turned.bmp")
    set_time(photo, when)
    ask = "batch --do normalize m.csv -o out --json"
    assert json.loads(run(ask).out)["ok"] == 1
    first, old = (place / "out" / "a.png").read_bytes(), photo.stat()
    assert json.loads(run(ask).out)["kept"] == 1  # what did not change stays
    with photo.open("r+b") as stream:
        stream.write((place / "turned.bmp").read_bytes())
    os.utime(photo, ns=(old.st_atime_ns, old.st_mtime_ns))
    now = photo.stat()
    assert (now.st_size, now.st_mtime_ns, now.st_ino) == (old.st_size, old.st_mtime_ns, old.st_ino)
    assert json.loads(run(ask).out)["ok"] == 1
    assert (place / "out" / "a.png").read_bytes() != first


@pytest.mark.parametrize("jump", [-40 * 365, -1, 1, 40 * 365])
def test_a_clock_that_jumps_while_a_batch_runs(place, run, monkeypatch, jump):
    (place / "m.csv").write_text("target,target_landmarks\ntarget.png,target.csv\n")
    began = dt.datetime.now(dt.UTC)
    clock = itertools.chain([began], itertools.repeat(began + dt.timedelta(days=jump)))

    class Jumping(dt.datetime):
        @classmethod
        def now(cls, _zone=None):
            return next(clock)

    monkeypatch.setattr(runs, "datetime", Jumping)
    assert run("batch --do normalize m.csv -o out --jobs 1").code == 0
    record = json.loads((place / "out" / "run.json").read_text())
    assert 0 <= record["seconds"] < 600
    assert record["started"] == began.isoformat(timespec="seconds")
    assert json.loads(run("batch --do normalize m.csv -o out --json").out)["kept"] == 1


def test_the_time_that_is_left_is_never_less_than_none():
    for done in range(1, 5):
        line = _line(Counts(4, ok=done), time.monotonic() - 1)
        assert "-" not in line
        assert line.endswith(" left")


class TestCache:
    @pytest.fixture
    def room_for_three(self, tmp_path):
        with (kept := DiskCache(tmp_path, 10_000_000)).open():
            ltv.decompose(picture(0))
        (entry,) = entries(tmp_path)
        size = entry.stat().st_size
        entry.unlink()
        return DiskCache(tmp_path, size * 4 - 1), kept

    def test_entries_from_the_future_go_first(self, room_for_three, tmp_path, monkeypatch):
        """As after a clock that ran ahead was set right: else they would hold the room for years."""
        kept, _ = room_for_three
        monkeypatch.setattr(cache, "_touch", lambda path: set_time(path, 50 * 365 * DAY))
        with kept.open():
            for seed in range(3):
                ltv.decompose(picture(seed))
        ahead = set(entries(tmp_path))
        monkeypatch.undo()
        with kept.open():
            for seed in range(10, 13):
                ltv.decompose(picture(seed))
        assert set(entries(tmp_path)).isdisjoint(ahead)
        assert entries(tmp_path)

    @pytest.mark.parametrize("when", TIMES.values(), ids=TIMES)
    def test_what_is_found_is_not_a_matter_of_time(self, tmp_path, when):
        with DiskCache(tmp_path, 10_000_000).open():
            first = ltv.decompose(picture(0))
        for entry in entries(tmp_path):
            set_time(entry, when)
        with DiskCache(tmp_path, 10_000_000).open():
            again = ltv.decompose(picture(0))
        assert (again.u == first.u).all()
        assert len(entries(tmp_path)) == 1
