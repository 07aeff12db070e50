"""What is said of a job: nothing, one line on a terminal, or all."""

import re
from contextlib import nullcontext

import pytest

from relit.cli import telling
from relit.cli.app import relit
from tests.command import FACES, TRANSFER

LOUD = [name for name, command in relit.commands.items() if any(p.name == "quiet" for p in command.params)]
MARKS = "--target-landmarks target.csv"
JOBS = {
    f"{TRANSFER} -o out.png": r"wrote out\.png: the face of target\.png under the light of reference\.png S",
    f"transfer target.png --light loop {MARKS} -o out.png --sheet s.png --changed c.png --stages st": (
        r"wrote out\.png and s\.png and c\.png and \d+ files in st: the face of target\.png under "
        r"the light loop S"
    ),
    f"align target.png reference.png {FACES} -o out.png": (
        r"wrote out\.png: reference\.png, its face laid over that of target\.png"
    ),
    "landmarks target.png -o out.csv": r"wrote out\.csv: the 478 landmarks of target\.png",
    "decompose target.png --landmarks target.csv -o parts": (
        r"wrote u\.png and v\.png in parts: the light \(u\) and the person \(v\) of target\.png"
    ),
    "normalize target.png --landmarks target.csv -o n.png": r"wrote n\.png: target\.png without its light",
}
SECONDS = r"\(\d+\.\d s\)"


@pytest.fixture
def watched(monkeypatch):
    """Somebody looks at stderr, which draws no progress here."""
    monkeypatch.setattr(telling, "is_watched", lambda: not telling.is_quiet())
    monkeypatch.setattr("rich.console.Console.status", lambda *_: nullcontext())


def test_every_command_that_does_a_job_can_be_quiet():
    assert set(relit.commands) - set(LOUD) == {"studio", "serve"}


@pytest.mark.usefixtures("watched")
@pytest.mark.parametrize("job", JOBS)
def test_a_terminal_is_told_in_one_line(run, job):
    done = run(job)
    assert done.code == 0
    (line,) = done.err.splitlines()
    assert re.fullmatch(JOBS[job].replace(" S", f" {SECONDS}"), line)


@pytest.mark.usefixtures("watched")
def test_samples_tell_what_to_do_next(place, run):
    line = run("samples photos").err.rstrip()
    assert line.startswith("wrote 4 files in photos: ")
    assert run(line.partition("next: relit ")[2]).code == 0
    assert (place / "relit.png").exists()


@pytest.mark.usefixtures("watched")
@pytest.mark.parametrize("job", [*JOBS, "samples photos"])
def test_quiet_says_nothing(succeed, job):
    assert succeed(f"{job} --quiet") == b""


def test_quiet_leaves_out_warnings_and_tells_failures(place, run, fail, monkeypatch):
    del place
    loud = run(f"transfer target.png reference.png {FACES} -o a.png -v")
    monkeypatch.setattr(telling, "_UNSURE", 2.0)
    assert "is a guess" in run(f"{TRANSFER} -o b.png").err
    assert run(f"{TRANSFER} -o c.png -q").err == ""
    assert "exists already" in fail(f"{TRANSFER} -o a.png -q")
    assert loud.code == 0


def test_verbose_tells_what_was_found_and_how_long_it_took(studio, run):
    done = run("transfer target.png reference.png -o out.png --verbose")
    assert done.out == b""
    lines = done.err.splitlines()
    for role in ("target", "reference"):
        height, width = vars(studio)[role].shape[:2]
        found = vars(studio)[f"{role}_found"]
        eyes = f"{found.interocular_distance:.0f}"
        sure = f"{found.confidence:.2f}"
        assert (
            f"{role}.png: {width}x{height} px, face found (confidence {sure}), eyes {eyes} px apart" in lines
        )
    assert any(re.fullmatch(r"relight +\d+\.\d\d s", line) for line in lines)
    assert lines[-1].startswith("wrote out.png: ")


def test_loudness_changes_no_byte(place, run):
    pictures = []
    for flag in ("", "-q", "-v"):
        assert run(f"{TRANSFER} -o out{flag}.png {flag}").code == 0
        pictures.append((place / f"out{flag}.png").read_bytes())
    assert pictures[0] == pictures[1] == pictures[2]
