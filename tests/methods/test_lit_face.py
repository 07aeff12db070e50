"""A face explained by lamps: balls of known albedo in known light."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from relit.face.shape import face_shape
from relit.light.dome import DOME, Lamps
from relit.methods.lit_face import brightness_of, explain, linear, shown

LEFT, FRONT = np.array([-0.8, 0.0, -0.6]), np.array([0.0, 0.0, -1.0])


def srgb(light):
    """The curve of IEC 61966-2-1."""
    return np.where(light <= 0.0031308, 12.92 * light, 1.055 * np.maximum(light, 0) ** (1 / 2.4) - 0.055)


@pytest.fixture
def explained(ball):
    """Return what explains a ball of these linear planes, and the ball."""
    landmarks, normals, face = ball
    shape = face_shape(landmarks, face.shape)

    def explain_it(light, encoded=True):
        planes = srgb(light) if encoded else light
        return explain(
            planes, shape, face.astype(np.float32), landmarks.interocular_distance, encoded=encoded
        )

    return explain_it, normals, face


@pytest.mark.parametrize("encoded", [True, False])
@pytest.mark.parametrize("towards", [LEFT, FRONT])
def test_the_shading_of_a_ball_is_found(explained, encoded, towards):
    explain_it, normals, face = explained
    shade = 0.6 * np.maximum(normals @ towards, 0) + 0.05
    found = explain_it(shade, encoded)
    made, hue = found.shading(found.lamps)
    assert hue is None
    lit = face & (shade > 0.1)
    assert np.abs(np.exp(made[lit]) - shade[lit]).mean() < 0.03
    assert np.abs(found.unexplained[lit]).mean() < 0.08
    there = found.lamps.weights @ DOME
    assert there @ towards / np.linalg.norm(there) > np.cos(np.radians(12))
    assert found.most() == pytest.approx(np.quantile(shade[face], 0.99), rel=0.1)


def test_albedo_is_what_is_left_unexplained(explained):
    explain_it, normals, face = explained
    y, x = np.indices(face.shape)
    albedo = np.where(np.hypot(y - 60, x - 40) < 6, 0.5, 1.0)
    found = explain_it(0.6 * albedo * (np.maximum(normals @ LEFT, 0) + 0.1))
    off = found.unexplained
    spot = np.hypot(y - 60, x - 40) < 4
    assert np.median(off[face]) == pytest.approx(0, abs=0.01)
    assert off[spot].mean() == pytest.approx(np.log(0.5), abs=0.12)


def test_two_lamps_of_two_colours_are_found(explained):
    explain_it, normals, face = explained
    warm, cold = np.array([0.6, 0.4, 0.25]), np.array([0.2, 0.3, 0.5])
    right = LEFT * [-1, 1, 1]
    light = np.maximum(normals @ LEFT, 0)[..., None] * warm + np.maximum(normals @ right, 0)[..., None] * cold
    found = explain_it(light + 0.02)
    hue = found.shading(found.lamps)[1]
    true = np.log((light + 0.02) / brightness_of(light + 0.02)[..., None])
    assert np.abs(hue - true)[face].mean() < 0.06
    assert np.ptp((hue[..., 0] - hue[..., 2])[50, 20:80]) > 1


def test_light_of_one_colour_has_no_hue_of_its_own(explained):
    explain_it, normals, face = explained
    light = (np.maximum(normals @ LEFT, 0) + 0.1)[..., None] * np.array([0.6, 0.4, 0.25])
    found = explain_it(light)
    hue = found.shading(found.lamps)[1]
    assert hue[face].std(axis=0).max() < 0.03
    np.testing.assert_allclose(
        hue[face].mean(axis=0), np.log(light / brightness_of(light)[..., None])[50, 40], atol=0.05
    )


def test_shading_keeps_within_its_limits(explained):
    explain_it, _, face = explained
    found = explain_it(np.full(face.shape, 0.3))
    lamp = Lamps(np.array([[1.0, 0, 0]]), np.ones(1), np.array([[1.0, 0.5, 0.2]]))
    shade, hue = found.shading(lamp)
    made = found.surface.lit(lamp)[..., 0]
    least = 0.05 if found.encoded else 0.02
    assert np.exp(shade).min() == pytest.approx(least * np.quantile(made[face], 0.95), rel=1e-4)
    assert np.exp(found.shading(lamp, 0.4)[0]).max() == pytest.approx(0.4)
    # In the dark, the hue is that of the light as a whole, and not noise.
    dark = made < 1e-6
    assert dark.sum() > 100
    np.testing.assert_allclose(np.exp(hue[dark]), np.broadcast_to([1, 0.5, 0.2], (dark.sum(), 3)), rtol=0.01)


def test_the_more_is_left_the_less_is_explained(explained):
    explain_it, normals, face = explained
    plain = np.maximum(normals @ FRONT, 0) + 0.2
    spots = plain * np.where(np.indices(face.shape).sum(axis=0) // 12 % 2, 1.0, 0.3)
    well, badly = explain_it(plain).explained, explain_it(spots).explained
    assert 0.9 < well <= 1
    # Half of the face lies log(1/.3) below the other: what is left spreads by half of that.
    assert badly == pytest.approx(1 / (1 + (np.log(1 / 0.3) / 2 / 0.3) ** 2), abs=0.1)


@given(st.lists(st.floats(0, 1), min_size=1, max_size=20), st.booleans())
def test_encoding_is_the_inverse(values, encoded):
    planes = np.array(values, np.float32)[None]
    np.testing.assert_allclose(
        shown(linear(planes, encoded), encoded), np.maximum(planes, 0.5 / 255), atol=1e-5
    )
    if encoded:
        np.testing.assert_allclose(srgb(linear(planes, True)), np.maximum(planes, 0.5 / 255), atol=1e-4)


def test_no_skin_at_all_is_no_failure(ball):
    landmarks, _, face = ball
    shape = face_shape(landmarks, face.shape)
    for value in (0.0, 0.5, 1.0):
        planes = np.full((*face.shape, 3), value)
        found = explain(planes, shape, np.zeros(face.shape, np.float32), 40.0, encoded=True)
        assert np.isfinite(found.unexplained).all()
        assert np.isfinite(found.shading(found.lamps)[1]).all()
        again = dataclasses.replace(found, weight=np.ones(face.shape, np.float32))
        assert np.isfinite(again.unexplained).all()
