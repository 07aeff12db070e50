"""Faces to augment, a folder of references."""

import shutil

import numpy as np
import pytest
from PIL import Image

import relit


def _face_of(name, side):
    """Return the face of a sample photo, on so many px."""
    pixels = relit.read_image(relit.sample(name)).pixels
    face = relit.detect_landmarks(pixels).xy
    x, y = face.mean(axis=0).astype(int)
    reach = int(1.1 * np.ptp(face[:, 0]))
    box = (max(x - reach, 0), max(y - reach, 0), x + reach, y + reach)
    return np.asarray(Image.fromarray(pixels).crop(box).resize((side, side), Image.Resampling.LANCZOS))


@pytest.fixture(scope="module")
def image():
    """A face, about 60 px wide."""
    return _face_of("target", 128)


@pytest.fixture(scope="module")
def marks(image):
    return relit.detect_landmarks(image)


@pytest.fixture(scope="module")
def reference():
    """Large enough to be reduced before it is looked at."""
    return _face_of("reference", 900)


@pytest.fixture
def folder(tmp_path):
    """Two photos, one in a folder of its own, and what is none."""
    (tmp_path / "b").mkdir()
    shutil.copy(relit.sample("reference"), tmp_path / "b" / "first.JPG")
    shutil.copy(relit.sample("target"), tmp_path / "second.png")
    (tmp_path / "notes.txt").write_text("no photo")
    return tmp_path
