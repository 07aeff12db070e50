"""Lights by name, and what they render."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from relit.errors import OptionError
from relit.face.shape import FaceShape
from relit.light.rendering import render
from relit.photo.pixels import GAMMA
from relit.photo.profile import decode_srgb
from relit.settings.studio_lights import MOST_LAMPS, STUDIO_LIGHTS, Lamp, StudioLight, studio_light


def half_ball(radius=40, room=10):
    y, x = np.mgrid[-radius - room : radius + room + 1, -radius - room : radius + room + 1] / radius
    inside = np.hypot(x, y) < 1
    z = -np.sqrt(np.clip(1 - x**2 - y**2, 0, 1))
    normals = np.stack([x, y, z], axis=-1)
    normals /= np.maximum(np.linalg.norm(normals, axis=-1, keepdims=True), 1e-9)
    return FaceShape(normals.astype(np.float32), (z * radius).astype(np.float32), inside, inside)


@given(st.floats(-180, 180), st.floats(-90, 90))
def test_angles_are_read(azimuth, elevation):
    (lamp,) = studio_light(f"{azimuth:.6f}, {elevation:.6f}").lamps
    assert lamp.azimuth == pytest.approx(azimuth, abs=1e-6)
    assert lamp.elevation == pytest.approx(elevation, abs=1e-6)


def test_the_names_mean_what_they_meant():
    assert {name: (*light.lamps[0], light.fill) for name, light in STUDIO_LIGHTS.items()} == {
        "rembrandt": (-50, 38, 10, 1, (1, 1, 1), 0.12),
        "butterfly": (0, 48, 10, 1, (1, 1, 1), 0.2),
        "split": (-75, 5, 10, 1, (1, 1, 1), 0.12),
        "loop": (-32, 28, 10, 1, (1, 1, 1), 0.2),
        "rim": (-125, 25, 10, 1, (1, 1, 1), 0.25),
        "flat": (0, 0, 10, 1, (1, 1, 1), 0.6),
    }


def tenths(low, high):
    return st.integers(10 * low, 10 * high).map(lambda tenth: tenth / 10)


levels = st.tuples(*[st.integers(0, 255)] * 3).filter(any)
settings = st.fixed_dictionaries(
    {}, optional={"size": tenths(1, 60), "power": tenths(0, 10), "color": levels}
)
places = st.tuples(tenths(-180, 180), tenths(-90, 90)) | st.sampled_from(sorted(STUDIO_LIGHTS))


@given(
    lamps=st.lists(st.tuples(places, settings), min_size=1, max_size=5),
    sign=st.sampled_from(["", "+"]),
    room=st.sampled_from(["", " "]),
)
def test_several_lamps_are_read_as_they_were_written(lamps, sign, room):
    def written(value):
        return f"{room}{sign if value >= 0 else ''}{value}"

    texts = []
    for place, chosen in lamps:
        text = place if isinstance(place, str) else ",".join(map(written, place))
        for name, value in chosen.items():
            color = "#" + bytes(value).hex() if name == "color" else None
            text += f":{name}={color or written(value)}"
        texts.append(text)
    light = studio_light(f"{room}+".join(texts))
    assert len(light.lamps) == len(lamps)
    for (place, chosen), lamp in zip(lamps, light.lamps, strict=True):
        named = STUDIO_LIGHTS[place].lamps[0] if isinstance(place, str) else Lamp(*place)
        assert lamp[:2] == named[:2]
        assert lamp.size == chosen.get("size", 10)
        assert lamp.power == chosen.get("power", 1)
        red, green, blue = (decode_srgb(np.array(chosen.get("color", (9, 9, 9))) / 255)).tolist()
        assert lamp.color == pytest.approx(np.array([red, green, blue]) / max(red, green, blue))
    own = [STUDIO_LIGHTS[place].fill if isinstance(place, str) else 0.2 for place, _ in lamps]
    assert min(own) - 1e-9 <= light.fill <= max(own) + 1e-9


def test_fill_is_the_mean_by_power_or_what_is_given():
    assert studio_light("flat:power=3+rembrandt").fill == pytest.approx((3 * 0.6 + 0.12) / 4)
    assert studio_light("flat:power=0+0,0:power=0").fill == pytest.approx(0.4)
    assert studio_light("flat+rim", 0.0) == studio_light("flat+rim")._replace(fill=0.0)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("-30,20+sun", "expected one of rembrandt.*, got 'sun'"),
        ("-30,20+", "expected one of rembrandt.*, got '' in '-30,20\\+'"),
        ("-30,20++", "got '\\+' in '-30,20\\+\\+'"),
        ("loop:size=0.5", "lamp 'loop:size=0.5': expected a size of 1 to 60, degrees .*, got '0.5'"),
        ("loop:size=61", "expected a size of 1 to 60"),
        ("loop:size=nan", "expected a size of 1 to 60"),
        ("loop:power=-1", "expected a power of 0 to 10"),
        ("loop+rim:power=11", "lamp 'rim:power=11': expected a power of 0 to 10"),
        ("loop:power", "expected a power of 0 to 10, .*, got ''"),
        ("loop:color=red", "expected a color #rrggbb that is not black, got 'red'"),
        ("loop:color=#000000", "that is not black, got '#000000'"),
        ("loop:color=#fff", "that is not black, got '#fff'"),
        ("loop:hue=1", "expected size=, power= or color= after a colon, got 'hue'"),
        ("loop:", "expected size=, power= or color= after a colon, got ''"),
        ("loop:size=2:size=3", "expected one size, got several"),
        ("+".join(["0,0"] * (MOST_LAMPS + 1)), f"expected at most {MOST_LAMPS} lamps, got {MOST_LAMPS + 1}"),
    ],
)
def test_what_is_wrong_with_a_lamp_is_said(text, says):
    with pytest.raises(OptionError, match=f"^light: .*(?:{says})"):
        studio_light(text)


@given(st.text(alphabet="+-:=,.#0123456789 abcdefilmoprstuz", max_size=60))
def test_any_text_is_a_light_or_refused(text):
    try:
        light = studio_light(text)
    except OptionError:
        return
    assert all(abs(lamp.azimuth) <= 180 and abs(lamp.elevation) <= 90 for lamp in light.lamps)


@pytest.mark.parametrize("text", ["", "sun", "1", "1,2,3", "nan,0", "200,0", "0,-91", "1e9,0", "Rembrandt "])
def test_other_texts_are_refused(text):
    with pytest.raises(OptionError, match=r"^light: expected one of rembrandt.*AZ,EL"):
        studio_light(text)


@pytest.mark.parametrize("azimuth", [-60, 0, 35])
@pytest.mark.parametrize("elevation", [-20, 0, 40])
def test_a_ball_is_brightest_where_it_looks_into_the_lamp(azimuth, elevation):
    """A ball casts no shadow on itself: Lambert's law is all there is."""
    ball, ambient = half_ball(), 0.2
    image = render(ball, StudioLight((Lamp(azimuth, elevation),), ambient), 40.0)
    a, e = np.radians([azimuth, elevation])
    lamp = np.array([np.sin(a) * np.cos(e), -np.sin(e), -np.cos(a) * np.cos(e)])
    lambert = (1 - ambient) * np.maximum(ball.normals @ lamp, 0) + ambient
    core = ball.inside & (ball.normals[..., 2] < -0.3) & (lambert > ambient + 0.1)
    np.testing.assert_allclose(image[core] ** GAMMA, lambert[core], atol=0.06)


