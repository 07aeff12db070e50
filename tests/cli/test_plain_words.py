"""Whatever is wrong is told by file and flag, in words that need no Python."""

import json
import re
from dataclasses import fields

import numpy as np
import pytest
import tifffile
from PIL import Image

from relit.cli.wording import in_flags
from relit.face.landmark_files import write_landmarks
from relit.face.landmarks import Landmarks
from relit.settings.options import TransferOptions
from tests.command import FACES, TRANSFER

# Names of types, values, exceptions and arguments; a pair of numbers in brackets that is no position.
PYTHON = re.compile(
    r"\b(None|True|False|float|int|str|bool|bytes|tuple|list|dict|array|dtype|u?int\d+|float\d+|complex\d+"
    r"|\w+Error|Errno|Traceback|overwrite|max_pixels|lam|[a-z]+_landmarks|region_mask|second_reference"
    r"|color_space|full_resolution|split_first|interocular_distance)\b|\w=\w|\w=$|=\.\.\.|shape|<\w+|\(\d+,"
)
# Values of an option that are spelt so, and what keys of settings and columns of tables are called.
SPELT, KEYS = {"thin_plate_spline"}, {field.name for field in fields(TransferOptions)}
KEYS |= {"target_landmarks", "reference_landmarks"}

WRONG = [
    "transfer",
    "transfer missing.png reference.png -o out.png",
    "transfer folder reference.png -o out.png",
    "transfer noise.png reference.png -o out.png",
    "transfer target.png noise.png -o out.png",
    "transfer noise.png --light loop --all-faces -o out.png",
    "transfer bomb.png reference.png -o out.png",
    "transfer complex.tif reference.png -o out.png",
    "transfer half.tif reference.png -o out.png",
    "transfer - reference.png -o out.png",
    "transfer target.png reference.png --face 9 -o out.png",
    "transfer target.png reference.png --target-landmarks two.ljson -o out.png",
    "transfer target.png reference.png --reference-landmarks two.ljson -o out.png",
    "transfer target.png reference.png --target-landmarks far.csv -o out.png",
    "transfer target.png reference.png --target-landmarks few.csv -o out.png",
    "transfer target.png reference.png --target-landmarks holes.csv -o out.png",
    "transfer target.png reference.png --target-landmarks other.pts -o out.png",
    "transfer target.png reference.png --target-landmarks text.jpg -o out.png",
    "transfer target.png reference.png --target-landmarks text.json -o out.png",
    "landmarks two.png --face 7 -o out.csv",
    "landmarks target.png -o out.txt",
    f"{TRANSFER} -o target.png",
    f"{TRANSFER} -o out.gif",
    f"{TRANSFER} -o out.png --stages target.png",
    f"{TRANSFER} -o out.png --region-mask small.png",
    f"{TRANSFER} -o out.png --region-mask colours.png",
    f"{TRANSFER} -o out.png --second-reference target.png",
    f"{TRANSFER} -o out.png --method quotient",
    f"{TRANSFER} -o out.png --lambda 0",
    f"{TRANSFER} -o out.png --lambda few",
    f"{TRANSFER} -o out.png --smoothing much",
    f"{TRANSFER} -o out.png --smoothing -1",
    f"{TRANSFER} -o out.png --turn left",
    f"{TRANSFER} -o out.png --turn 400",
    f"{TRANSFER} -o out.png --strength 500%",
    f"{TRANSFER} -o out.png --strength %",
    f"{TRANSFER} -o out.png --softness 2",
    f"{TRANSFER} -o out.png --tint nan",
    f"{TRANSFER} -o out.png --exposure 9",
    f"{TRANSFER} -o out.png --region hat",
    f"{TRANSFER} -o out.png --channels v",
    f"{TRANSFER} -o out.png --color-space hsv --channels h",
    f"{TRANSFER} -o out.png --kernel cone",
    f"{TRANSFER} -o out.png --neighborhood 5",
    f"{TRANSFER} -o out.png --face one",
    f"{TRANSFER} -o out.png --face -1",
    f"{TRANSFER} -o out.png --config text.json",
    f"{TRANSFER} -o out.png --config null.json",
    "transfer target.png reference.png -o out.png --config far.json",
    "transfer target.png --light sun -o out.png",
    "transfer target.png --light 10,100 -o out.png",
    "transfer target.png reference.png --light loop",
    f"align target.png reference.png {FACES} -o target.png",
    "decompose target.png -o parts --eye-distance wide",
    "decompose target.png -o parts --eye-distance -1",
    "normalize target.png -o out.pgm --landmarks two.ljson",
    "samples target.png",
    "batch -o lit",
    "batch --targets 'none/*.jpg' --light loop -o lit",
    "batch --targets '*.png' -o lit",
    "batch --targets '*.png' --light loop --format gif -o lit",
    "batch --targets '*.png' --light loop --jobs 0 -o lit",
    "batch --targets '*.png' --light loop --cache-size big -o lit",
    "batch missing.csv -o lit",
    "evaluate folder",
    "evaluate missing",
    "evaluate triples.csv",
    "evaluate triples.csv --case 7",
    "studio target.png",
]
WRONG_FILES = [
    *(f"{TRANSFER} -o out.png --config {name}.json" for name in ("lam", "name", "marks")),
    "batch pairs.csv -o lit --dry-run",
    "batch columns.csv -o lit",
]


