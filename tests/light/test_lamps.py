"""Lights that a person sets, against where their lamps stand and what they do to a surface."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from relit.light.dome import DOME, Lamps
from relit.light.lamps import (
    filled,
    moved,
    panorama,
    softened,
    strengths,
    studio_lamps,
    studio_points,
    tilted,
    turned,
)
from relit.settings.studio_lights import STUDIO_LIGHTS, Lamp, StudioLight, studio_light

angle = st.floats(-180, 180)


def toward(azimuth, elevation):
    a, e = np.radians([azimuth, elevation])
    return np.array([np.sin(a) * np.cos(e), -np.sin(e), -np.cos(a) * np.cos(e)])


def some_lamps(seed=0, colored=True):
    random = np.random.default_rng(seed)
    directions = random.normal(size=(7, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    return Lamps(directions, random.random(7), random.random((7, 3)) if colored else None)


@given(degrees=angle, azimuth=angle, elevation=st.floats(-89, 89))
def test_turning_adds_to_the_azimuth(degrees, azimuth, elevation):
    lamp = Lamps(toward(azimuth, elevation)[None], np.ones(1))
    np.testing.assert_allclose(
        turned(lamp, degrees).directions[0], toward(azimuth + degrees, elevation), atol=1e-9
    )


@given(degrees=angle, seed=st.integers(0, 1000))
def test_turning_back_or_all_the_way_round_changes_nothing(degrees, seed):
    lamps = some_lamps(seed)
    there_and_back = turned(turned(lamps, degrees), -degrees)
    np.testing.assert_allclose(there_and_back.directions, lamps.directions, atol=1e-9)
    round_it = turned(turned(lamps, 180), 180)
    np.testing.assert_allclose(round_it.directions, lamps.directions, atol=1e-9)
    once, twice = turned(turned(lamps, degrees / 2), degrees / 2), turned(lamps, degrees)
    np.testing.assert_allclose(once.directions, twice.directions, atol=1e-9)
    assert twice.weights is lamps.weights
    assert twice.colors is lamps.colors


def test_turned_by_nothing_lamps_are_the_same():
    lamps = some_lamps()
    assert turned(lamps, 0.0) is lamps
    assert softened(lamps, 0.0) is lamps


@given(softness=st.floats(0, 1, exclude_min=True), seed=st.integers(0, 1000))
def test_softened_light_is_as_much_light(softness, seed):
    lamps = some_lamps(seed)
    soft = softened(lamps, softness)
    assert soft.weights.min() >= 0
    np.testing.assert_allclose(soft.weights.sum(), lamps.weights.sum())
    np.testing.assert_allclose(soft.colors.sum(axis=0), lamps.colors.sum(axis=0))
    assert softened(some_lamps(seed, colored=False), softness).colors is None


def test_the_softer_the_less_it_comes_from_one_side():
    lamp = Lamps(toward(-40, 10)[None], np.ones(1))
    lengths = [np.linalg.norm(one.weights @ one.directions) for one in map(soft_of(lamp), (0, 0.3, 0.6, 1))]
    assert lengths[0] == pytest.approx(1)
    assert lengths == sorted(lengths, reverse=True)
    middle = softened(lamp, 0.3)
    towards = middle.weights @ middle.directions
    assert towards @ toward(-40, 10) / np.linalg.norm(towards) > np.cos(np.radians(8))


def soft_of(lamp):
    return lambda softness: softened(lamp, softness)


@given(azimuth=st.floats(-175, 175), elevation=st.floats(-75, 75))
def test_a_panorama_is_brightest_where_the_lamp_stands(azimuth, elevation):
    picture = panorama(Lamps(toward(azimuth, elevation)[None], np.ones(1)), 36)
    assert picture.shape == (36, 72, 3)
    assert picture.max() == 1
    row, column = np.unravel_index(picture[..., 0].argmax(), (36, 72))
    # A pixel is five degrees; the middle is the camera's, above is above.
    assert 90 - 5 * (row + 0.5) == pytest.approx(elevation, abs=2.6)
    assert 5 * (column + 0.5) - 180 == pytest.approx(azimuth, abs=2.6)


def test_a_panorama_has_the_lamps_colours():
    directions = np.stack([toward(-90, 0), toward(90, 0)])
    picture = panorama(Lamps(directions, np.ones(2), np.array([[1.0, 0.5, 0.1], [0.1, 0.5, 1.0]])), 36)
    np.testing.assert_allclose(picture[18, 18] / picture[18, 18, 0], [1, 0.5, 0.1], atol=1e-3)
    np.testing.assert_allclose(picture[18, 54] / picture[18, 54, 2], [0.1, 0.5, 1], atol=1e-3)
    assert not panorama(Lamps(DOME, np.zeros(100)), 8).any()


@pytest.mark.parametrize("name", STUDIO_LIGHTS)
def test_what_looks_into_a_studio_light_is_as_bright_as_white(name):
    """The lamp's share and that of the light from everywhere come to 1 of a surface that looks at the lamp.

    Light from everywhere is even on the front, so that nothing that the camera sees is without.
    """
    light = STUDIO_LIGHTS[name]
    lamps = studio_lamps(light)
    assert lamps.colors is None
    assert lamps.weights.min() >= 0

    def brightness(normal, part=slice(None)):
        return float(np.maximum(lamps.directions[part] @ normal, 0) @ lamps.weights[part])

    even = slice(-100, None)
    front = np.array([0.0, 0.0, -1.0])
    assert brightness(front, even) == pytest.approx(light.fill)
    lamp = brightness(toward(*light.lamps[0][:2]), slice(0, -100))
    assert lamp == pytest.approx(1 - light.fill, rel=0.02)
    facing = max(-toward(*light.lamps[0][:2])[2], 0)
    assert brightness(front) == pytest.approx((1 - light.fill) * facing + light.fill, abs=0.02)
    for side in ((-45, 0), (45, 0), (0, 45), (0, -45)):
        assert brightness(toward(*side), even) == pytest.approx(light.fill, rel=0.25)


@given(azimuth=angle, elevation=st.floats(-90, 90))
def test_rays_keep_within_the_lamp(azimuth, elevation):
    light = StudioLight((Lamp(azimuth, elevation, 10.0),), 0.2)
    rays = studio_lamps(light).directions[:-100]
    np.testing.assert_allclose(np.linalg.norm(rays, axis=1), 1)
    off = np.degrees(np.arccos(np.clip(rays @ toward(azimuth, elevation), -1, 1)))
    assert off.max() == pytest.approx(10, abs=0.01)
    np.testing.assert_allclose(
        rays.mean(axis=0) / np.linalg.norm(rays.mean(axis=0)), toward(azimuth, elevation), atol=1e-9
    )


def test_named_lights_have_their_sides():
    for name, sign in (("rembrandt", -1), ("split", -1), ("loop", -1), ("butterfly", 0), ("flat", 0)):
        lamps = studio_lamps(studio_light(name))
        x = (lamps.weights[:-100] @ lamps.directions[:-100])[0]
        assert np.sign(round(x, 6)) == sign


@given(tilt=st.floats(-90, 90), elevation=st.floats(-89, 89))
def test_tilting_what_stands_in_front_adds_to_the_elevation(tilt, elevation):
    lamp = Lamps(toward(0, elevation)[None], np.ones(1))
    np.testing.assert_allclose(tilted(lamp, tilt).directions[0], toward(0, elevation + tilt), atol=1e-9)
    np.testing.assert_allclose(tilted(tilted(lamp, tilt), -tilt).directions, lamp.directions, atol=1e-9)


@given(tilt=st.floats(-90, 90), turn=angle, azimuth=angle, elevation=st.floats(-90, 90))
def test_a_light_by_name_moves_as_lamps_do(tilt, turn, azimuth, elevation):
    light = StudioLight((Lamp(azimuth, elevation), Lamp(-elevation, 30, 20, 3)))
    there = studio_points(moved(light, tilt, turn))
    np.testing.assert_allclose(
        there.directions, turned(tilted(studio_points(light), tilt), turn).directions, atol=1e-7
    )
    assert [lamp[2:] for lamp in moved(light, tilt, turn).lamps] == [lamp[2:] for lamp in light.lamps]


def test_unmoved_a_light_is_the_same():
    assert moved(studio_light("loop+rim"), 0.0, 0.0) == studio_light("loop+rim")
    lamps = some_lamps()
    assert tilted(lamps, 0.0) is lamps


def ball():
    x, y = np.random.default_rng(0).uniform(-0.7, 0.7, (2, 500))
    return np.stack([x, y, -np.sqrt(1 - x**2 - y**2)], axis=1)


def lit(lamps, normals):
    """Return what lamps make of a white ball by Lambert's law, (n, 3)."""
    colors = lamps.weights[:, None] * np.ones(3) if lamps.colors is None else lamps.colors
    return np.maximum(normals @ lamps.directions.T, 0) @ colors