def test_a_ball_in_two_colours_has_each_where_it_looks_into_that_lamp():
    """Lambert's law for each lamp: the red one from the left, half as strong as the white one from above."""
    ball = half_ball()
    image = render(ball, studio_light("0,50+-60,0:power=0.5:color=#ff0000", 0.1), 40.0)
    assert image.shape == (*ball.inside.shape, 3)
    white, red = ([0, -np.sin(np.radians(50)), -np.cos(np.radians(50))], [-np.sqrt(0.75), 0, -0.5])
    both = np.maximum(ball.normals @ white, 0)[..., None] * np.ones(3)
    both += 0.5 * np.maximum(ball.normals @ red, 0)[..., None] * [1, 0, 0]
    # What looks into the white lamp gets 1 of it and 0.5 cos 50° cos 60° of the red one.
    expected = 0.9 * both / (1 + 0.5 * np.cos(np.radians(50)) * 0.5) + 0.1
    expected /= max(expected[ball.inside].max(), 1)
    core = (
        ball.inside
        & (ball.normals[..., 2] < -0.3)
        & (ball.normals @ white > 0.1)
        & (ball.normals @ red > 0.1)
    )
    np.testing.assert_allclose(image[core] ** GAMMA, expected[core], atol=0.06)


def test_filled_with_nothing_else_a_ball_is_even():
    image = render(half_ball(), studio_light("-60,20:color=#ff0000", 1.0), 40.0)
    np.testing.assert_allclose(image, 1)


def test_a_ridge_casts_its_shadow_away_from_the_lamp():
    x = np.mgrid[:80, :120][1]
    depth = np.where(np.abs(x - 60) < 4, -20.0, 0.0)
    normals = np.zeros((80, 120, 3), np.float32)
    normals[..., 2] = -1
    everywhere = np.ones((80, 120), bool)
    shape = FaceShape(normals, depth.astype(np.float32), everywhere, everywhere)
    image = render(
        shape, StudioLight((Lamp(45, 0),), 0.1), 40.0
    )  # from the right: the shadow is 20 px to the left
    dark, light = image[40, 45:52].max(), image[40, [20, 30, 75, 100]].min()
    assert dark < 0.7 * light
    mirrored = render(shape, StudioLight((Lamp(-45, 0),), 0.1), 40.0)
    np.testing.assert_allclose(mirrored[:, ::-1][:, 10:-10], image[:, 1:][:, 9:-10], atol=0.2)


def test_every_named_light_is_one_that_can_be_given_by_its_angles():
    for name, light in STUDIO_LIGHTS.items():
        assert studio_light(name) == light
        (lamp,) = light.lamps
        assert studio_light(f"{lamp.azimuth},{lamp.elevation}").lamps == (lamp,)
