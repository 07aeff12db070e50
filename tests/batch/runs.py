"""What tests of runs share: twelve rows, and what a run leaves behind, read without relit."""

import csv
import hashlib
import os
import sqlite3
from contextlib import closing, suppress
from pathlib import Path

import pytest

ROWS = 12


@pytest.fixture
def tree(place):
    """Six targets in folders, two references, and a manifest of all."""
    lines = ["target,reference,target_landmarks,reference_landmarks,strength"]
    for number in range(ROWS):
        folder = place / "in" / f"{number % 3}"
        folder.mkdir(parents=True, exist_ok=True)
        (folder / f"{number}.png").write_bytes((place / "target.png").read_bytes())
        strength = f"{(number + 1) / ROWS:.3f}"
        lines.append(f"in/{number % 3}/{number}.png,reference.png,target.csv,reference.csv,{strength}")
    (place / "m.csv").write_text("\n".join(lines))
    return place


@pytest.fixture
def brake(tree, monkeypatch):
    """A file: as long as it is there, no worker that starts gets past the photo of row 5.

    So a run is at work until a test has seen that, however late it looks.
    """
    file = tree / "brake"
    file.touch()
    (tree / "sitecustomize.py").write_text(
        "import os, sys, time\n"
        "def load(event, given):\n"
        "    if event == 'open' and str(given[0]).endswith('in/1/4.png'):\n"
        f"        while os.path.exists({str(file)!r}): time.sleep(0.02)\n"
        "sys.addaudithook(load)\n"
    )
    paths = [str(tree), *os.environ.get("PYTHONPATH", "").split(os.pathsep)]
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join(filter(None, paths)))
    return file


def table(path="out/results.csv"):
    with Path(path).open(newline="") as stream:
        return list(csv.DictReader(stream))


def results(folder):
    """Return the digests of all but what a run writes about itself."""
    own, found = {"results.csv", "run.json"}, {}
    for path in Path(folder).rglob("*"):
        if path.is_file() and path.name not in own and ".relit" not in path.parts:
            with suppress(FileNotFoundError):  # a run at work gives a temporary file its name meanwhile
                found[path.relative_to(folder).as_posix()] = hashlib.sha256(path.read_bytes()).hexdigest()
    return found


def journal(folder):
    """Return the outputs in a journal by the number of their entry, read without relit."""
    path = Path(folder, ".relit", "journal.sqlite").absolute()
    try:
        with closing(sqlite3.connect(f"file:{path}?mode=ro", uri=True)) as base:
            return dict(base.execute("SELECT rowid, CAST(output AS TEXT) FROM rows"))
    except sqlite3.OperationalError:  # there is none yet
        return {}