def test_two_coloured_lamps_light_a_ball_as_worked_out_by_hand():
    lamps = studio_lamps(
        studio_light("-40,10:size=1:color=#ff8000+50,-20:size=1:power=0.5:color=#0000ff", 0.0)
    )
    orange, blue = np.array([1, ((128 / 255 + 0.055) / 1.055) ** 2.4, 0]), np.array([0, 0, 1])
    first, second = toward(-40, 10), toward(50, -20)
    most = max(1 + 0.5 * max(first @ second, 0), 0.5 + max(first @ second, 0))
    normals = ball()
    expected = np.maximum(normals @ first, 0)[:, None] * orange
    expected += 0.5 * np.maximum(normals @ second, 0)[:, None] * blue
    np.testing.assert_allclose(lit(lamps, normals), expected / most, atol=5e-3)
    np.testing.assert_allclose(lamps.weights, lamps.colors @ [0.299, 0.587, 0.114])


def test_fill_lights_what_no_lamp_reaches():
    for light in (studio_light("-90,0:color=#ff0000", 0.3), studio_light("-90,0+-80,0", 0.3)):
        away = lit(studio_lamps(light), toward(20, 0)[None])
        np.testing.assert_allclose(away, 0.3, rtol=0.1)
        assert np.ptp(away) < 1e-12 or light.colored


