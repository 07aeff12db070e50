"""Kinds of images and samples that the augmentation takes: what comes back, and what it leaves alone."""

import copy
from collections import namedtuple

import imagecodecs
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image

import relit
from relit.photo.color import luma
from relit.photo.pixels import from_unit, to_unit
from relit.train.augment import RelightAugment

# Kinds of images


@settings(max_examples=25)
@given(
    dtype=st.sampled_from([np.uint8, np.uint16, np.float32, np.float64]),
    colour=st.booleans(),
    scale=st.floats(0.3, 1.5),
    margins=st.tuples(st.integers(0, 30), st.integers(0, 30)),
    number=st.integers(0, 99),
    level=st.floats(0, 1),
)
def test_shape_dtype_and_range_are_kept(dtype, colour, scale, margins, number, level):
    rng = np.random.default_rng(number)
    shape = (int(120 * scale) + margins[0], int(120 * scale) + margins[1])
    target = from_unit(level * rng.random((*shape, 3) if colour else shape), dtype)
    light = rng.integers(0, 256, (130, 120, 3), np.uint8)
    face = [[35, 50], [45, 50], [75, 50], [85, 50], [60, 70], [48, 90], [72, 90], [60, 110]]
    augment = RelightAugment([light], reference_landmarks=[face], lights="random", p=1, seed=0)
    before = target.copy()
    made = augment(target, landmarks=np.multiply(face, scale), number=number)
    assert made.shape == target.shape
    assert made.dtype == dtype
    np.testing.assert_array_equal(target, before)
    if np.dtype(dtype).kind == "f":
        assert made.min() >= 0
        assert made.max() <= 1


@pytest.mark.parametrize("mode", ["L", "RGB", "LA", "RGBA", "I;16"])
def test_pil_images_come_back_as_they_went_in(image, marks, mode):
    if mode == "I;16":
        picture = Image.fromarray((image[..., 1].astype(np.uint16) << 8) + 9)
    else:
        picture = Image.fromarray(image).convert(mode)
    if "A" in mode:
        picture.putalpha(Image.linear_gradient("L").resize(picture.size))
    picture.info["comment"] = "kept"
    augment = RelightAugment(p=1, seed=0, strength=1)
    made = augment(picture, landmarks=marks)
    assert (made.mode, made.size, made.info) == (picture.mode, picture.size, picture.info)
    if "A" in mode:
        np.testing.assert_array_equal(made.getchannel("A"), picture.getchannel("A"))
        made, picture = (one.convert(mode.removesuffix("A")) for one in (made, picture))
    expected = augment(np.asarray(picture), landmarks=marks, number=0)
    np.testing.assert_array_equal(np.asarray(made), expected)


@pytest.mark.parametrize("planes", [1, 2, 4])
def test_arrays_keep_their_alpha_and_their_only_channel(image, marks, planes):
    alpha = np.arange(image[..., 0].size).reshape(image.shape[:2]) % 256
    array = {1: image[..., 1:2], 2: np.dstack([image[..., 1], alpha]), 4: np.dstack([image, alpha])}[planes]
    array = array.astype(np.uint8)
    augment = RelightAugment(p=1, seed=0)
    made = augment(array, landmarks=marks)
    assert (made.shape, made.dtype) == (array.shape, array.dtype)
    if planes > 1:
        np.testing.assert_array_equal(made[..., -1], alpha)
    plain = augment(array[..., :3] if planes == 4 else array[..., 0], landmarks=marks, number=0)
    np.testing.assert_array_equal(made[..., :3] if planes == 4 else made[..., 0], plain)


@pytest.mark.parametrize("grey", [False, True])
def test_light_comes_in_the_colours_of_the_photo(image, marks, grey):
    profile = bytes(
        imagecodecs.cms_profile("gray", gamma=1.0) if grey else imagecodecs.cms_profile("adobergb")
    )
    photo = relit.Photo(image[..., 1] if grey else image, profile=profile)
    reference = relit.read_image(relit.sample("reference"))
    assert reference.profile
    augment = RelightAugment(reference, p=1, seed=0)
    made = augment(photo, landmarks=marks)
    assert made.profile == profile
    faces = {"target_landmarks": marks, "reference_landmarks": relit.detect_landmarks(reference.pixels)}
    if grey:
        reference = relit.Photo(from_unit(luma(to_unit(reference.to_profile(None).pixels)), np.uint8))
    expected = relit.transfer(photo, reference, **faces, options=augment.draw(0).options)
    np.testing.assert_array_equal(made.pixels, expected.image)
    picture = Image.fromarray(photo.pixels)
    picture.info["icc_profile"] = profile
    np.testing.assert_array_equal(augment(picture, landmarks=marks, number=0), expected.image)


def test_a_photo_keeps_what_travels_with_it(image, marks):
    photo = relit.Photo(image, alpha=np.full(image.shape[:2], 7, np.uint8), format="PNG")
    made = RelightAugment(p=1, seed=0)(photo, landmarks=marks)
    assert (made.alpha is photo.alpha, made.format) == (True, "PNG")
    np.testing.assert_array_equal(made.pixels, RelightAugment(p=1, seed=0)(image, landmarks=marks))


# Samples

Pair = namedtuple("Pair", "image label")
BOXES = np.array([[10.0, 20, 60, 90]])


@pytest.mark.parametrize(
    ("sample_of", "place"),
    [
        (lambda image: (image, 3), (0,)),
        (lambda image: [{"id": "a"}, BOXES, {"image": image, "mask": image[..., 0] > 9}], (2, "image")),
        (lambda image: Pair(image, 3), (0,)),
        (lambda image: {"mask": image[..., 0], "image": Image.fromarray(image)}, ("image",)),
        (lambda image: {"boxes": BOXES, "views": [image, image.copy()]}, ("views", 0)),
        (lambda image: {"mask": image[..., :1], "image": image}, ("image",)),
    ],
)
def test_the_image_in_a_sample_is_relit_and_all_else_passed_through(image, marks, sample_of, place):
    sample = sample_of(image)
    before = copy.deepcopy(sample)
    augment = RelightAugment(p=1, seed=0)
    made = augment(sample, landmarks=marks)
    assert type(made) is type(sample)
    old, new = dict(_leaves(sample)), dict(_leaves(made))
    assert list(old) == list(new)
    assert {where for where in old if old[where] is not new[where]} == {place}
    expected = augment(image, landmarks=marks, number=0)
    np.testing.assert_array_equal(np.asarray(new[place]), expected)
    for where, leaf in _leaves(before):
        np.testing.assert_array_equal(old[where], leaf)


def _leaves(sample, place=()):
    if isinstance(sample, dict | list | tuple):
        for key, part in sample.items() if isinstance(sample, dict) else enumerate(sample):
            yield from _leaves(part, (*place, key))
    else:
        yield place, sample


def test_several_arguments_come_back_as_a_tuple(image, marks):
    augment = RelightAugment(p=1, seed=0)
    made, label = augment(image, "smile", landmarks=marks)
    assert label == "smile"
    np.testing.assert_array_equal(made, augment(image, landmarks=marks, number=0))
    assert RelightAugment(p=0)(image, 1) == (image, 1)
