"""Nothing that a command writes takes the place of what it reads, or of what else it writes."""

import json

import pytest
from PIL import Image

from relit.face import detect
from tests.command import FACES, TRANSFER

MARKS = "--landmarks target.csv"


@pytest.fixture
def no_work(monkeypatch):
    """Whatever is refused, is refused before a face is looked for."""
    for name in ("detect_landmarks", "detect_faces"):
        monkeypatch.setattr(detect, name, lambda *_a, **_k: pytest.fail("looks for faces first"))


@pytest.mark.usefixtures("no_work")
@pytest.mark.parametrize("force", ["", "--force"])
@pytest.mark.parametrize(
    ("command", "line"),
    [
        (f"{TRANSFER} -o q.png --sheet q.png", "--sheet: expected a file of its own, got 'q.png', which -o"),
        (f"{TRANSFER} -o q.png --changed ./q.png", "--changed: expected a file of its own, got './q.png', w"),
        (f"{TRANSFER} -o q.png --sheet link/q.png", "--sheet: expected a file of its own, got 'link/q.png'"),
        (f"{TRANSFER} -o q.png --sheet s.png --changed s.png", "--changed: expected a file of its own, got"),
        (f"{TRANSFER} -o - --sheet -", "--sheet: expected a file of its own, got '-', which -o writes"),
        (
            f"{TRANSFER} -o st/ltv.png --sheet st/sheet.png --stages st",
            "--stages: expected a file of its own",
        ),
        ("landmarks target.png -o q.csv --overlay q.csv", "--overlay: expected a file of its own, got"),
    ],
)
def test_two_things_in_one_file_are_refused(place, fail, command, line, force):
    (place / "link").symlink_to(place)
    (place / "st").mkdir()
    assert fail(f"{command} {force}", code=2).startswith(line)


@pytest.mark.usefixtures("no_work")
@pytest.mark.parametrize(
    ("command", "flag", "file"),
    [
        (f"{TRANSFER} -o q.png --sheet target.png", "--sheet", "target.png"),
        (f"{TRANSFER} -o q.png --changed reference.png", "--changed", "reference.png"),
        (f"{TRANSFER} -o q.png --sheet again.png", "--sheet", "again.png"),
        (f"{TRANSFER} -o q.png --swap --sheet target.png", "--sheet", "target.png"),
        (f"{TRANSFER} -o q.png --region-mask m.png --sheet m.png", "--sheet", "m.png"),
        (f"{TRANSFER} -o q.png --config settings.png --sheet settings.png", "--sheet", "settings.png"),
        (
            f"transfer parts/target.png reference.png {FACES} -o q.png --stages parts",
            "--stages",
            "parts/t",
        ),
        (f"decompose parts/u.png {MARKS} -o parts", "-o", "parts/u.png"),
        ("landmarks target.png -o q.csv --overlay target.png", "--overlay", "target.png"),
        ("evaluate triples.csv -o triples", "-o", "triples.csv"),
        ("batch pairs.csv -o lit --results pairs.csv", "--results", "pairs.csv"),
        ("video film.mp4 reference.png -o q.mp4 --sheet reference.png", "--sheet", "reference.png"),
    ],
)
def test_an_input_is_never_written_over_by_the_way(place, fail, command, flag, file):
    (place / "parts").mkdir()
    for name in ("parts/target.png", "parts/u.png"):
        (place / name).write_bytes((place / "target.png").read_bytes())
    (place / "again.png").symlink_to("target.png")
    Image.new("L", (72, 82)).save(place / "m.png")
    (place / "settings.png").write_text(json.dumps({}))
    for name in ("triples", "pairs"):
        (place / f"{name}.csv").write_text("target,reference,truth\ntarget.png,reference.png,target.png\n")
    if command.startswith("batch"):
        (place / "pairs.csv").write_text("target,reference\ntarget.png,reference.png\n")
    line = fail(f"{command} --force", code=2)
    assert line.startswith(f"{flag}: expected a file of its own, got '{file}")
    assert "which is an input; choose another name" in line


def test_the_table_of_a_batch_is_no_row_s_landmarks(place, fail):
    (place / "pairs.csv").write_text("target,target_landmarks\ntarget.png,target.csv\n")
    line = fail("batch pairs.csv --light loop -o lit --results target.csv --force", code=2)
    assert "target.csv: the run itself writes it and row 1 reads it" in line
