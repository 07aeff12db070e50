"""What a preview tells of its light, against lights that were set by hand and the library's own lamps."""

import json

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from relit.light.dome import Lamps
from relit.light.lamps import studio_lamps, studio_points
from relit.settings.studio_lights import STUDIO_LIGHTS, Lamp, StudioLight, studio_light
from relit.studio.lights import even_share, listed, without_cast

lamp = st.builds(
    lambda azimuth, elevation, power: Lamp(azimuth, elevation, power=power),
    st.integers(-179, 179),
    st.integers(-89, 89),
    st.floats(0.5, 10),
)


def told(client, place, **options):
    answer = client.post(f"{place}/render", json={"options": options, "quick": True})
    assert answer.status_code == 200, answer.text
    lamps, fill, trust = (answer.headers[f"x-relit-{name}"] for name in ("lamps", "fill", "confidence"))
    return json.loads(lamps), fill, float(trust)


@given(st.lists(lamp, min_size=1, max_size=24))
def test_lamps_are_told_as_they_were_set_the_strongest_first(lamps):
    found = listed(studio_points(StudioLight(tuple(lamps))))
    assert len(found) == len(lamps)
    assert {one[:2] for one in found} == {one[:2] for one in lamps}
    powers = [power for *_, power, _ in found]
    assert powers == sorted(powers, reverse=True)
    assert powers[0] == 1
    strongest = max(one.power for one in lamps)
    np.testing.assert_allclose(sorted(powers), sorted(one.power / strongest for one in lamps), atol=1e-3)


@given(st.tuples(*[st.integers(0, 255)] * 2), st.integers(0, 2))
def test_a_bright_colour_is_told_as_it_was_set(levels, full):
    text = "#" + bytes([*levels[:full], 255, *levels[full:]]).hex()
    assert listed(studio_points(studio_light(f"0,0:color={text}"))) == [(0, 0, 1.0, text)]


def test_what_gives_no_light_is_not_told():
    assert listed(studio_points(studio_light("0,0:power=0"))) == []
    assert listed(studio_points(studio_light("0,0+rim:power=0"))) == [(0, 0, 1.0, "#ffffff")]
    random = np.random.default_rng(0)
    assert len(listed(Lamps(random.normal(size=(100, 3)) / 2, np.ones(100)))) == 24


@pytest.mark.parametrize("name", ["butterfly", "flat"])
def test_even_light_is_told_from_lamps_in_front_about_as_it_was_set(name):
    """Lamps in front reach, more or less, all sides that the camera sees; light from everywhere does too."""
    light = STUDIO_LIGHTS[name]
    shares = [even_share(studio_lamps(light._replace(fill=fill))) for fill in (light.fill, 0.9, 1.0)]
    assert shares == sorted(shares)
    assert 0.75 * light.fill < shares[0] < light.fill + 0.3


def test_without_their_cast_lamps_of_one_colour_are_white():
    lamps = studio_points(studio_light("0,0:color=#ff8020+rim:power=2:color=#ff8020"))
    np.testing.assert_allclose(without_cast(lamps).colors, lamps.weights[:, None] * np.ones(3))


def test_a_light_by_name_is_told(client, place):
    assert told(client, place, light="rembrandt") == ([[-50, 38, 1.0, "#ffffff"]], "0.120", 1.0)
    light = "0,0:color=#ff8000+90,0:power=0.5"
    lamps, fill, _ = told(client, place, light=light, tilt=30, turn=-20, fill=0.4)
    assert (lamps, fill) == ([[-20, 30, 1.0, "#ff8000"], [70, 0, 0.5, "#ffffff"]], "0.400")
    soft, fill, _ = told(client, place, light="rembrandt", softness=0.5)
    assert (len(soft), fill) == (24, "0.120")
    assert told(client, place, light="loop", method="ltv")[:2] == ([[-32, 28, 1.0, "#ffffff"]], "0.200")


def test_the_light_of_a_reference_is_told(client, place):
    lamps, fill, trust = told(client, place)
    assert 1 < len(lamps) <= 24
    assert lamps[0][2] == 1.0
    assert 0 < float(fill) < 1
    assert 0 < trust < 1
    assert told(client, place, fill=0.25) == (lamps, "0.250", trust)
    assert told(client, place, method="ltv") == ([], "", 1.0)
