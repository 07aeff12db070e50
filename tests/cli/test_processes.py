"""Commands that are interrupted, and what only a process of its own shows."""

import contextlib
import io
import os
import shlex
import signal
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from PIL import Image

from relit import figures, relighting
from relit.face import detect
from relit.methods import lit_face
from relit.photo import atomic_files as files
from tests.cli.photos import ROLES
from tests.command import FACES, TRANSFER, listing, the_line

PYTHON = [sys.executable, "-W", "error", "-c", "from relit.cli.app import main; main()"]


class TestInterruption:
    @pytest.mark.parametrize(
        ("owner", "name"),
        [
            (detect, "detect_landmarks"),
            (relighting, "lay_over"),
            (lit_face, "fit_lamps"),
            (relighting, "blend"),
            (figures, "contact_sheet"),
        ],
    )
    def test_nothing_is_written(self, place, run, monkeypatch, owner, name):
        def press_control_c(*_arguments, **_options):
            raise KeyboardInterrupt

        monkeypatch.setattr(owner, name, press_control_c)
        before = listing(place)
        faces = "" if owner is detect else FACES
        done = run(f"transfer target.png reference.png {faces} -o out.png --stages steps")
        assert (done.code, done.out, done.err.strip()) == (130, b"", "relit: interrupted")
        assert listing(place) == before

    def test_nothing_is_half_written(self, place, run, monkeypatch):
        def press_control_c(_file):
            raise KeyboardInterrupt

        monkeypatch.setattr(files.os, "fsync", press_control_c)
        (place / "out.png").write_bytes(b"old")
        before = listing(place)
        done = run(f"{TRANSFER} -o out.png --force")
        assert (done.code, done.err.strip()) == (130, "relit: interrupted")
        assert listing(place) == before

    @pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="needs named pipes")
    def test_a_real_signal(self, place):
        if signal.getsignal(signal.SIGINT) == signal.SIG_IGN:
            pytest.skip("these tests run in the background, where children ignore Ctrl-C")
        os.mkfifo(place / "slow.png")
        command = [*PYTHON[:1], *PYTHON[3:], "transfer", "slow.png", "reference.png", "-o", "out.png"]
        with (
            subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as child,
            (place / "slow.png").open("wb"),  # opens as soon as the command has opened it to read
        ):
            child.send_signal(signal.SIGINT)
            out, err = child.communicate(timeout=600)
        assert (child.returncode, out) == (130, b"")
        assert err.decode().strip() == "relit: interrupted"
        assert {path.name for path in place.iterdir()} == {
            "slow.png",
            *(f"{role}.{kind}" for role in ROLES for kind in ("png", "csv")),
        }


@pytest.mark.slow
@pytest.mark.usefixtures("place")
class TestProcess:
    """What only a process of its own shows: pipes, closed streams, and what C++ code prints."""

    @staticmethod
    def call(arguments, **streams):
        done = subprocess.run(
            [*PYTHON, *shlex.split(arguments)], stderr=subprocess.PIPE, timeout=600, check=False, **streams
        )
        return SimpleNamespace(code=done.returncode, out=done.stdout, err=done.stderr.decode())

    @contextlib.contextmanager
    def nobody_reads(self):
        reader, writer = os.pipe()
        os.close(reader)
        try:
            yield writer
        finally:
            os.close(writer)

    def test_silence(self, studio, place):
        done = self.call(
            "transfer - reference.png -o -",
            input=(place / "target.png").read_bytes(),
            stdout=subprocess.PIPE,
        )
        assert (done.code, done.err) == (0, "")
        with Image.open(io.BytesIO(done.out)) as picture:
            expected = relighting.transfer(studio.target, studio.reference).image
            np.testing.assert_array_equal(np.asarray(picture), expected)

    def test_a_photo_that_nobody_reads(self):
        with self.nobody_reads() as pipe:
            done = self.call("landmarks target.png --overlay -", stdout=pipe)
        assert done.code == 1
        assert "cannot be written" in the_line(done.err)

    def test_json_that_nobody_reads(self):
        with self.nobody_reads() as pipe:
            done = self.call("landmarks target.png --json", stdout=pipe)
        assert done.code == 1
        assert "Traceback" not in done.err
        assert "Exception" not in done.err

    @pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs /dev/full")
    def test_a_photo_on_a_full_device(self):
        with Path("/dev/full").open("wb") as full:
            done = self.call("landmarks target.png --overlay -", stdout=full)
        assert done.code == 1
        assert "No space left on device" in the_line(done.err)

    @pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs /dev/full")
    def test_json_on_a_full_device(self):
        with Path("/dev/full").open("wb") as full:
            done = self.call("landmarks target.png --json", stdout=full)
        assert done.code == 1
        assert "No space left on device" in the_line(done.err)

    @pytest.mark.skipif(os.name == "nt", reason="needs a POSIX shell")
    @pytest.mark.parametrize(
        "command", ["landmarks target.png --overlay - >&-", "landmarks - -o out.csv <&-"]
    )
    def test_closed_streams(self, command):
        script = f"exec {shlex.join(PYTHON)} {command}"
        done = subprocess.run(["sh", "-c", script], stderr=subprocess.PIPE, timeout=600, check=False)
        assert done.returncode == 1
        assert the_line(done.stderr.decode())
