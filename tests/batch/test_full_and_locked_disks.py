"""Disks that are full and folders that cannot be written: one clear line, and nothing half done."""

import os
import shutil
import subprocess
import sys
from contextlib import contextmanager
from pathlib import Path

import pytest
from PIL import Image

import relit

SOURCE = Path(relit.__file__).parents[1]
#: root may write anywhere, unless it gives that up; it is how these tests run in containers.
UNPRIVILEGED = ["setpriv", "--bounding-set=-dac_override,-dac_read_search,-fowner,-chown"]

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not sys.platform.startswith("linux"), reason="tmpfs and setpriv are of Linux"),
]


def relit_in(folder, *arguments, source=SOURCE, limit="", **environment):
    """Run the command in a folder as somebody who may not write everywhere."""
    if os.getuid() == 0 and shutil.which("setpriv") is None:
        pytest.skip("root may write everywhere, and there is no setpriv to take that away")
    rights = UNPRIVILEGED if os.getuid() == 0 else []
    kept = {
        name: value for name, value in os.environ.items() if name not in ("NUMBA_CACHE_DIR", "XDG_CACHE_HOME")
    }
    kept |= {"PYTHONPATH": str(source), "PYTHONDONTWRITEBYTECODE": "1"} | environment
    command = [sys.executable, "-c", "from relit.cli import app; app.main()", *map(str, arguments)]
    if limit:
        command = ["sh", "-c", f'{limit}; exec "$@"', "sh", *command]
    done = subprocess.run(
        [*rights, *command],
        cwd=folder,
        env={name: value for name, value in kept.items() if value is not None},
        capture_output=True,
        text=True,
        check=False,
        timeout=1200,
    )
    return done.returncode, done.stdout, done.stderr


def lines_of(err):
    """Return what a run said, but for how far it is, which a slow machine is told."""
    return [line for line in err.splitlines() if " rows, " not in line]


@contextmanager
def locked(*folders):
    """Take the right to write from folders, and give it back."""
    for folder in folders:
        folder.chmod(0o500)
    try:
        yield
    finally:
        for folder in folders:
            folder.chmod(0o700)


@pytest.fixture
def small_disk(tmp_path):
    """Return what makes a disk of so many kB."""
    mounted = []

    def make(size):
        folder = tmp_path / "disk"
        folder.mkdir()
        done = subprocess.run(
            ["mount", "-t", "tmpfs", "-o", f"size={size}k", "tmpfs", str(folder)],
            capture_output=True,
            check=False,
        )
        if done.returncode:
            pytest.skip("only root may make a small disk")
        mounted.append(folder)
        return folder

    yield make
    for folder in mounted:
        subprocess.run(["umount", "-l", str(folder)], check=True)


class TestLocked:
    @pytest.mark.rotating
    @pytest.mark.parametrize("home", ["read-only", "nowhere", None])
    def test_a_home_and_a_package_that_cannot_be_written_go_unmentioned(self, place, home):
        """The solver is compiled, which cannot be kept anywhere, and works all the same."""
        (place / "home").mkdir()
        (place / "out").mkdir()
        (place / "here").mkdir()
        shutil.copytree(
            SOURCE / "relit", place / "src" / "relit", ignore=shutil.ignore_patterns("__pycache__")
        )
        where = {"read-only": str(place / "home"), "nowhere": "/nonexistent", None: None}[home]
        folders = [path for path in (place / "src").rglob("*") if path.is_dir()]
        with locked(place / "home", place / "here", *folders):
            done = relit_in(
                place / "here",
                *("transfer", place / "target.png", "--light", "loop", "--method", "ltv"),
                *("--target-landmarks", place / "target.csv", "-o", place / "out" / "a.png"),
                source=place / "src",
                HOME=where,
                XDG_CACHE_HOME=where and str(place / "home"),
            )
        assert done == (0, "", "")
        Image.open(place / "out" / "a.png").verify()
        assert not list((place / "here").iterdir())

    def test_a_folder_that_cannot_be_written_is_one_line(self, place):
        (place / "here").mkdir()
        with locked(place / "here"):
            for words in (
                ("batch", "--do", "landmarks", "--targets", place / "target.png", "-o", "out"),
                ("landmarks", place / "target.png", "-o", "a.csv"),
            ):
                code, out, err = relit_in(place / "here", *words)
                assert (code, out, len(lines_of(err))) == (1, "", 1), err
                assert err.startswith("relit: error: ")
                assert "cannot be written (Permission denied)" in err


class TestFull:
    def test_a_disk_that_is_full_leaves_nothing_half(self, place, small_disk, run):
        disk = small_disk(400)
        (place / "in").mkdir()
        for number in range(30):
            shutil.copy(place / "target.png", place / "in" / f"{number}.png")
        words = (
            "batch",
            "--do",
            "normalize",
            "--targets",
            "in",
            "--format",
            "tif",
            "--jobs",
            "1",
            "--cache-size",
            "0",
        )
        code, out, err = relit_in(place, *words, "-o", disk / "out")
        assert (code, out) == (1, "")
        lines = lines_of(err)
        assert len(lines) == 1
        assert lines[0].startswith("relit: ")
        for path in (disk / "out").rglob("*.tif"):
            Image.open(path).load()
        assert not list((disk / "out").rglob("*.tmp"))
        subprocess.run(["mount", "-o", "remount,size=20m", str(disk)], check=True)
        again = run(*words, "-o", disk / "out")
        assert (again.code, again.err) == (0, "")
        assert len(list((disk / "out").rglob("*.tif"))) == 30

    def test_a_cache_that_is_full_is_one_line_of_each_worker(self, place, small_disk):
        disk = small_disk(60)
        words = ("batch", "--do", "landmarks", "--targets", "target.png", "--jobs", "1", "-o", "out")
        disk.joinpath("filler").write_bytes(bytes(30_000))
        code, out, err = relit_in(place, *words, "--journal", disk / "journal.sqlite")
        lines = lines_of(err)
        assert out == ""
        assert lines
        assert all(line.startswith("relit: ") for line in lines)
        assert len(lines) <= 2
        assert code == 1 or (place / "out" / "target.json").exists()

    def test_a_file_that_may_not_grow(self, place):
        """RLIMIT_FSIZE, as of a quota: the signal it sends is no crash of ours."""
        code, out, err = relit_in(
            place, "transfer", "target.png", "--light", "loop", "-o", "a.tif", limit="ulimit -f 4"
        )
        assert (code, out, err.count("\n")) == (1, "", 1), err
        assert "a.tif: cannot be written (File too large)" in err
        assert not list(place.glob("*.tif"))
        assert not list(place.glob(".relit*"))
