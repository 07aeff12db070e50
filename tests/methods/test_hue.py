"""What a target's coloured light leaves unexplained is light, and in white light it is make-up."""

from types import SimpleNamespace

import numpy as np
import pytest

from relit.face.regions import FaceRegions
from relit.methods.hue import hue_change, without_noise
from relit.photo.color import LUMA_WEIGHTS
from relit.photo.profile import decode_srgb, encode_srgb

SKIN = np.array([1.3, 0.9, 0.8])


def hue_of(light):
    return np.log(light / (light @ LUMA_WEIGHTS)[..., None])


@pytest.fixture
def patched(ball):
    """Return what takes how much a light's hue varies, and gives a scene, that hue, and a patch in it."""
    landmarks, normals, inside = ball
    face = FaceRegions(landmarks, inside.shape)
    y, x = np.mgrid[: inside.shape[0], : inside.shape[1]] - 50
    patch = 0.3 * np.exp(-(x**2 + y**2) / (2 * (0.25 * face.interocular_distance) ** 2))

    def scene_of(varying):
        reddish = np.array([1, -0.3, -0.3])
        lamps = (varying * normals[..., :1] * reddish).astype(np.float32)
        light = 0.3 * SKIN * np.exp(lamps + patch[..., None] * reddish)
        own = hue_of(SKIN * np.exp(lamps)) - hue_of(SKIN)
        target = encode_srgb((light / (light @ LUMA_WEIGHTS)[..., None] * 0.3).astype(np.float32))
        scene = SimpleNamespace(
            rendered=False, target=target, encoded=True, face=face, skin=inside.astype(np.float32)
        )
        return scene, own.astype(np.float32), patch

    return scene_of


def left_of_the_patch(scene, own, patch):
    """Return what is left of a patch under white light, as a share."""
    hue, cast = hue_change(
        scene, without_noise(decoded(scene), scene.face.interocular_distance), np.zeros_like(own), own, 0.0
    )
    found = np.log(decoded(scene) / (decoded(scene) @ LUMA_WEIGHTS)[..., None]) + hue + cast
    middle = (patch > 0.9 * patch.max()) & (scene.skin > 0)
    rim = (patch < 0.1 * patch.max()) & (scene.skin > 0)
    red = found[..., 0] - found[..., 2]
    return (red[middle].mean() - red[rim].mean()) / (1.3 * patch[middle].mean())


def decoded(scene):
    return decode_srgb(scene.target)


def test_a_patch_goes_with_the_coloured_light_that_made_it(patched):
    assert left_of_the_patch(*patched(0.3)) < 0.5


def test_make_up_stays_in_white_light(patched):
    assert left_of_the_patch(*patched(0.0)) == pytest.approx(1, abs=0.03)


def test_the_less_an_own_light_is_coloured_the_more_is_the_persons(patched):
    left = [left_of_the_patch(*patched(varying)) for varying in (0.02, 0.05, 0.1, 0.2)]
    assert left == sorted(left, reverse=True)


def test_grey_light_has_no_hue():
    hue, cast = hue_change(SimpleNamespace(), np.zeros((2, 2), np.float32), None, None, 0.1)
    assert hue is None
    assert not cast.any()
