"""Lights that are found against lights that were set."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from relit.light.lambertian import Light, fit_light


def half_ball():
    y, x = (np.mgrid[:60, :60] - 29.5) / 30
    inside = x**2 + y**2 < 0.95
    normals = np.dstack([x, y, -np.sqrt(np.maximum(1 - x**2 - y**2, 0))])
    return normals, inside


@given(
    azimuth=st.floats(-1.3, 1.3),
    elevation=st.floats(-0.9, 0.9),
    direct=st.floats(0.1, 0.8),
    ambient=st.floats(0, 0.3),
)
def test_a_light_is_found_again(azimuth, elevation, direct, ambient):
    normals, inside = half_ball()
    towards = [np.sin(azimuth) * np.cos(elevation), np.sin(elevation), -np.cos(azimuth) * np.cos(elevation)]
    light = Light(direct * np.array(towards), ambient)
    found = fit_light(light.on(normals), normals, inside)
    np.testing.assert_allclose(found.direct, light.direct, atol=0.02)
    assert found.ambient == pytest.approx(ambient, abs=0.02)
    assert found.strength == pytest.approx(direct + ambient, abs=0.02)
    assert found.slant == pytest.approx(np.hypot(towards[0], towards[1]), abs=0.03)


def test_shadows_and_features_do_not_mislead_it():
    normals, inside = half_ball()
    light = Light(np.array([-0.3, -0.1, -0.5]), 0.1)
    image = light.on(normals)
    image[20:35, 35:50] = 0.1  # a cast shadow
    image[40:44, 20:40] *= 0.4  # a mouth
    image[10:13, 20:23] = 1  # a highlight
    found = fit_light(image, normals, inside)
    np.testing.assert_allclose(found.direct, light.direct, atol=0.05)
    assert found.ambient == pytest.approx(0.1, abs=0.05)


def test_even_light_and_none_are_lights():
    normals, inside = half_ball()
    even = fit_light(np.full(inside.shape, 0.4), normals, inside)
    np.testing.assert_allclose(even.on(normals)[inside], 0.4, atol=1e-3)
    none = fit_light(np.zeros(inside.shape), normals, inside)
    assert none.strength == pytest.approx(0, abs=1e-9)
    assert none.slant == 0


def test_sensitivity_is_the_derivative_of_the_logarithm():
    light = Light(np.array([-0.4, 0, -0.3]), 0.1)
    angle = np.linspace(-1.0, 0.5, 60)
    arc = np.stack([np.sin(angle), 0 * angle, -np.cos(angle)], axis=-1)  # turns in the plane of the light
    slope = np.gradient(np.log(light.on(arc)), angle)
    np.testing.assert_allclose(light.sensitivity(arc)[2:-2], np.abs(slope)[2:-2], atol=0.02)
