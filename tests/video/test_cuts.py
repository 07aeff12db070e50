"""Cuts are found, and what is none is not."""

import numpy as np
import pytest

from relit.video.cuts import apart, find_cuts, signature
from tests.video.clips import moving

NOISE = np.random.default_rng(0)


def signatures(pictures):
    return np.stack([signature(one) for one in pictures])


def scene(number):
    return np.random.default_rng(number).integers(0, 256, (6, 6, 3), np.uint8).repeat(20, 0).repeat(20, 1)


def test_a_signature_is_a_distribution():
    one, other = signature(scene(0)), signature(np.zeros((9, 9, 3), np.uint8))
    assert one.sum() == pytest.approx(1, abs=1e-5)
    assert apart(one, one) == 0
    assert 0 < apart(one, other) <= 1


def test_cuts_are_where_the_scenes_meet():
    scenes = [
        np.full((40, 60, 3), color, np.uint8) for color in ((200, 30, 30), (20, 200, 40), (30, 30, 210))
    ]
    pictures = [one for one, count in zip(scenes, (7, 1, 9), strict=True) for _ in range(count)]
    noisy = [np.clip(one + NOISE.normal(0, 4, one.shape), 0, 255).astype(np.uint8) for one in pictures]
    assert find_cuts(signatures(noisy)) in ([7, 8], [7], [8])
    long = [one for one in scenes for _ in range(10)]
    assert find_cuts(signatures(long)) == [10, 20]


def test_a_face_that_moves_is_no_cut():
    assert find_cuts(signatures(moving(20, step=4))) == []


def test_a_light_that_fades_is_no_cut():
    pictures = [(moving(1)[0] * share).astype(np.uint8) for share in np.linspace(1, 0.2, 30)]
    assert find_cuts(signatures(pictures)) == []


@pytest.mark.parametrize("length", [1, 2])
def test_a_flash_is_no_cut(length):
    calm = moving(1)[0]
    white = np.full_like(calm, 250)
    assert find_cuts(signatures([calm] * 8 + [white] * length + [calm] * 8)) == []


def test_one_frame_has_no_cut():
    assert find_cuts(signatures(moving(1))) == []
