"""What tests of the cache share: pictures to keep results of, its files, processes that run code."""

import os
import subprocess
import sys
import textwrap
from pathlib import Path

import numpy as np

LARGE = 10_000_000


def counted(monkeypatch, *steps):
    """Return a list that the names of steps, each (module, name), are added to whenever they are taken."""
    made = []

    def count(module, name):
        step = getattr(module, name)
        monkeypatch.setattr(module, name, lambda *given: (made.append(name), step(*given))[1])

    for module, name in steps:
        count(module, name)
    return made


def picture(seed, shape=(16, 16)):
    return np.random.default_rng(seed).integers(0, 256, shape).astype(np.uint8)


def entries(folder):
    return sorted(folder.rglob("*.npz"))


def held(folder):
    return sum(path.stat().st_size for path in entries(folder))


def equal(one, other):
    assert type(one) is type(other)
    for name, part in vars(one).items():
        there = getattr(other, name)
        assert type(part) is type(there), name
        if isinstance(part, np.ndarray):
            assert (part.dtype, part.flags.writeable) == (there.dtype, there.flags.writeable), name
        np.testing.assert_array_equal(part, there)


def python(code):
    here = Path(__file__).parents[2]
    paths = os.pathsep.join([str(here), str(here / "src"), os.environ.get("PYTHONPATH", "")])
    return subprocess.Popen(
        [sys.executable, "-c", textwrap.dedent(code)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, "PYTHONPATH": paths},
    )


def in_python(code):
    process = python(code)
    told, errors = process.communicate(timeout=600)
    assert process.returncode == 0, errors
    return told, errors
