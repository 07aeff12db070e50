"""Commands that are stopped half-way, by a signal or a full disk, leave whole files or none."""

import json
import os
import shlex
import signal
import subprocess
import sys
import time

import pytest
from PIL import Image

from relit.face.detect import detect_landmarks
from relit.face.landmark_files import write_landmarks
from relit.photo.reading import read_image
from relit.photo.samples import sample

resource = pytest.importorskip("resource", reason="needs the limits and signals of POSIX")
pytestmark = pytest.mark.slow  # every test starts a process

MARKS = "--target-landmarks good.csv --reference-landmarks good.csv"
TRANSFER = f"transfer good.png good.png {MARKS} -o out.png"
#: Tell the parent when a function is reached, and stay in it.
HALT = """
import signal, sys, time
signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell's background jobs ignore it
import {module} as owner
def halt(*_arguments, **_options):
    print("there", flush=True)
    time.sleep(600)
owner.{function} = halt
from relit.cli.app import main
main(sys.argv[1:])
"""
#: No file may grow beyond so many bytes, as on a disk that is full.
FULL = """
import resource, sys
resource.setrlimit(resource.RLIMIT_FSIZE, ({size}, {size}))
from relit.cli.app import main
main(sys.argv[1:])
"""


@pytest.fixture(scope="module")
def studio(tmp_path_factory):
    """A photo with a face and its landmarks."""
    folder = tmp_path_factory.mktemp("studio")
    with Image.open(sample("reference")) as photo:
        photo.convert("RGB").crop((230, 130, 630, 650)).resize((80, 104)).save(folder / "good.png")
    write_landmarks(folder / "good.csv", detect_landmarks(read_image(folder / "good.png").pixels))
    (folder / "cases.csv").write_text("target,reference,truth\ngood.png,good.png,good.png\n")
    return folder


@pytest.fixture
def place(studio, tmp_path):
    """A folder of one's own with the same files."""
    for file in studio.iterdir():
        (tmp_path / file.name).write_bytes(file.read_bytes())
    return tmp_path


def names(folder):
    return {path.relative_to(folder).as_posix() for path in folder.rglob("*")}


def start(code, command, place, **options):
    words = [sys.executable, "-c", code, *shlex.split(command)]
    return subprocess.Popen(words, cwd=place, stdout=subprocess.PIPE, stderr=subprocess.PIPE, **options)


MOMENTS = {
    "reading": ("relit.cli.sources", "read_image"),
    "finding the face": ("relit.inputs", "check_pair"),
    "solving": ("relit.methods.shading", "stand_in"),
    "encoding": ("relit.photo.writing", "save"),
    "writing": ("os", "fsync"),
    "naming": ("pathlib", "Path.hardlink_to"),
}


class TestSignals:
    @pytest.mark.parametrize("moment", MOMENTS)
    @pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
    @pytest.mark.rotating
    def test_at_a_moment(self, place, moment, number):
        module, function = MOMENTS[moment]
        before = names(place)
        with start(HALT.format(module=module, function=function), TRANSFER, place) as child:
            assert child.stdout.readline() == b"there\n"
            child.send_signal(number)
            _, err = child.communicate(timeout=600)
        left = names(place) - before
        if number == signal.SIGINT:
            assert (child.returncode, err.decode().strip()) == (130, "relit: interrupted")
            assert not left
        else:  # nobody can tidy up, but what is left has no photo's name
            assert child.returncode == -signal.SIGTERM
            assert all(name.startswith(".relit-") and name.endswith(".tmp") for name in left)

    @pytest.mark.parametrize("delay", [0.0, 0.2, 0.5, 1.0, 1.5])
    def test_at_any_time(self, place, delay):
        """Whatever it is doing, with no function stopped: a whole photo or none."""
        code = HALT.format(module="types", function="halted")
        before = names(place)
        with start(code, TRANSFER, place) as child:
            time.sleep(delay)
            child.send_signal(signal.SIGINT)
            child.communicate(timeout=600)
        left = names(place) - before
        assert left <= {"out.png"}
        if left:
            with Image.open(place / "out.png") as picture:
                picture.load()


class TestFullDisk:
    @pytest.mark.parametrize(
        ("command", "size", "left"),
        [
            (TRANSFER, 1000, set()),
            (f"{TRANSFER} --force", 1000, set()),
            ("landmarks good.png -o out.json", 1000, set()),
            ("landmarks good.png --overlay out.jpg", 1000, set()),
            ("decompose good.png -o out.png", 1000, set()),
            ("samples out", 1000, {"out"}),
            (f"transfer good.png good.png {MARKS} -o out.png --stages steps", 1000, set()),
            ("evaluate cases.csv -o out --jobs 1", 100, set()),
            ("evaluate cases.csv --figure out.png --jobs 1", 1000, set()),
        ],
    )
    @pytest.mark.rotating
    def test_our_error_and_no_file(self, place, command, size, left):
        before = names(place)
        with start(FULL.format(size=size), command, place) as child:
            out, err = child.communicate(timeout=600)
        assert (child.returncode, out) == (1, b"")
        assert err.decode().startswith("relit: error: ")
        assert "File too large" in err.decode()
        assert err.count(b"\n") == 1
        assert names(place) - before <= left

    def test_a_later_picture_does_not_fit(self, place):
        """What fitted is whole, and the one that did not has left nothing."""
        command = f"transfer good.png good.png {MARKS} -o out.jpg --stages steps"
        with start(FULL.format(size=100_000), command, place) as child:
            _, err = child.communicate(timeout=600)
        assert child.returncode == 1
        assert "File too large" in err.decode()
        written = [path for path in place.rglob("*") if path.suffix in (".png", ".jpg")]
        assert len(written) > 2
        for path in written:
            with Image.open(path) as picture:
                picture.load()
        assert not [name for name in names(place) if name.endswith(".tmp")]

    @pytest.mark.rotating
    def test_what_is_compiled_has_no_place(self, place):
        """The cache of compiled functions is a convenience: without it, the transfer takes longer."""
        environment = {**os.environ, "NUMBA_CACHE_DIR": str(place / "cache")}
        method = "--method ltv --neighborhood isotropic"
        command = f"transfer good.png good.png {MARKS} {method} -o out.jpg --json"
        with start(FULL.format(size=20_000), command, place, env=environment) as child:
            out, err = child.communicate(timeout=600)
        assert (child.returncode, err) == (0, b"")
        assert json.loads(out)["output"] == "out.jpg"
