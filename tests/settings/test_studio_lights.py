"""Lights by name, and what they render."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from relit.errors import OptionError
from relit.face.shape import FaceShape
from relit.light.rendering import render
from relit.photo.pixels import GAMMA
from relit.settings.studio_lights import STUDIO_LIGHTS, StudioLight, studio_light


def half_ball(radius=40, room=10):
    y, x = np.mgrid[-radius - room : radius + room + 1, -radius - room : radius + room + 1] / radius
    inside = np.hypot(x, y) < 1
    z = -np.sqrt(np.clip(1 - x**2 - y**2, 0, 1))
    normals = np.stack([x, y, z], axis=-1)
    normals /= np.maximum(np.linalg.norm(normals, axis=-1, keepdims=True), 1e-9)
    return FaceShape(normals.astype(np.float32), (z * radius).astype(np.float32), inside, inside)


@given(st.floats(-180, 180), st.floats(-90, 90))
def test_angles_are_read(azimuth, elevation):
    light = studio_light(f"{azimuth:.6f}, {elevation:.6f}")
    assert light.azimuth == pytest.approx(azimuth, abs=1e-6)
    assert light.elevation == pytest.approx(elevation, abs=1e-6)


@pytest.mark.parametrize("text", ["", "sun", "1", "1,2,3", "nan,0", "200,0", "0,-91", "1e9,0", "Rembrandt "])
def test_other_texts_are_refused(text):
    with pytest.raises(OptionError, match=r"^light: expected one of rembrandt.*AZ,EL"):
        studio_light(text)


@pytest.mark.parametrize("azimuth", [-60, 0, 35])
@pytest.mark.parametrize("elevation", [-20, 0, 40])
def test_a_ball_is_brightest_where_it_looks_into_the_lamp(azimuth, elevation):
    """A ball casts no shadow on itself: Lambert's law is all there is."""
    ball, ambient = half_ball(), 0.2
    image = render(ball, StudioLight(azimuth, elevation, ambient), 40.0)
    a, e = np.radians([azimuth, elevation])
    lamp = np.array([np.sin(a) * np.cos(e), -np.sin(e), -np.cos(a) * np.cos(e)])
    lambert = (1 - ambient) * np.maximum(ball.normals @ lamp, 0) + ambient
    core = ball.inside & (ball.normals[..., 2] < -0.3) & (lambert > ambient + 0.1)
    np.testing.assert_allclose(image[core] ** GAMMA, lambert[core], atol=0.06)


def test_a_ridge_casts_its_shadow_away_from_the_lamp():
    x = np.mgrid[:80, :120][1]
    depth = np.where(np.abs(x - 60) < 4, -20.0, 0.0)
    normals = np.zeros((80, 120, 3), np.float32)
    normals[..., 2] = -1
    everywhere = np.ones((80, 120), bool)
    shape = FaceShape(normals, depth.astype(np.float32), everywhere, everywhere)
    image = render(shape, StudioLight(45, 0, 0.1), 40.0)  # from the right: the shadow is 20 px to the left
    dark, light = image[40, 45:52].max(), image[40, [20, 30, 75, 100]].min()
    assert dark < 0.7 * light
    mirrored = render(shape, StudioLight(-45, 0, 0.1), 40.0)
    np.testing.assert_allclose(mirrored[:, ::-1][:, 10:-10], image[:, 1:][:, 9:-10], atol=0.2)


def test_every_named_light_is_one_that_can_be_given_by_its_angles():
    for name, light in STUDIO_LIGHTS.items():
        assert studio_light(name) is light
        assert studio_light(f"{light.azimuth},{light.elevation}")[:2] == (light.azimuth, light.elevation)
