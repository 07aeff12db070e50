"""Who is in a photo, told from what is behind."""

import numpy as np
import pytest

from relit.evaluate.heads import Heads
from relit.face.detect import detect_landmarks
from relit.face.landmarks import Landmarks
from relit.face.person import person
from relit.face.views import whole
from relit.photo.reading import read_image
from relit.photo.samples import sample


@pytest.fixture(scope="module")
def astronaut():
    photo = read_image(sample("target")).pixels
    return photo, detect_landmarks(photo)


def overlap(one, other):
    return (one & other).sum() / (one | other).sum()


def test_rendered_heads_are_found_whole(heads, part_of):
    corpus = Heads(heads)
    for name in part_of(sorted(path.name for path in heads.iterdir() if path.is_dir()), 4):
        photo = corpus.photo(name, "front")
        found = person(whole(photo, corpus.landmarks(name, "front"))) > 0.5
        # Black shoulders cut off by the frame are the network's to miss.
        assert overlap(found, ~corpus.mask(name, "background")) > 0.97


@pytest.mark.parametrize("turns", [1, 2, 3])
def test_a_photo_may_lie_on_its_side_or_head(turns, astronaut):
    photo, face = astronaut
    straight = person(whole(photo, face))
    turned = face.xy
    for _ in range(turns):
        turned = np.column_stack([turned[:, 1], 511 - turned[:, 0]])
    found = person(whole(np.ascontiguousarray(np.rot90(photo, turns)), Landmarks(turned)))
    back = np.rot90(found, -turns)
    near = np.hypot(*(np.indices(photo.shape[:2]) - face.xy.mean(axis=0)[::-1, None, None])) < 150
    assert overlap((back > 0.5) & near, (straight > 0.5) & near) > 0.98


def test_size_and_depth_do_not_matter(astronaut):
    photo, face = astronaut
    likely = person(whole(photo, face))
    wide = person(whole(photo.astype(np.uint16) * 257, face))
    np.testing.assert_array_equal(likely, wide)
    half = person(whole(photo.reshape(256, 2, 256, 2, 3).mean(axis=(1, 3)) / 255, face.reduced(2)))
    assert overlap(half > 0.5, likely[::2, ::2] > 0.5) > 0.95


def test_grey_will_do(astronaut):
    photo, face = astronaut
    grey = np.rint(photo @ [0.299, 0.587, 0.114]).astype(np.uint8)
    likely = person(whole(grey, face))
    assert likely.shape == grey.shape
    assert likely[face.xy[1, 1].round().astype(int), face.xy[1, 0].round().astype(int)] > 0.9


def test_shoulders_far_from_the_face_are_the_persons(portraits):
    photo = read_image(portraits / "030_03.jpg").pixels
    likely = person(whole(photo, detect_landmarks(photo)))
    height, width = likely.shape
    low, high = slice(int(0.97 * height), None), slice(None, int(0.2 * height))
    left, right = slice(int(0.1 * width), int(0.15 * width)), slice(int(0.85 * width), int(0.9 * width))
    assert min(likely[low, left].min(), likely[low, right].min()) > 0.9
    assert max(likely[high, left].max(), likely[high, right].max()) < 0.1
