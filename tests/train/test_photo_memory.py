"""What is kept of the photos that were relit last, and that lights on them are the same with it."""

import pickle

import numpy as np
import pytest

import relit
from relit.photo.photo import Photo
from relit.runtime.memo import remembered
from relit.train.augment import RelightAugment
from relit.train.photo_memory import PhotoMemory

FACE = relit.Landmarks([[2, 2], [5, 2], [3, 5]])


@pytest.fixture
def count():
    """Return what tells how often a step is done whose result holds 800 bytes."""
    done = []

    @remembered
    def step(number):
        done.append(number)
        return np.full(100, number, float)

    def ask(memory, photo, number=0, face=FACE):
        with memory.open(photo, face):
            assert step(number)[0] == number
        return len(done)

    return ask


def photo_of(value):
    return Photo(np.full((8, 8), value, np.uint8))


def test_a_photo_is_known_again_by_what_it_shows(count):
    memory, photo = PhotoMemory(), photo_of(1)
    assert [count(memory, photo), count(memory, photo_of(1))] == [1, 1]
    assert count(memory, photo_of(2)) == 2
    assert count(memory, photo, face=relit.Landmarks(FACE.points + 1)) == 3
    photo.pixels[0, 0] = 9  # the same array is another photo now
    assert count(memory, photo) == 4


def test_of_a_step_the_photo_and_the_last_reference_stay(count):
    memory, photo = PhotoMemory(), photo_of(1)
    assert [count(memory, photo, number) for number in (0, 1, 0, 2, 0, 2, 1)] == [1, 2, 2, 3, 3, 3, 4]


def test_the_photo_not_relit_for_longest_is_forgotten(count):
    memory = PhotoMemory(2000)
    assert [count(memory, photo_of(value)) for value in (1, 2, 1, 3, 1, 2)] == [1, 2, 2, 3, 3, 4]


def test_what_is_larger_than_all_that_may_be_held_is_not_kept(count):
    memory = PhotoMemory(700)
    assert [count(memory, photo_of(1)), count(memory, photo_of(1))] == [1, 2]


def test_a_pickled_one_comes_back_empty(count):
    memory = PhotoMemory()
    assert count(memory, photo_of(1)) == 1
    assert count(pickle.loads(pickle.dumps(memory)), photo_of(1)) == 2


def test_lights_are_those_of_who_has_forgotten_all(image, marks, reference):
    images = [image, np.ascontiguousarray(image[:, ::-1])]
    faces = [marks, relit.detect_landmarks(images[1])]
    knowing, other = (RelightAugment([reference], lights="random", p=1, seed=3) for _ in range(2))
    for number in (0, 1, 0, 2, 3):
        for one, face in zip(images, faces, strict=True):
            made = knowing(one, landmarks=face, number=number)
            forgetful = pickle.loads(pickle.dumps(other))
            np.testing.assert_array_equal(made, forgetful(one, landmarks=face, number=number))
