"""Photos larger than a face needs: what is worked out on a reduced one holds for every pixel."""

import functools

import numpy as np
import pytest
from PIL import Image

from relit.face.detect import detect_landmarks
from relit.relighting import transfer


@pytest.fixture(scope="module")
def portrait(portraits):
    """Return a portrait of 4 MP, with the grain of a camera, and its face."""
    seen = {}

    def load(name):
        if name not in seen:
            with Image.open(portraits / f"{name}_03.jpg") as opened:
                large = opened.convert("RGB").resize((2000, 2000), Image.Resampling.LANCZOS)
            grain = np.random.default_rng(int(name)).normal(0, 1.5, (2000, 2000, 3))
            pixels = np.rint(np.asarray(large) + grain).clip(0, 255).astype(np.uint8)
            seen[name] = pixels, detect_landmarks(pixels)
        return seen[name]

    return load


@pytest.fixture(scope="module")
def both_ways(portrait):
    """Relight at the size that the face needs, and at the photo's own; in floats, which are not rounded."""

    @functools.cache
    def relit(target, reference):
        photo, face = portrait(target)
        photo = photo.astype(np.float32) / np.float32(255)
        given = {"target_landmarks": face}
        given["reference"], given["reference_landmarks"] = portrait(reference)
        quick, exact = (transfer(photo, **given, full_resolution=full) for full in (False, True))
        assert quick.view.factor > exact.view.factor == 1
        return photo, quick.image, exact.image, quick.window

    return relit


@pytest.mark.slow
@pytest.mark.parametrize(
    ("target", "reference"),
    [
        pytest.param("005", "136", marks=pytest.mark.rotating),
        pytest.param("096", "030", marks=pytest.mark.rotating("096-030")),
    ],
)
def test_within_half_a_grey_level_of_the_full_solution(target, reference, both_ways):
    photo, quick, exact, _window = both_ways(target, reference)
    error = 255 * (quick - exact)
    relit = (quick != photo) | (exact != photo)
    assert 0.1 < relit.mean() < 0.9
    assert np.sqrt((error[relit] ** 2).mean()) < 0.5


@pytest.mark.rotating("096-030")
@pytest.mark.slow
def test_no_halo_at_silhouettes(both_ways):
    """Beside the largest steps of a photo the error is no larger than elsewhere in the face."""
    photo, quick, exact, window = both_ways("096", "030")
    error = 255 * np.abs(quick[window] - exact[window]).mean(axis=2)
    grey = photo[window].mean(axis=2)
    step = np.abs(np.diff(grey, axis=1, prepend=grey[:, :1])) > 0.1
    beside = np.zeros_like(step)
    for shift in range(-8, 9):
        beside |= np.roll(step, shift, axis=1)
    changed = np.abs(photo[window] - exact[window]).mean(axis=2) > 2 / 255
    assert (beside & changed).mean() > 0.003
    assert error[beside & changed].mean() < 2 * error[~beside & changed].mean() + 0.25
