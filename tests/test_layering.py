"""The layers of a transfer, laid on each other as their modes say, are the relit photo."""

from dataclasses import replace

import numpy as np
import pytest

from relit.face.detect import detect_landmarks
from relit.layering import layers_of
from relit.photo.photo import Photo
from relit.photo.reading import read_image
from relit.photo.samples import sample
from relit.relighting import transfer
from tests.photo.photo_files import P3

NAMES = ["Relit", "Light change, darker", "Light change, brighter", "Face", "Hair and clothes"]
NAMES += ["Background", "Photo"]


@pytest.fixture(scope="module")
def photo():
    return read_image(sample("target"))


@pytest.fixture(scope="module")
def face(photo):
    return detect_landmarks(photo.pixels)


@pytest.fixture(scope="module")
def result(photo, face):
    return transfer(photo, light="rembrandt", target_landmarks=face)


def full(layer):
    return np.iinfo(layer.photo.pixels.dtype).max


def laid(layers):
    """Return layers laid on each other, the formulas being those of W3C's Compositing and Blending."""
    made = np.zeros(layers.picture.pixels.shape)
    for layer in [layer for layer in layers.layers[::-1] if layer.visible]:
        height, width = layer.photo.pixels.shape[:2]
        below = made[layer.top : layer.top + height, layer.left : layer.left + width]
        above = layer.photo.pixels / full(layer)
        if layer.mode == "multiply":
            below *= above
        elif layer.mode == "color-dodge":
            with np.errstate(divide="ignore", invalid="ignore"):
                dodged = np.minimum(1, below / (1 - above))
            below[...] = np.where(below == 0, 0, dodged)
        else:
            below[...] = above
        assert layer.photo.alpha is None
    return made


def without(layers, name):
    return replace(layers, layers=tuple(layer for layer in layers.layers if layer.name != name))


def by_name(layers):
    return {layer.name: layer for layer in layers.layers}


def at_its_place(layer, shape):
    whole = np.zeros(shape[:2])
    height, width = layer.photo.alpha.shape
    whole[layer.top : layer.top + height, layer.left : layer.left + width] = layer.photo.alpha / full(layer)
    return whole


def test_names_and_what_one_sees(photo, result):
    layers = layers_of([result], photo)
    assert [layer.name for layer in layers.layers] == NAMES
    assert [layer.name for layer in layers.layers if not layer.visible] == NAMES[3:6]
    assert layers.layers[0].photo is layers.picture
    np.testing.assert_array_equal(layers.picture.pixels, result.image)
    np.testing.assert_array_equal(by_name(layers)["Photo"].photo.pixels, photo.pixels)
    np.testing.assert_array_equal(laid(layers), result.image / 255)


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.float32])
def test_what_was_done_does_the_same_to_the_photo(photo, face, dtype):
    most = 1 if dtype == np.float32 else np.iinfo(dtype).max
    deep = replace(photo, pixels=(photo.pixels / 255 * most).astype(dtype))
    made = transfer(deep, sample("reference"), target_landmarks=face)
    layers = layers_of([made], deep)
    assert layers.picture.pixels.dtype == (np.uint8 if dtype == np.uint8 else np.uint16)
    off = np.abs(laid(without(layers, "Relit")) - layers.picture.pixels / full(layers.layers[0]))
    assert off[layers.layers[-1].photo.pixels > 0].max() <= 1.01 / full(layers.layers[0])
    assert np.abs(layers.picture.pixels / full(layers.layers[0]) - made.image / most).max() < 1e-5


def test_masks_are_where_the_parts_are(photo, face, result):
    masks = {
        name: at_its_place(layer, photo.pixels.shape)
        for name, layer in by_name(layers_of([result], photo)).items()
        if name in NAMES[3:6]
    }
    x, y = np.rint(face.xy.mean(axis=0)).astype(int)
    assert masks["Face"][y, x] == 1
    assert masks["Background"][10, 10] == 1
    assert masks["Hair and clothes"][500, 200] == 1  # below all that was looked at
    assert masks["Background"][y, x] == masks["Hair and clothes"][y, x] == 0
    assert sum(masks.values()).max() < 1.01
    changed = (result.image != photo.pixels).any(axis=2)
    assert changed[masks["Background"] == 1].mean() < 0.01