def test_filled_with_nothing_else_light_is_even():
    even = studio_lamps(studio_light("-60,20:color=#ff0000+rim", 1.0))
    made = lit(even, ball())
    assert np.ptp(made) < 0.25
    np.testing.assert_allclose(made, made[:, :1] * np.ones(3))
    np.testing.assert_allclose(
        lit(filled(some_lamps(), 1.0), ball()).max(axis=0), made.max() * front(some_lamps())
    )


def front(lamps):
    return lit(lamps, np.array([[0.0, 0.0, -1.0]]))[0]


@given(share=st.floats(0, 1), seed=st.integers(0, 1000), colored=st.booleans())
def test_filled_light_keeps_what_faces_the_camera(share, seed, colored):
    lamps = some_lamps(seed, colored)
    full = filled(lamps, share)
    np.testing.assert_allclose(front(full), front(lamps))
    np.testing.assert_allclose(full.weights[:-100], (1 - share) * lamps.weights)
    assert np.ptp(full.weights[-100:]) < 1e-12
    assert (full.colors is None) is not colored


def test_lamps_share_what_looks_into_the_brightest_place():
    np.testing.assert_allclose(strengths(studio_light("-90,0+90,0:power=4")), [0.25, 1])
    np.testing.assert_allclose(strengths(studio_light("-30,0+30,0")), 1 / 1.5)
    np.testing.assert_allclose(strengths(studio_light("0,0:power=0+rim:power=0")), 0)
    dark = studio_lamps(studio_light("0,0:power=0", 0.5))
    np.testing.assert_allclose(lit(dark, np.array([[0.0, 0.0, -1.0]])), 0.5)
