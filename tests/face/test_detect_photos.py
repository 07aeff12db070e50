"""Faces in the portraits and the Yale B photos, found where others have found them."""

import csv
import io
import re

import numpy as np
import pytest
from PIL import Image

from relit.face.detect import detect_faces, detect_landmarks
from tests.face.irises import LEFT_IRIS, RIGHT_IRIS, distance


@pytest.mark.slow
def test_portraits(portraits):
    """The irises lie on the hand-checked pupils."""
    photos = sorted(portraits.glob("*.jpg"))
    assert len(photos) == 14
    for path in photos:
        pupils = np.loadtxt(io.StringIO(path.with_suffix(".tem").read_text()), skiprows=1, max_rows=2)
        faces = detect_faces(np.asarray(Image.open(path).convert("RGB")))
        assert len(faces) == 1, path.name
        middle = faces[0].xy[[RIGHT_IRIS, LEFT_IRIS]].mean(axis=0)
        apart = np.linalg.norm(pupils[1] - pupils[0])
        assert np.linalg.norm(middle - pupils.mean(axis=0)) < 0.03 * apart, path.name
        for iris, pupil in zip((RIGHT_IRIS, LEFT_IRIS), pupils, strict=True):
            assert np.linalg.norm(faces[0].xy[iris] - pupil) < 0.03 * apart, path.name


def test_yale_frontal_light(yaleb, yale_landmarks):
    assert len(yale_landmarks) == 10
    for subject, expected in yale_landmarks.items():
        photo = np.asarray(Image.open(yaleb / subject / f"{subject}_P00A+000E+00.pgm"))
        # Points beyond the crop are guesses, here and there.
        inside = ((expected[:, :2] >= 0) & (expected[:, :2] <= np.array(photo.shape)[::-1] - 1)).all(axis=1)
        assert inside.sum() > 350
        assert distance(detect_landmarks(photo).xy[inside], expected[inside]) < 4, subject


@pytest.mark.slow
def test_yale_hard_lights(yaleb, yale_landmarks):
    """At least 95 % are found, in the right place, in a fixed sample of the lights from 25° to 77°."""
    with (yaleb / "light_subsets.csv").open() as file:
        subset = {
            (int(row["azimuth"]), int(row["elevation"])): int(row["subset"]) for row in csv.DictReader(file)
        }
    paths = []
    for path in sorted(yaleb.glob("yaleB*/*E*.pgm")):
        azimuth, elevation = map(int, re.search(r"A([+-]\d+)E([+-]\d+)", path.name).groups())
        if subset[azimuth, elevation] in (3, 4):
            paths.append(path)
    paths = [paths[k] for k in np.linspace(0, len(paths) - 1, 60).round().astype(int)]
    good = 0
    for path in paths:
        faces = detect_faces(np.asarray(Image.open(path)))
        # Heads drift by up to 4 px between exposures.
        good += len(faces) == 1 and distance(faces[0], yale_landmarks[path.parent.name]) < 10
    assert good >= 0.95 * len(paths)
