"""The split: identities that it must satisfy, and its behaviour at the ends of the range."""

import threading
from functools import partial

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from skimage import data

from relit.errors import ImageError, OptionError
from relit.evaluate.yale_b import FRONTAL, YaleB
from relit.ltv.decomposition import decompose, normalize
from relit.photo.pixels import DARKEST
from relit.solver import isotropic
from relit.solver.certificate import certify
from relit.solver.isotropic import tv_l1_isotropic

images = arrays(np.uint8, st.tuples(st.integers(8, 12), st.integers(8, 12)), elements=st.integers(0, 255))


@settings(max_examples=40, deadline=None)
@given(image=images, lam=st.floats(0.05, 3), neighborhood=st.sampled_from([4, 8, 16, "isotropic"]))
def test_u_times_v_is_the_image(image, lam, neighborhood):
    split = decompose(image, lam, neighborhood=neighborhood)
    assert np.isfinite(split.u).all()
    assert np.isfinite(split.v).all()
    assert split.u.min() > 0
    np.testing.assert_allclose(split.u * split.v, np.maximum(image / 255, DARKEST), rtol=1e-5)


def test_u_minimises_tv_l1_of_the_logarithm():
    image = data.astronaut()[60:110, 200:250, 1]
    split = decompose(image, 0.4)
    log = np.log(np.maximum(image / 255, DARKEST))
    # The logarithm of u in doubles, from the grey levels that it stands for.
    levels = np.rint(split.u.astype(np.float64) * 255)
    assert certify(log, np.log(np.maximum(levels / 255, DARKEST)), 0.4).optimal


def test_lam_refers_to_eyes_100_px_apart():
    image = data.astronaut()[60:110, 200:250, 1]
    near = decompose(image, 0.2, interocular_distance=50)
    np.testing.assert_array_equal(near.u, decompose(image, 0.4).u)
    assert near.lam == pytest.approx(0.4)


def test_scaling_the_photo_scales_the_split():
    image = data.astronaut()[60:100, 200:240, 1]
    twice = image.repeat(2, axis=0).repeat(2, axis=1)
    small = decompose(image, 0.3, neighborhood=4, interocular_distance=60)
    large = decompose(twice, 0.3, neighborhood=4, interocular_distance=120)
    # Of an image of square blocks, 4-neighbour TV-L1 is the same problem at half λ.
    np.testing.assert_array_equal(large.u, small.u.repeat(2, axis=0).repeat(2, axis=1))


def test_channels_are_split_alone():
    image = data.astronaut()[60:100, 200:240]
    split = decompose(image, 0.3)
    for k in range(3):
        np.testing.assert_array_equal(split.u[..., k], decompose(image[..., k].copy(), 0.3).u)


def test_depths_agree():
    image = data.astronaut()[60:100, 200:240, 1]
    small = decompose(image, 0.3).u
    for deeper in (image.astype(np.uint16) * 257, image.astype(np.float32) / 255, image / 255):
        np.testing.assert_allclose(decompose(deeper, 0.3).u, small, atol=1e-6)


@pytest.mark.parametrize("level", [0, 128, 255])
def test_constant_images_are_all_light(level):
    split = decompose(np.full((12, 12), level, np.uint8), 0.2)
    np.testing.assert_array_equal(split.v, 1)
    np.testing.assert_allclose(split.u, max(level / 255, DARKEST), rtol=1e-6)


def test_a_bright_speck_on_black_does_not_blow_up():
    image = np.zeros((12, 12), np.uint8)
    image[6, 6] = 255
    split = decompose(image, 0.2)
    assert split.v[6, 6] == pytest.approx(1 / DARKEST)
    assert split.v[0, 0] == 1


def test_isotropic_kind_runs_on_the_logarithm():
    image = data.astronaut()[60:100, 200:240, 1]
    expected = np.exp(tv_l1_isotropic(np.log(np.maximum(image / 255, DARKEST)), 0.4).u)
    np.testing.assert_allclose(decompose(image, 0.4, neighborhood="isotropic").u, expected, rtol=1e-4)


def test_threads_give_the_same_bits():
    image = data.astronaut()[60:140, 180:260]
    alone = decompose(image, 0.3)
    results = []
    threads = [threading.Thread(target=lambda: results.append(decompose(image, 0.3))) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(results) == 4
    for result in results:
        np.testing.assert_array_equal(result.u, alone.u)


def test_arguments_out_of_range_are_refused():
    image = np.zeros((9, 9), np.uint8)
    for lam in (0, -1, np.nan, np.inf):
        with pytest.raises(OptionError, match="lam"):
            decompose(image, lam)
    for distance in (0, -3, np.nan):
        with pytest.raises(OptionError, match="interocular_distance"):
            decompose(image, interocular_distance=distance)
    with pytest.raises(OptionError, match="neighborhood"):
        decompose(image, neighborhood=6)
    with pytest.raises(ImageError, match="image: expected shape"):
        decompose(np.zeros((9, 9, 5), np.uint8))


def test_an_isotropic_split_that_did_not_converge_is_told(monkeypatch):
    hurried = partial(tv_l1_isotropic, max_iterations=20)
    monkeypatch.setattr(isotropic, "tv_l1_isotropic", hurried)
    with pytest.warns(RuntimeWarning, match="stopped after 20 iterations"):
        decompose(data.astronaut()[60:100, 200:240, 1], 0.05, neighborhood="isotropic")


@pytest.mark.slow
@pytest.mark.rotating
def test_people_are_recognised_on_v_and_not_on_the_pixels(yaleb):
    """Nearest neighbour by mean absolute difference, from one frontal image per person; 10 people."""
    yale = YaleB(yaleb)
    distance = yale.landmarks("yaleB01", FRONTAL).interocular_distance

    def rates(features):
        gallery = np.stack([features(yale.photo(subject, FRONTAL)) for subject in yale.subjects])
        hits = {2: [], 3: [], 4: []}
        for row, subject in enumerate(yale.subjects):
            for light in yale.lights(subject):
                if light.subset in hits:
                    image = features(yale.photo(subject, light))
                    hits[light.subset].append(np.abs(gallery - image).mean(axis=(1, 2)).argmin() == row)
        return {subset: float(np.mean(hit)) for subset, hit in hits.items()}

    raw = rates(lambda image: image.astype(float))
    normal = rates(lambda image: normalize(image, interocular_distance=distance))
    print("identified on pixels", raw, "and on v", normal)
    assert normal[2] >= raw[2]
    assert normal[3] > raw[3] + 0.3
    assert normal[4] > raw[4] + 0.4


def test_normalization_takes_colour_as_its_luma_and_any_depth():
    image = data.astronaut()[60:120, 190:250]
    assert normalize(image).shape == image.shape[:2]
    grey = normalize(image[..., 1])
    np.testing.assert_array_equal(normalize(image[..., 1].astype(np.uint16) * 257), grey)
    assert 0 < grey.min() < 0.5 < grey.max() <= 1
    np.testing.assert_allclose(2 * grey, np.minimum(decompose(image[..., 1]).v, 2))
