"""The Dockerfile: what it promises; and its entry point and health check, run without a container."""

import json
import os
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from relit.cli.serve import serve

ROOT = Path(__file__).parents[1]
TEXT = (ROOT / "Dockerfile").read_text("utf-8").replace("\\\n", "")
STEPS = [line.split(maxsplit=1) for line in TEXT.splitlines() if line and not line.startswith("#")]
LAST = STEPS[[word for word, _ in STEPS].index("FROM", 2) :]
PAGE = (ROOT / "docs/docker.md").read_text("utf-8")
PATH = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
PORT = next(option.default for option in serve.params if option.name == "port")


def last(word):
    """What the last stage says of this, which it says once."""
    (rest,) = [rest for first, rest in LAST if first == word]
    return rest


def command(word):
    return json.loads(last(word).partition("[")[1] + last(word).partition("[")[2])


def test_hadolint_finds_nothing():
    linter = shutil.which("hadolint", path=PATH)
    if not linter:
        pytest.skip("hadolint is not installed here")
    done = subprocess.run([linter, ROOT / "Dockerfile"], capture_output=True, text=True)
    assert (done.returncode, done.stdout) == (0, "")


def test_whoever_gets_in_is_nobody():
    assert int(last("USER").split(":")[0]) > 999


def test_it_is_where_relit_serves():
    assert int(last("EXPOSE")) == PORT
    assert f", {PORT}, " in command("HEALTHCHECK")[-1]


def test_all_that_is_written_is_in_the_one_folder_that_may_be():
    told = dict(pair.split("=") for pair in shlex.split(last("ENV")))
    assert {told["HOME"], str(Path(told["NUMBA_CACHE_DIR"]).parent)} == {"/tmp"}
    assert "--read-only --tmpfs /tmp" in PAGE


def test_the_build_gets_what_it_copies_and_no_more():
    own = [rest.split()[:-1] for word, rest in STEPS if word == "COPY" and "--from" not in rest]
    copied = [name for names in own for name in names]
    lines = (ROOT / ".dockerignore").read_text("utf-8").splitlines()
    assert sorted(copied) == sorted(line[1:] for line in lines if line.startswith("!"))
    assert lines[0] == "*"
    assert all((ROOT / name).exists() for name in copied)


def test_only_the_studio_comes_along():
    assert re.findall(r'"\.\[(.+?)\]"', TEXT) == ["studio"]


@pytest.fixture
def start(tmp_path):
    """Start the entry point, with a token or none, as this machine's own."""
    if not shutil.which("sh"):
        pytest.skip("no sh here")
    entry, begun = command("ENTRYPOINT"), []

    def begin(token):
        environment = {**os.environ, "PATH": PATH, "HOME": str(tmp_path), "RELIT_TOKEN": token}
        more = ["--host", "127.0.0.1", "--port", "0"]
        begun.append(subprocess.Popen([*entry, *more], env=environment, stderr=subprocess.PIPE, text=True))
        return begun[-1]

    yield begin
    for process in begun:
        process.kill()
        process.communicate()


def test_without_a_token_it_does_not_start(start):
    process = start("")
    said = process.communicate(timeout=300)[1]
    assert process.returncode == 2
    assert said.count("\n") == 1
    assert "RELIT_TOKEN: is not set" in said


@pytest.mark.slow
def test_health_is_told_from_its_loss(start):
    process = start("correct-horse-battery")
    port = int(re.search(r"http://127\.0\.0\.1:(\d+)/", process.stderr.readline())[1])
    _python, option, code = command("HEALTHCHECK")
    check = [sys.executable, option, code.replace(f", {PORT}, ", f", {port}, ")]
    assert subprocess.run(check).returncode == 0
    process.terminate()  # exec: it is relit that gets this
    process.wait(timeout=120)
    assert subprocess.run(check, capture_output=True).returncode == 1
