"""The command line as tests run it: two small photos in a folder, and what a run gave."""

import hashlib
import io
import math
import shlex
import sys
from types import SimpleNamespace

import numpy as np
import pytest
from PIL import Image

from relit import relighting
from relit.cli import app as cli
from relit.face.detect import detect_landmarks
from relit.face.landmark_files import write_landmarks
from relit.face.landmarks import Landmarks
from relit.photo.samples import sample

FACES = "--target-landmarks target.csv --reference-landmarks reference.csv"
TRANSFER = f"transfer target.png reference.png {FACES}"


@pytest.fixture(scope="session")
def studio(tmp_path_factory):
    """Two small photos with a face each, and their landmarks; the files are read-only for tests."""
    folder = tmp_path_factory.mktemp("studio")
    for role, box, size in (
        ("target", (150, 40, 300, 210), (72, 82)),
        ("reference", (230, 130, 630, 650), (80, 104)),
    ):
        with Image.open(sample(role)) as photo:
            small = photo.convert("RGB").crop(box).resize(size)
        Image.fromarray(np.asarray(small)).save(folder / f"{role}.png")  # without its profile
    faces = SimpleNamespace(folder=folder)
    for name in ("target", "reference"):
        pixels = pixels_of(folder / f"{name}.png")
        marks = detect_landmarks(pixels, name=name)
        write_landmarks(folder / f"{name}.csv", marks)
        vars(faces)[name] = pixels
        vars(faces)[f"{name}_found"] = marks
        vars(faces)[f"{name}_landmarks"] = Landmarks(marks.points)
    return faces


@pytest.fixture(scope="session")
def plain(studio):
    """What the library makes of the two photos by default."""
    return in_library(studio)


@pytest.fixture
def place(studio, tmp_path, monkeypatch):
    """The working folder, which holds the photos and landmark files."""
    for file in studio.folder.iterdir():
        (tmp_path / file.name).write_bytes(file.read_bytes())
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def run(place, capfdbinary, monkeypatch):  # noqa: ARG001 (its working folder)
    """Run the command in this process, and return its exit code and what it wrote."""

    monkeypatch.setattr("relit.cli.progress._EVERY", math.inf)  # what a slow machine would be told

    def relit(*arguments, stdin=b""):
        words = shlex.split(arguments[0]) if len(arguments) == 1 else [str(word) for word in arguments]
        monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(stdin)))
        capfdbinary.readouterr()
        with pytest.raises(SystemExit) as stop:
            cli.main(words)
        out, err = capfdbinary.readouterr()
        return SimpleNamespace(code=stop.value.code, out=out, err=err.decode())

    return relit


@pytest.fixture
def succeed(run):
    """Run the command, which must say nothing on stderr, and return what it wrote on stdout."""

    def relit(*arguments, stdin=b""):
        done = run(*arguments, stdin=stdin)
        assert (done.code, done.err) == (0, "")
        return done.out

    return relit


@pytest.fixture
def fail(run, place):
    """Run the command, which must refuse in one clear line and leave the folder as it was."""

    def relit(*arguments, code=1, stdin=b""):
        before = listing(place)
        done = run(*arguments, stdin=stdin)
        assert done.code in np.atleast_1d(code)
        assert done.out == b""
        assert listing(place) == before
        return the_line(done.err)

    return relit


def the_line(err):
    """Return the message, which is one line."""
    lines = err.splitlines()
    assert len(lines) == 1, err
    assert lines[0].startswith("relit: error: ")
    return lines[0].removeprefix("relit: error: ")


def listing(folder):
    """Return every path below a folder, hidden ones too, with a digest of what is in it."""
    return {
        path.relative_to(folder).as_posix(): hashlib.sha256(path.read_bytes()).hexdigest()
        if path.is_file()
        else ""
        for path in folder.rglob("*")
    }


def pixels_of(path):
    with Image.open(path) as picture:
        return np.array(picture)


def in_library(studio, target=None, reference=None, **options):
    return relighting.transfer(
        studio.target if target is None else target,
        studio.reference if reference is None else reference,
        target_landmarks=studio.target_landmarks,
        reference_landmarks=studio.reference_landmarks,
        **options,
    )