def test_black_stays_white_and_black_in_what_is_multiplied_and_dodged(photo, result):
    """So that one can paint there."""
    made = by_name(layers_of([result], photo))
    for name, neutral in zip(NAMES[1:3], (255, 0), strict=True):
        layer = made[name]
        height, width = layer.photo.pixels.shape[:2]
        below = photo.pixels[layer.top : layer.top + height, layer.left : layer.left + width]
        assert (below == 0).any()
        assert (layer.photo.pixels[below == 0] == neutral).all()


def test_the_change_is_no_larger_than_what_changed(photo, result):
    rows, columns = np.nonzero((result.image != photo.pixels).any(axis=2))
    for name in NAMES[1:3]:
        layer = by_name(layers_of([result], photo))[name]
        height, width = layer.photo.pixels.shape[:2]
        assert (layer.top, layer.left) == (rows.min(), columns.min())
        assert (layer.top + height - 1, layer.left + width - 1) == (rows.max(), columns.max())


def test_where_nothing_changes_there_is_no_change(photo, face):
    layers = layers_of([transfer(photo, light="loop", strength=0, target_landmarks=face)], photo)
    assert [layer.name for layer in layers.layers] == [NAMES[0], *NAMES[3:]]


def test_a_grey_photo_in_a_coloured_light_is_in_colours():
    grey = read_image(sample("grey_target"))
    made = transfer(grey, sample("reference"))
    layers = layers_of([made], grey)
    assert {layer.photo.pixels.shape[2:] for layer in layers.layers} == {(3,)}
    off = np.abs(laid(without(layers, "Relit")) - made.image / 255)
    assert off[grey.pixels > 0].max() <= 1.01 / 255
    alone = layers_of([transfer(grey, light="loop")], grey)
    assert {layer.photo.pixels.shape[2:] for layer in alone.layers} == {()}


def test_of_a_photo_with_alpha_one_sees_the_relit_one_alone(photo, face):
    alpha = np.full(photo.pixels.shape[:2], 128, np.uint8)
    clear = replace(photo, alpha=alpha)
    layers = layers_of([transfer(clear, light="loop", target_landmarks=face)], clear)
    assert [layer.name for layer in layers.layers if layer.visible] == ["Relit"]
    for name in (NAMES[0], *NAMES[1:3], NAMES[-1]):
        assert (by_name(layers)[name].photo.alpha == 128).all()


def test_what_travels_with_the_photo_is_kept(photo, result):
    with_profile = replace(photo, profile=P3)
    layers = layers_of([result], with_profile)
    assert {by_name(layers)[name].photo.profile for name in (*NAMES[:3], "Photo")} == {P3}
    assert layers.picture.metadata is photo.metadata


def test_two_faces_share_the_layers(photo, face):
    wide = replace(photo, pixels=np.hstack([photo.pixels, photo.pixels[:, ::-1]]))
    first = transfer(wide, light="loop", target_landmarks=face)
    other = detect_landmarks(wide.pixels[:, 512:].copy()).shifted(512, 0)
    second = transfer(replace(wide, pixels=first.image), light="loop", target_landmarks=other)
    layers = layers_of([first, second], wide)
    np.testing.assert_array_equal(laid(layers), second.image / 255)
    assert np.abs(laid(without(layers, "Relit")) - second.image / 255)[wide.pixels > 0].max() <= 1.01 / 255
    mask = at_its_place(by_name(layers)["Face"], wide.pixels.shape)
    for marks in (face, other):
        x, y = np.rint(marks.xy.mean(axis=0)).astype(int)
        assert mask[y, x] == 1


@pytest.mark.parametrize("method", ["ltv", "moments"])
def test_other_methods_have_layers_too(photo, face, method):
    made = transfer(photo, sample("reference"), target_landmarks=face, method=method)
    layers = layers_of([made], photo)
    assert np.abs(laid(without(layers, "Relit")) - made.image / 255)[photo.pixels > 0].max() <= 1.01 / 255


def test_a_whole_photo_that_is_face_has_no_background():
    grey = Photo(np.full((80, 80), 0.5))
    points = [[0, 0], [79, 0], [79, 79], [0, 79], [25, 30], [55, 30]]
    made = transfer(grey, light="loop", target_landmarks=points, mask=False)
    assert "Background" not in by_name(layers_of([made], grey))
