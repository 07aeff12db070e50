"""The network corrects nothing before it has learnt, and its error does not ask how bright a photo is."""

import numpy as np
import pytest

pytest.importorskip("torch", reason="the training extra is not installed: pip install -e '.[training]'")

import torch

from training.closed_form import PLANES, SIDE
from training.learn import error, varied
from training.network import Correction


@pytest.fixture
def pairs():
    random = torch.Generator().manual_seed(0)
    seen = torch.randn((8, PLANES, SIDE, SIDE), generator=random)
    seen[:, 10] = 0
    seen[:, 10, 20:70, 30:80] = 1
    return seen, 0.5 * torch.randn((8, SIDE, SIDE), generator=random)


def test_at_first_it_corrects_nothing(pairs):
    made = Correction()(pairs[0])
    assert made.shape == (8, SIDE, SIDE)
    assert not made.any()


def test_one_gain_is_no_error(pairs):
    seen, wanted = pairs
    off, edges = error(wanted + 0.7, wanted, seen[:, 10])
    np.testing.assert_allclose(off, 0, atol=1e-4)
    np.testing.assert_allclose(edges, 0, atol=1e-4)
    worse, _ = error(wanted + 0.1 * torch.randn(wanted.shape), wanted, seen[:, 10])
    assert (worse > 1).all()


def test_what_is_outside_the_face_does_not_count(pairs):
    seen, wanted = pairs
    made = wanted.clone()
    made[:, :20] += 1
    np.testing.assert_allclose(error(made, wanted, seen[:, 10])[0], 0, atol=1e-4)


def test_a_mirrored_pair_is_the_pair_of_mirrored_photos(pairs, monkeypatch):
    monkeypatch.setattr("training.learn._SAME", 0.0)
    monkeypatch.setattr("training.learn._GRAIN", 0.0)
    seen, wanted = pairs
    made, truth = varied(seen, wanted, torch.Generator().manual_seed(1))
    kept = (made == seen).flatten(1).all(dim=1)
    assert 0 < kept.sum() < len(seen)
    flipped = seen.flip(3)
    flipped[:, 5] *= -1
    assert torch.equal(made[~kept], flipped[~kept])
    assert torch.equal(truth[~kept], wanted.flip(2)[~kept])
    assert torch.equal(truth[kept], wanted[kept])


def test_one_photo_twice_wants_no_change(pairs, monkeypatch):
    monkeypatch.setattr("training.learn._SAME", 1.0)
    monkeypatch.setattr("training.learn._GRAIN", 0.0)
    made, wanted = varied(*pairs, torch.Generator().manual_seed(1))
    assert torch.equal(made[:, 0], wanted)
    assert torch.equal(made[:, 0], made[:, 1])
    assert not made[:, 2].any()
