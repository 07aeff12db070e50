"""Scores against scikit-image, and what they must not depend on."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from skimage import data
from skimage.metrics import structural_similarity

from relit.errors import ImageError
from relit.evaluate import scores
from relit.evaluate.scores import score
from relit.ltv.decomposition import normalize


@pytest.mark.parametrize("channels", [None, 3])
def test_ssim_is_that_of_scikit_image(channels):
    image = data.astronaut().astype(float)
    image = image[100:200, 150:240] if channels else image[100:200, 150:240, 0]
    noisy = np.clip(image + np.random.default_rng(0).normal(0, 20, image.shape), 0, 255)
    theirs = structural_similarity(image, noisy, data_range=255, channel_axis=-1 if channels else None)
    assert scores.structural_similarity(image, noisy, 255) == pytest.approx(theirs, abs=1e-9)


@given(gain=st.floats(0.1, 5))
def test_only_the_raw_figure_knows_the_exposure(gain):
    truth = data.camera()[100:160, 150:210].astype(float)
    image = truth + np.random.default_rng(1).normal(0, 10, truth.shape)
    plain, brighter = score(image, truth, truth), score(gain * image, truth, truth)
    assert brighter.gain == pytest.approx(plain.gain)
    assert brighter.ssim == pytest.approx(plain.ssim)


def test_errors_are_shares_of_the_range_and_the_border_does_not_count():
    truth = np.full((40, 40), 100.0)
    image = truth.copy()
    image[:8], image[:, -8:] = 0, 255
    assert score(image, truth, truth).raw == 0
    assert score(image + 25.5, truth, truth).raw == pytest.approx(10)
    assert score(image * 0, truth, truth).gain == pytest.approx(100 / 2.55)


def test_images_that_cannot_be_compared_are_refused():
    with pytest.raises(ImageError, match="expected the shape of the truth"):
        score(np.zeros((40, 40)), *2 * [np.zeros((40, 41))])
    with pytest.raises(ImageError, match="sides of 23 px or more"):
        score(*3 * [np.zeros((40, 20))])


def test_identity_tells_whose_features_they_are():
    ours, theirs = data.astronaut()[60:140, 180:260], data.camera()[60:140, 180:260]
    ours = ours.mean(axis=2)
    lit = ours * np.linspace(0.4, 1, 80)
    assert score(lit, ours, theirs.astype(float)).identity > 0.6
    assert score(theirs.astype(float), ours, theirs.astype(float)).identity < -0.6
    assert score(np.full_like(ours, 9), ours, theirs.astype(float)).identity == 0


def test_identity_is_a_difference_of_correlations():
    random = np.random.default_rng(0)
    a, b = random.integers(20, 200, (2, 40, 40))
    v = [np.log(normalize(image.astype(np.uint8))).ravel() for image in (a, b)]
    assert score(a, a, b, border=0).identity == pytest.approx(1 - np.corrcoef(*v)[0, 1])
