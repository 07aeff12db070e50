"""``relit batch`` in real processes, which are killed, stopped and started again."""

# ruff: noqa: F811 (fixtures of another module)

import json
import os
import random
import signal
import subprocess
import sys
import time
from contextlib import suppress

import pytest
from PIL import Image

from tests.batch.runs import ROWS, brake, journal, results, table, tree  # noqa: F401 (two are fixtures)
from tests.command import the_line

COMMAND = [sys.executable, "-c", "from relit.cli.app import main; main()", "batch"]


def start(*arguments):
    """Start a run in a process group of its own, as a shell does."""
    return subprocess.Popen(
        [*COMMAND, *arguments],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        start_new_session=True,
    )


def finish(child):
    """Return the exit code of a run, and what it wrote."""
    out, err = child.communicate(timeout=600)
    told = [line for line in err.splitlines(keepends=True) if b" rows, " not in line]  # of a slow machine
    return child.returncode, out, b"".join(told)


def wait_for(condition, child, patience=300):
    end = time.monotonic() + patience
    while not condition():
        if child.poll() is not None or time.monotonic() > end:
            return
        time.sleep(0.01)


@pytest.mark.slow
@pytest.mark.skipif(os.name == "nt", reason="needs process groups")
@pytest.mark.usefixtures("tree")
class TestProcesses:
    @pytest.mark.rotating
    @pytest.mark.slow
    def test_killed_twenty_times_it_ends_as_if_it_never_was(self, tree):
        head, *rows = (tree / "m.csv").read_text().splitlines()
        many = [f"{row},{turn}/{n}.png" for turn in "abcdefgh" for n, row in enumerate(rows)]
        (tree / "m.csv").write_text("\n".join([f"{head},output", *many]))
        assert finish(start("m.csv", "-o", "whole", "--jobs", "2")) == (0, b"", b"")
        dice = random.Random(8)
        kills = before_the_end = 0
        while kills < 20:
            child, before = start("m.csv", "-o", "out", "--jobs", "2"), len(journal("out"))
            if dice.random() < 0.7:
                more = before + dice.randrange(3)
                wait_for(lambda: len(results("out")) > more, child)  # noqa: B023
                time.sleep(dice.random() * 0.05)
            else:  # somewhere on the way to the first row
                time.sleep(dice.random() * 2)
            with suppress(ProcessLookupError):  # it may have come to its end by itself
                os.killpg(child.pid, signal.SIGKILL)
            child.communicate(timeout=120)
            kills += 1
            whole_files = {name for name in results("out") if not name.endswith(".tmp")}
            recorded = set(journal("out").values())
            assert len(whole_files - recorded) <= 4  # two of each worker
            before_the_end += len(whole_files | recorded) < len(many)
        assert before_the_end > 10
        assert finish(start("m.csv", "-o", "out", "--jobs", "2")) == (0, b"", b"")
        assert results("out") == results("whole")
        assert sorted(journal("out").values()) == sorted(journal("whole").values())
        assert sorted(journal("out")) == list(range(1, len(many) + 1))  # none was recorded twice
        timings = {name for name in table()[0] if name.startswith("seconds")}
        for one, other in zip(table("out/results.csv"), table("whole/results.csv"), strict=True):
            assert all(one[name] == other[name] for name in one if name not in timings)
        code, out, _ = finish(start("m.csv", "-o", "out", "--json"))
        assert (code, json.loads(out)["kept"]) == (0, len(many))

    @pytest.mark.rotating
    def test_a_store_that_all_processes_see(self, tree):
        """fsspec's own ``local://``, which is asked as any other store is."""
        there = f"local://{tree}"
        given = (f"{there}/m.csv", "-o", f"{there}/out", "--journal", "j.sqlite", "--jobs", "2", "--json")
        code, out, _ = finish(start(*given))
        assert (code, json.loads(out)["ok"]) == (0, ROWS)
        assert finish(start("m.csv", "-o", "here", "--jobs", "2")) == (0, b"", b"")
        assert results("out") == results("here")
        code, out, _ = finish(start(*given))
        assert (code, json.loads(out)["kept"]) == (0, ROWS)

    @pytest.mark.rotating
    @pytest.mark.slow
    def test_on_dask_nothing_is_lost_with_a_worker(self, tree, brake):
        pytest.importorskip("distributed")
        psutil = pytest.importorskip("psutil")
        head, *rows = (tree / "m.csv").read_text().splitlines()
        many = [f"{row},{turn}/{n}.png" for turn in "abcd" for n, row in enumerate(rows)]
        (tree / "m.csv").write_text("\n".join([f"{head},output", *many]))
        child = start("m.csv", "-o", "out", "--jobs", "2", "--engine", "dask")
        wait_for(lambda: journal("out"), child)
        workers = [
            process
            for process in psutil.Process(child.pid).children(recursive=True)
            if "spawn_main" in " ".join(process.cmdline())
        ]
        workers[0].kill()
        brake.unlink()
        assert finish(child) == (0, b"", b"")
        assert finish(start("m.csv", "-o", "whole", "--jobs", "2")) == (0, b"", b"")
        assert results("out") == results("whole")
        assert sorted(journal("out")) == list(range(1, len(many) + 1))

    @pytest.mark.parametrize("sent", [signal.SIGINT, signal.SIGTERM])
    def test_stopped_it_leaves_nothing_half_and_goes_on(self, tree, brake, sent):
        if signal.getsignal(signal.SIGINT) == signal.SIG_IGN:
            pytest.skip("these tests run in the background, where children ignore Ctrl-C")
        child = start("m.csv", "-o", "out", "--jobs", "2")
        wait_for(lambda: journal("out"), child)
        os.killpg(child.pid, sent) if sent == signal.SIGINT else child.send_signal(sent)
        code, out, err = finish(child)
        assert (code, out) == (130, b"")
        assert [line for line in err.decode().splitlines() if line] == [
            "relit: the same command goes on from here",
            "relit: interrupted",
        ]
        for name in results("out"):
            Image.open(tree / "out" / name).verify()
        brake.unlink()
        report = json.loads(finish(start("m.csv", "-o", "out", "--json"))[1])
        assert report["kept"] >= 1
        assert report["kept"] + report["ok"] == ROWS
        assert not list((tree / "out").rglob("*.tmp"))

    @pytest.mark.usefixtures("brake")
    def test_two_at_once_are_refused(self, run):
        child = start("m.csv", "-o", "out", "--jobs", "1")
        try:
            wait_for(lambda: journal("out"), child)
            done = run("batch m.csv -o out")
        finally:
            os.killpg(child.pid, signal.SIGKILL)
            child.communicate(timeout=120)
        assert done.code == 1
        assert "out/.relit/journal.sqlite: another run is at work here" in the_line(done.err)

    @pytest.mark.rotating
    def test_a_row_that_kills_its_worker(self, tree, monkeypatch):
        # A photo that crashes a decoder: the worker's own way to read files ends it.
        (tree / "sitecustomize.py").write_text(
            "import os\n"
            "def load(event, given):\n"
            "    if event == 'open' and str(given[0]).endswith('in/1/4.png'): os.kill(os.getpid(), 9)\n"
            "import sys; sys.addaudithook(load)\n"
        )
        paths = [str(tree), *os.environ.get("PYTHONPATH", "").split(os.pathsep)]
        monkeypatch.setenv("PYTHONPATH", os.pathsep.join(filter(None, paths)))
        code, out, err = finish(start("m.csv", "-o", "out", "--jobs", "2"))
        assert (code, out) == (1, b"")
        assert err.decode().splitlines()[-1] == f"relit: 1 of {ROWS} rows failed; out/results.csv says why"
        failed = [row for row in table() if row["status"] == "failed"]
        assert [(row["row"], row["reason"][:15]) for row in failed] == [("5", "the worker died")]
        assert len(results("out")) == ROWS - 1
