"""What looks like skin, on pictures whose parts are known."""

import numpy as np
import pytest

from relit.face.skin import skin_of

SKIN, HAIR, WALL = (205, 150, 125), (45, 35, 30), (150, 160, 165)


@pytest.fixture
def picture():
    """Skin in a light that falls off to a third, a dark fringe of hair, a grey wall, all with noise."""
    rng = np.random.default_rng(0)
    parts = np.repeat([0, 1, 2], [50, 20, 30])[:, None] * np.ones(80, int)
    light = np.linspace(1, 0.35, 80)[None, :, None]
    image = np.array([SKIN, HAIR, WALL])[parts] * light + rng.normal(0, 2, (100, 80, 3))
    return image.clip(0, 255).astype(np.uint8), parts


def test_skin_is_told_from_hair_and_wall_in_any_light(picture):
    image, parts = picture
    face = parts == 0
    likeness = skin_of(image, face).likeness(image)
    assert likeness[face].mean() > 0.95
    assert likeness[parts == 1].mean() < 0.3
    assert likeness[parts == 2].mean() < 0.15


def test_what_is_not_like_most_of_a_face_is_not_learnt(picture):
    image, parts = picture
    face = np.ones(parts.shape, bool)
    face[85:] = False  # three fifths of it are skin, the rest hair and wall
    likeness = skin_of(image, face).likeness(image)
    assert likeness[parts == 0].mean() > 0.9
    assert likeness[parts == 2].mean() < 0.3


def test_a_deep_shadow_keeps_the_hue_of_skin(picture):
    image, parts = picture
    skin = skin_of(image, parts == 0)
    shadow = (np.array(SKIN) * 0.1).astype(np.uint8) * np.ones((4, 4, 1), np.uint8)
    assert skin.likeness(shadow).max() < 0.5
    assert skin.likeness(shadow, hue_alone=True).min() > 0.9


def test_whitened_skin_has_a_standard_deviation_below_one(picture):
    """One, were it not for the least that is assumed."""
    image, parts = picture
    white = skin_of(image, parts == 0).whitened(image)[parts == 0]
    assert (white.std(axis=0) < 1.1).all()
    np.testing.assert_allclose(white.mean(axis=0), 0, atol=0.2)


def test_grey_photos_are_told_by_brightness_alone():
    grey = np.full((40, 40), 180, np.uint8)
    grey[:10] = 30
    face = np.zeros((40, 40), bool)
    face[10:] = True
    skin = skin_of(grey, face)
    likeness = skin.likeness(grey)
    assert likeness[10:].min() > 0.9
    assert likeness[:10].max() < 0.1
    assert (skin.likeness(grey, hue_alone=True) == 1).all()


@pytest.mark.parametrize("value", [0, 128, 255])
def test_flat_photos_are_all_skin(value):
    flat = np.full((20, 20, 3), value, np.uint8)
    assert skin_of(flat, np.ones((20, 20), bool)).likeness(flat).min() > 0.9