@pytest.fixture
def wrong(place):
    """The folder, with files that are wrong in one way each."""
    (place / "folder").mkdir()
    noise = np.random.default_rng(0).integers(0, 256, (64, 64, 3), np.uint8)
    Image.fromarray(noise).save(place / "noise.png")
    Image.new("L", (71, 82)).save(place / "small.png")
    Image.fromarray(noise).resize((72, 82)).save(place / "colours.png")
    (place / "two.png").write_bytes((place / "target.png").read_bytes())
    (place / "bomb.png").write_bytes(
        b"\x89PNG\r\n\x1a\n" + bytes.fromhex("0000000d494844520000ea600000ea600802000000") + bytes(200)
    )
    tifffile.imwrite(place / "complex.tif", noise[..., 0].astype(np.complex64))
    tifffile.imwrite(place / "half.tif", noise[..., 0].astype(np.int16))
    points = np.random.default_rng(0).uniform(10, 60, (68, 2))
    write_landmarks(place / "other.pts", Landmarks(points))
    write_landmarks(place / "far.csv", Landmarks(points + 900))
    (place / "few.csv").write_text("x,y\n1,2\n3,4\n")
    (place / "holes.csv").write_text("x,y\n1,2\nnan,4\n5,6\n7,8\n")
    group = {"landmarks": {"points": points.tolist()}, "labels": []}
    (place / "two.ljson").write_text(json.dumps({"version": 3, "groups": {"one": group, "other": group}}))
    for name in ("text.jpg", "text.json"):
        (place / name).write_text("Dear diary.\n")
    for name, record in {
        "null": None,
        "lam": {"options": {"lam": None, "mask": None}},
        "name": {"options": {"glow": 1}},
        "marks": {"landmarks": {"target": {"points": [[1, 2]]}}},
        "far": {"landmarks": {"target": {"scheme": "points", "points": (points + 900).tolist()}}},
    }.items():
        (place / f"{name}.json").write_text(json.dumps(record))
    (place / "pairs.csv").write_text(
        "target,reference,mask,lam,output\ntarget.png,reference.png,maybe,,\n"
        "target.png,reference.png,,few,\ntarget.png,,,,\ntarget.png,reference.png,,,../out.png\n"
    )
    (place / "columns.csv").write_text("target,glow\ntarget.png,1\n")
    (place / "triples.csv").write_text("target,reference,truth\ntarget.png,reference.png,small.png\n")
    return place


@pytest.mark.usefixtures("wrong")
@pytest.mark.parametrize("command", WRONG + WRONG_FILES)
def test_no_python_is_told(run, command):
    done = run(command)
    assert done.code == (0 if "--dry-run" in command else pytest.approx(1, abs=1))
    told = (done.out.decode() + done.err).splitlines()
    assert told
    for line in told:
        words = [word for word in re.findall(r"\w+|\W+", line) if word not in SPELT]
        if command in WRONG_FILES:
            words = [word for word in words if word not in KEYS]
        assert not PYTHON.search("".join(words)), line


@pytest.mark.usefixtures("wrong")
@pytest.mark.parametrize(
    ("command", "line"),
    [
        ("transfer noise.png reference.png -o out.png", "noise.png: no face found"),
        ("transfer target.png noise.png -o out.png", "noise.png: no face found"),
        ("transfer - target.png -o out.png --target-face 3", "target from stdin: there is no face 3"),
        ("transfer target.png reference.png --target-landmarks few.csv -o out.png", "few.csv: at least 3"),
        (
            "transfer target.png reference.png --reference-landmarks two.ljson -o out.png",
            "two.ljson: holds 2 faces (0: 'one', 1: 'other'); choose one with --reference-face 0 to 1",
        ),
        (f"{TRANSFER} -o target.png", "target.png: exists already; use --force to replace it, or choose"),
        (
            f"{TRANSFER} -o out.png --channels v",
            "--channels: expected one of all, r, g, b for --color-space rgb",
        ),
        (f"{TRANSFER} -o out.png --region-mask small.png", "--region-mask: expected 72x82 px, that of the"),
        (
            "transfer target.png reference.png --target-landmarks other.pts -o out.png",
            "--target-landmarks and --reference-landmarks must pair up row by row",
        ),
        (f"{TRANSFER} -o out.png --config lam.json", "lam.json: lam: expected a finite number above 0"),
        (
            "transfer target.png reference.png -o out.png --config far.json",
            "--config: landmarks of the target: 68 of 68 points lie outside the 72x82 image",
        ),
        ("evaluate triples.csv", "small.png: expected 72x82 px, as its target has, got 71x82"),
    ],
)
def test_the_file_or_the_flag_is_told(place, run, command, line):
    told = run(command, stdin=(place / "target.png").read_bytes()).err.splitlines()[-1]
    assert told.removeprefix("relit: error: ").startswith(line)


@pytest.mark.parametrize(
    "name", ["None.png", "lam", "my target_landmarks.csv", "(3, 4).png", "overwrite=True"]
)
def test_names_of_files_stay(name):
    assert in_flags(f"{name}.jpg: exists already").startswith(f"{name}.jpg: ")
