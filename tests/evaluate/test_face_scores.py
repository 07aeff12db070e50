"""Scores on a face: against scikit-image, and what each of them must see and must not."""

import numpy as np
import pytest
from skimage import color, data
from skimage.metrics import structural_similarity

from relit.errors import ImageError
from relit.evaluate.face_scores import face_scores

Y, X = np.mgrid[:120, :120] - 55
FACE, BACKGROUND = np.hypot(X, Y) < 35, np.hypot(X, Y) > 50
AROUND = ~(FACE | BACKGROUND)
PHOTO = data.astronaut()[60:180, 160:280].astype(float) * 0.6 + 20


def scored(image, truth=PHOTO, target=PHOTO):
    return face_scores(image, truth, target, FACE, BACKGROUND)


def decoded(image):
    return np.where(image <= 0.04045 * 255, image / 255 / 12.92, ((image / 255 + 0.055) / 1.055) ** 2.4)


def encoded(light):
    return 255 * np.where(light <= 0.0031308, light * 12.92, 1.055 * light ** (1 / 2.4) - 0.055)


def test_figures_are_those_of_scikit_image():
    noise = np.random.default_rng(0).normal(0, 12, PHOTO.shape)
    image = np.clip(PHOTO * [1.1, 0.9, 0.8] + noise, 0, 255)
    scores = scored(image)
    ours, truth = (one @ [0.299, 0.587, 0.114] for one in (image, PHOTO))
    assert scores.raw == pytest.approx(np.abs(ours - truth)[FACE].mean() / 2.55)
    ours *= np.linalg.lstsq(ours[FACE][:, None], truth[FACE], rcond=None)[0]
    assert scores.lum == pytest.approx(np.abs(ours - truth)[FACE].mean() / 2.55)
    assert scores.around_lum == pytest.approx(np.abs(ours - truth)[AROUND].mean() / 2.55)
    similarity = structural_similarity(ours, truth, data_range=255, full=True)[1]
    assert scores.ssim == pytest.approx(similarity[FACE].mean(), abs=1e-9)

    light, true_light = decoded(image), decoded(PHOTO)
    light = light * np.linalg.lstsq(light[FACE].reshape(-1, 1), true_light[FACE].ravel(), rcond=None)[0]
    ours, truth = (color.rgb2lab(np.clip(encoded(one) / 255, 0, 1)) for one in (light, true_light))
    differences = color.deltaE_ciede2000(ours, truth)
    assert scores.de == pytest.approx(differences[FACE].mean(), abs=0.01)
    assert scores.around_de == pytest.approx(differences[AROUND].mean(), abs=0.01)
    chroma = (ours - truth)[..., 1:]
    assert scores.ab == pytest.approx(np.hypot(*chroma[FACE].T).mean(), abs=0.01)
    assert scores.cast == pytest.approx(np.hypot(*chroma[FACE].mean(axis=0)), abs=0.01)
    behind = color.deltaE_ciede2000(color.rgb2lab(image / 255), color.rgb2lab(PHOTO / 255))[BACKGROUND]
    assert scores.background == pytest.approx(behind.mean(), abs=0.01)
    assert scores.background_max == pytest.approx(behind.max(), abs=0.05)


def test_only_the_raw_figure_knows_the_exposure():
    brighter = scored(encoded(1.5 * decoded(PHOTO)))
    assert brighter.raw > 4
    for figure in ("de", "ab", "cast", "blotch", "around_de"):
        assert getattr(brighter, figure) == pytest.approx(0, abs=1e-6)
    scaled = scored(1.5 * PHOTO)
    assert (scaled.lum, scaled.around_lum, scaled.ssim) == pytest.approx((0, 0, 1), abs=1e-9)


def tinted(where, by=1.15):
    """Return the photo with more red where that is told."""
    light = decoded(PHOTO)
    light[..., 0] *= np.where(where, by, 1)
    return encoded(light)


def test_a_cast_is_all_over_the_face_and_a_blotch_on_part_of_it():
    grey = np.full((120, 120, 3), 120.0)
    light = decoded(grey) * [1.2, 1, 1]
    whole = scored(encoded(light), grey, grey)
    assert whole.cast > 3
    assert whole.blotch == pytest.approx(0, abs=1e-6)
    assert whole.ab == pytest.approx(whole.cast)
    half = scored(np.where((X > 0)[..., None], encoded(light), grey), grey, grey)
    # Half the face at either end of the same difference: as far from the mean as the mean is from none.
    assert half.blotch == pytest.approx(whole.cast / 2, rel=0.1)
    fine = scored(np.where((X % 2 > 0)[..., None], encoded(light), grey), grey, grey)
    assert fine.ab == pytest.approx(half.ab, rel=0.1)
    assert fine.blotch < 0.1 * half.blotch


def test_each_area_has_its_own_figures():
    clean = scored(PHOTO)
    assert (clean.raw, clean.lum, clean.de, clean.background_max, clean.halo) == (0, 0, 0, 0, 0)
    off = scored(tinted(AROUND))
    assert off.around_de > 1
    assert (off.lum, off.de, off.cast, off.background) == pytest.approx((0, 0, 0, 0), abs=1e-9)
    off = scored(tinted(BACKGROUND & (Y < 35)))
    assert (off.de, off.around_de) == (0, 0)
    assert off.halo > off.background > 0
    assert off.background_max > 2
    below = scored(tinted(BACKGROUND & (Y >= 35)))
    assert below.background > 0
    assert below.halo == 0, "what is beside neck and shoulders does not count"


def test_the_background_is_that_of_the_target():
    dark = PHOTO / 2
    assert scored(np.where(BACKGROUND[..., None], dark, PHOTO), target=dark).background_max == 0


def test_photos_that_cannot_be_compared_are_refused():
    with pytest.raises(ImageError, match="truth: expected the size of the image"):
        scored(PHOTO, PHOTO[:-1])
    none = np.zeros_like(FACE)
    with pytest.raises(ImageError, match="face: expected some pixels"):
        face_scores(PHOTO, PHOTO, PHOTO, none, BACKGROUND)
    with pytest.raises(ImageError, match="around the face: expected"):
        face_scores(PHOTO, PHOTO, PHOTO, FACE, ~FACE)
    with pytest.raises(ImageError, match="background beside the head: expected"):
        face_scores(PHOTO, PHOTO, PHOTO, FACE, none)


def test_a_black_result_is_as_far_as_the_truth_is_bright():
    black = scored(np.zeros_like(PHOTO))
    assert black.lum == black.raw == pytest.approx((PHOTO @ [0.299, 0.587, 0.114])[FACE].mean() / 2.55)
