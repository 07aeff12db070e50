"""Two batches into one folder: one is told who is there, nothing is lost, and no lock waits for a hand."""

# ruff: noqa: F811 (a fixture of another module)

import json
import os
import re
import signal
import socket
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

from relit.batch.work import _write
from relit.errors import OutputError
from relit.photo.alone import alone_at
from tests.batch.runs import brake, results, tree  # noqa: F401 (fixtures)
from tests.command import the_line

HOLD = (
    "import sys, pathlib; from relit.photo.alone import alone_at\n"
    "with alone_at('out', pathlib.Path(sys.argv[1])): print(flush=True); sys.stdin.read()"
)


@pytest.fixture
def holder(tmp_path):
    """A process that holds a lock, and the path of that."""
    path = tmp_path / "deep" / "folder.lock"
    streams = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE}
    with subprocess.Popen([sys.executable, "-c", HOLD, str(path)], **streams) as child:
        child.stdout.readline()
        yield child, path
        child.kill()


class TestLock:
    def test_it_says_who_is_there(self, holder):
        child, path = holder
        told = f"^out: another run is at work here \\(process {child.pid} on {socket.gethostname()}\\); wait"
        with pytest.raises(OutputError, match=told), alone_at("out", path):
            pytest.fail("two are alone")

    @pytest.mark.skipif(os.name == "nt", reason="needs SIGKILL")
    def test_it_is_free_once_its_process_was_killed_whatever_clock_and_note_say(self, holder):
        child, path = holder
        child.kill()
        child.wait(120)
        note = path.with_name("folder.lock.by")
        assert note.exists()
        for clock in (1, time.time_ns() + 10**18):
            note.write_text(f"{os.getpid()} {socket.gethostname()}")  # a number that another has by now
            os.utime(path, ns=(clock, clock))
            os.utime(note, ns=(clock, clock))
            with alone_at("out", path):
                pass
        assert not note.exists()

    @pytest.mark.parametrize("note", [b"", b"\xff\xff", b"1 a\n2 b", b"x" * 99_999, None])
    def test_a_note_that_says_nothing_is_passed_over(self, holder, note):
        _, path = holder
        by = path.with_name("folder.lock.by")
        by.unlink() if note is None else by.write_bytes(note)
        with (
            pytest.raises(OutputError, match=r"^out: another run is at work here; wait"),
            alone_at("out", path),
        ):
            pytest.fail("two are alone")

    def test_one_thread_after_another(self, tmp_path):
        for _ in range(2):
            with alone_at("out", tmp_path / "lock"):
                pass


WORD = (
    r"relit: error: out: another run is at work here( \(process \d+ on [\w.-]+\))?; "
    "wait for it, or choose another place"
)


def start(*arguments):
    words = [sys.executable, "-c", "from relit.cli import app; app.main()", "batch", *arguments]
    return subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, start_new_session=True)


@pytest.mark.slow
@pytest.mark.skipif(os.name == "nt", reason="needs process groups")
@pytest.mark.usefixtures("tree")
class TestBatches:
    @pytest.mark.parametrize("other", ["m.csv", "n.csv"])
    def test_with_journals_apart_the_second_is_refused_and_goes_on_later(self, tree, brake, run, other):
        head, *rows = (tree / "m.csv").read_text().splitlines()
        (tree / "n.csv").write_text("\n".join([head, *rows[6:]]))
        first = start("m.csv", "-o", "out", "--journal", "1.sqlite", "--jobs", "1")
        note, end = tree / "out" / ".relit" / "folder.lock.by", time.monotonic() + 300
        while not note.exists() and time.monotonic() < end:
            time.sleep(0.01)
        second = run(f"batch {other} -o out --journal 2.sqlite --jobs 1")
        assert second.code == 1
        assert f"out: another run is at work here (process {first.pid} on " in the_line(second.err)
        os.killpg(first.pid, signal.SIGKILL)
        first.communicate(timeout=120)
        brake.unlink()
        assert run("batch m.csv -o out --journal 1.sqlite --jobs 1 -q").code == 0
        assert run("batch m.csv -o whole --jobs 1 -q").code == 0
        assert results("out") == results("whole")

    def test_what_a_killed_runs_worker_still_writes_is_no_clash(self, tmp_path, monkeypatch):
        """Between the look at the place and the writing."""
        from relit.batch import places

        place, write = str(tmp_path / "x.png"), places.write_atomically

        def late(where, data, *, overwrite):
            Path(where).write_bytes(b"light")
            write(where, data, overwrite=overwrite)

        monkeypatch.setattr(places, "write_atomically", late)
        assert _write(place, b"light", replaceable=False).version == places.version_of(place)
        with pytest.raises(OutputError, match="exists already, and this batch did not write it"):
            _write(place, b"other", replaceable=False)

    def test_both_started_at_once_one_works_and_none_is_lost(self):
        children = [start("m.csv", "-o", "out", "--json", "--journal", f"{n}.sqlite") for n in range(2)]
        told = [child.communicate(timeout=600) for child in children]
        codes = sorted(child.returncode for child in children)
        # The second may have come when the first was through: then all is there already.
        assert codes[0] == 0
        for child, (out, err) in zip(children, told, strict=True):
            if child.returncode:
                # Who has the lock may not have written yet who that is.
                assert re.fullmatch(WORD, err.decode().strip()), err
            else:
                assert json.loads(out)["failed"] == 0
        assert len(results("out")) == 12


def test_threads_of_one_process_keep_out_of_one_anothers_way(tmp_path):
    inside, done, both = threading.Event(), threading.Event(), []

    def hold():
        with alone_at("out", tmp_path / "lock"):
            inside.set()
            done.wait(120)

    one = threading.Thread(target=hold)
    one.start()
    inside.wait(120)
    try:
        with alone_at("out", tmp_path / "lock"):
            both.append(1)
    except OutputError:
        pass
    done.set()
    one.join()
    assert not both


@pytest.mark.skipif(os.name == "nt", reason="needs SIGKILL")
def test_a_child_does_not_keep_the_lock(tmp_path):
    """As workers must not, or a killed run would leave its folder locked until they end."""
    code = (
        "import os, sys, pathlib, subprocess; from relit.photo.alone import alone_at\n"
        "with alone_at('out', pathlib.Path(sys.argv[1])):\n"
        "    child = subprocess.Popen([sys.executable, '-c', 'import time; time.sleep(600)'])\n"
        "    print(child.pid, flush=True); os.kill(os.getpid(), 9)\n"
    )
    path = tmp_path / "lock"
    with subprocess.Popen(
        [sys.executable, "-c", code, str(path)], stdout=subprocess.PIPE, text=True
    ) as parent:
        child = int(parent.stdout.readline())
        parent.wait(120)
        try:
            with alone_at("out", path):
                pass
        finally:
            os.kill(child, signal.SIGKILL)
