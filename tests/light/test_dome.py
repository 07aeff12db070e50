"""Lamps on a dome: found again on surfaces that were lit by known ones."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import lsq_linear

from relit.face.shape import face_shape
from relit.light.dome import DOME, Lamps, fit_lamps, surface_of


def on_a_ball(count=3000, seed=0):
    """Normals all over the front of a ball."""
    x, y = np.random.default_rng(seed).uniform(-0.95, 0.95, (2, 2 * count))
    seen = x**2 + y**2 < 0.9
    x, y = x[seen][:count], y[seen][:count]
    return np.stack([x, y, -np.sqrt(1 - x**2 - y**2)], axis=1)


NORMALS = on_a_ball()
BASIS = np.maximum(NORMALS @ DOME.T, 0)
ALL = np.ones(len(NORMALS))


def toward(azimuth, elevation):
    a, e = np.radians([azimuth, elevation])
    return np.array([np.sin(a) * np.cos(e), -np.sin(e), -np.cos(a) * np.cos(e)])


def test_the_dome_is_even_and_open_behind():
    np.testing.assert_allclose(np.linalg.norm(DOME, axis=1), 1)
    assert DOME[:, 2].min() < -0.98
    assert 0.25 < DOME[:, 2].max() < 0.3  # a third of the way behind the head
    angles = np.degrees(np.arccos(np.clip(DOME @ DOME.T, -1, 1)))
    np.fill_diagonal(angles, 180)
    nearest = angles.min(axis=1)
    assert nearest.max() < 1.6 * nearest.min()


@pytest.mark.parametrize("angles", [(0, 0), (-60, 10), (45, 40), (80, -20), (0, 60)])
def test_a_lamp_is_found_where_it_stands(angles):
    there = toward(*angles)
    brightness = np.maximum(NORMALS @ there, 0)
    lamps = fit_lamps(BASIS, brightness, ALL)
    assert lamps.min() >= 0
    found = lamps @ DOME
    assert np.degrees(np.arccos(found @ there / np.linalg.norm(found))) < 8
    assert np.abs(BASIS @ lamps - brightness).mean() < 0.03


def test_two_lamps_are_told_apart():
    brightness = NORMALS @ toward(-60, 0)
    brightness = np.maximum(brightness, 0) + 0.4 * np.maximum(NORMALS @ toward(60, 0), 0)
    lamps = fit_lamps(BASIS, brightness, ALL)
    left, right = (lamps[DOME[:, 0] * side > 0.4].sum() for side in (-1, 1))
    assert right / left == pytest.approx(0.4, abs=0.1)
    assert lamps[np.abs(DOME[:, 0]) < 0.2].sum() < 0.2 * (left + right)


def test_highlights_and_features_are_passed_over():
    """A tenth of the face is black or white: least squares would go astray, and this does not."""
    brightness = np.maximum(NORMALS @ toward(-50, 20), 0) + 0.05
    plain = fit_lamps(BASIS, brightness, ALL)
    spoiled = brightness.copy()
    spoiled[:150], spoiled[150:300] = 0, 2
    robust = fit_lamps(BASIS, spoiled, ALL)
    square = lsq_linear(BASIS, spoiled, (0, np.inf)).x
    off, off_square = (np.abs(BASIS @ (one - plain)).mean() for one in (robust, square))
    assert off < 0.02
    assert off < 0.5 * off_square


def test_what_does_not_count_is_not_looked_at():
    brightness = np.maximum(NORMALS @ toward(-50, 20), 0)
    weight = (NORMALS[:, 1] < 0.5).astype(float)
    spoiled = np.where(weight > 0, brightness, 5.0)
    shown = weight > 0
    fits = [fit_lamps(BASIS, one, weight) for one in (spoiled, np.where(shown, brightness, 0.0))]
    # The scale is the only thing that either could reach, and it cancels out but for rounding.
    np.testing.assert_allclose(BASIS[shown] @ fits[0], BASIS[shown] @ fits[1], atol=0.02)


@settings(max_examples=15)
@given(seed=st.integers(0, 2**32 - 1), factor=st.floats(0.01, 50))
def test_twice_as_bright_a_face_has_lamps_twice_as_strong(seed, factor):
    random = np.random.default_rng(seed)
    some = random.choice(len(NORMALS), 600, replace=False)
    brightness = BASIS[some] @ (random.random(100) ** 4) * np.exp(random.normal(0, 0.1, 600))
    one, other = (fit_lamps(BASIS[some], scale * brightness, ALL[some]) for scale in (1.0, factor))
    assert one.min() >= 0
    assert other.min() >= 0
    # In single precision, lamps that stand side by side are told apart to a thousandth.
    np.testing.assert_allclose(other / factor, one, atol=2e-3 * one.max() + 1e-9)


def test_tied_to_a_prior_the_fit_keeps_to_it():
    prior = np.linspace(0, 1, 100)
    brightness = np.maximum(NORMALS @ toward(-50, 20), 0)
    tight, loose = (fit_lamps(BASIS, brightness, ALL, prior=prior, tied=tied) for tied in (1e5, 1e-3))
    np.testing.assert_allclose(tight, prior, atol=0.01)
    assert np.abs(loose - prior).mean() > 0.1


def test_darkness_has_no_lamps():
    assert np.isfinite(fit_lamps(BASIS, np.zeros(len(BASIS)), ALL)).all()
    assert fit_lamps(BASIS, np.zeros(len(BASIS)), ALL).max() < 1e-6
    assert np.isfinite(fit_lamps(BASIS, np.ones(len(BASIS)), np.zeros(len(BASIS)))).all()


def test_a_surface_is_lit_as_lambert_says(ball):
    """A ball hides nothing from itself but what looks away."""
    landmarks, normals, face = ball
    surface = surface_of(face_shape(landmarks, face.shape), landmarks.interocular_distance)
    there = toward(-30, 10)
    lamps = Lamps(there[None], np.array([0.7]), np.array([[0.9, 0.6, 0.3]]))
    made = surface.lit(lamps)
    assert made.shape == (*face.shape, 4)
    wanted = 0.7 * np.maximum(normals @ there, 0)
    np.testing.assert_allclose(made[..., 0][face], wanted[face], atol=0.05)
    np.testing.assert_allclose(made[..., 1:][face], made[..., :1][face] / 0.7 * [0.9, 0.6, 0.3], rtol=1e-4)
    assert surface.lit(lamps._replace(colors=None)).shape == (*face.shape, 1)


def test_light_adds_up(ball):
    landmarks, _, face = ball
    surface = surface_of(face_shape(landmarks, face.shape), landmarks.interocular_distance)
    random = np.random.default_rng(0)
    first, second = random.random((2, 100))
    both = surface.lit(Lamps(DOME, first + second))
    apart = surface.lit(Lamps(DOME, first)) + surface.lit(Lamps(DOME, second))
    np.testing.assert_allclose(both, apart, rtol=1e-4)
    # Lamps that happen to stand as the dome's do are no others.
    np.testing.assert_allclose(
        surface.lit(Lamps(DOME.copy(), first)), surface.lit(Lamps(DOME, first)), rtol=1e-5
    )


def test_a_large_face_is_looked_at_as_coarsely_as_shadows_are_soft(ball):
    landmarks, _, face = ball
    shape = face_shape(landmarks, face.shape)
    fine, coarse = surface_of(shape, 40.0), surface_of(shape, 120.0)
    assert (fine.factor, coarse.factor) == (1, 3)
    assert coarse.normals.shape[:2] == (34, 34)
    lamps = Lamps(DOME, np.random.default_rng(0).random(100))
    made = coarse.lit(lamps)
    assert made.shape == (34, 34, 1)
    enlarged = coarse.enlarged(made)
    assert enlarged.shape == (*face.shape, 1)
    np.testing.assert_allclose(enlarged[1:100:3, 1:100:3], made[:33, :33], rtol=1e-4)
