"""What is uploaded: the wheel holds what git has of `src`, the sdist all that a developer needs."""

import subprocess
import sys
import tarfile
import zipfile
from email import message_from_bytes
from pathlib import Path

import pytest

from relit._version import VERSION

ROOT = Path(__file__).parents[1]
ABOUT = f"relit-{VERSION}.dist-info/"
pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def tracked():
    """What git has, or would take, of this checkout."""
    if not (ROOT / ".git").exists():
        pytest.skip("no git here that could tell which files there are")
    command = ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"]
    names = subprocess.check_output(command, cwd=ROOT, text=True).split("\0")
    return {name for name in names if (ROOT / name).is_file()}


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    """The folder with a wheel and an sdist, made here: `check.py --release` makes them in isolation."""
    folder = tmp_path_factory.mktemp("dist")
    for kind in ("wheel", "sdist"):
        command = [sys.executable, "-m", "hatchling", "build", "-t", kind, "-d", str(folder)]
        subprocess.run(command, cwd=ROOT, check=True, capture_output=True)
    return folder


@pytest.fixture(scope="module")
def wheel(built):
    with zipfile.ZipFile(built / f"relit-{VERSION}-py3-none-any.whl") as archive:
        yield archive


@pytest.fixture(scope="module")
def metadata(wheel):
    return message_from_bytes(wheel.read(f"{ABOUT}METADATA"))


def test_the_wheel_holds_what_git_has_of_src(wheel, tracked):
    shipped = {name for name in wheel.namelist() if not name.startswith(ABOUT)}
    assert shipped == {name.removeprefix("src/") for name in tracked if name.startswith("src/")}
    kinds = {".tflite", ".npz", ".png", ".jpg", ".js", ".css", ".html", ".typed"}
    assert {Path(name).suffix for name in shipped} > kinds
    for name in shipped:
        assert wheel.read(name) == (ROOT / "src" / name).read_bytes()


def test_the_wheel_holds_the_licences_of_all_that_ships(wheel, metadata, tracked):
    texts = [name for name in tracked if Path(name).name in {"LICENSE", "NOTICE"}]
    needed = [name for name in texts if name == "LICENSE" or name.startswith("src/")]
    listed = metadata.get_all("License-File")
    assert sorted(listed) == sorted([*needed, "src/relit/photo/sample_photos/README.md"])
    for name in listed:
        assert wheel.read(f"{ABOUT}licenses/{name}") == (ROOT / name).read_bytes()


def test_the_sdist_holds_all_but_what_ci_runs(built, tracked):
    with tarfile.open(built / f"relit-{VERSION}.tar.gz") as archive:
        names = {member.name.removeprefix(f"relit-{VERSION}/") for member in archive if member.isfile()}
    assert names == {name for name in tracked if not name.startswith(".ci/")} | {"PKG-INFO"}


def test_the_metadata(metadata):
    assert metadata["Version"] == VERSION
    assert metadata["License-Expression"] == "MIT AND Apache-2.0 AND CC0-1.0"
    assert metadata["Description-Content-Type"] == "text/markdown"
    assert not [line for line in metadata.get_all("Classifier") if line.startswith("License ::")]  # PEP 639


@pytest.mark.filterwarnings("default")  # of twine's own libraries
def test_twine_finds_nothing(built):
    command = [sys.executable, "-m", "twine", "check", "--strict", *map(str, built.iterdir())]
    done = subprocess.run(command, capture_output=True, text=True)
    assert (done.returncode, done.stdout.count("PASSED")) == (0, 2), done.stdout
