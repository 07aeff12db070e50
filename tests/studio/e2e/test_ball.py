"""The light ball: its map, its shading, and the hands that move its lamps."""

import numpy as np
import pytest

from tests.studio.e2e.page import drag, drawn, touch, until

pytestmark = [pytest.mark.e2e, pytest.mark.slow, pytest.mark.rotating]

SIDE, MARGIN = 200, 10
RADIUS = (SIDE / 2 - MARGIN) / np.sqrt(2)
KEY = {"azimuth": -30, "elevation": 20, "color": "#ffffff", "size": 10}
RIM = {"azimuth": 120, "elevation": 10, "color": "#4060ff", "size": 20}


@pytest.fixture
def ball(mount):
    def open_ball(handles=(KEY, RIM), mode="lamps", **settings):
        page = mount("ball", "LightBall", SIDE, SIDE, **settings)
        page.evaluate(
            """([handles, mode]) => {
                window.said = [];
                for (const type of ["input", "change", "choose"]) {
                    one.addEventListener(type, (event) => said.push([type, event.detail]));
                }
                Object.assign(one, { handles, mode });
            }""",
            [list(handles), mode],
        )
        return page

    return open_ball


def direction(azimuth, elevation):
    """Return unit vectors to the right, upwards and towards the camera."""
    azimuth, elevation = np.radians(azimuth), np.radians(elevation)
    level = np.cos(elevation)
    return np.stack([np.sin(azimuth) * level, np.sin(elevation), np.cos(azimuth) * level], -1)


def middle(page):
    box = page.locator("#one").bounding_box()
    return np.array([box["x"] + box["width"] / 2, box["y"] + box["height"] / 2])


def place_of(page, index):
    box = page.locator("#one button").nth(index).bounding_box()
    return np.array([box["x"] + box["width"] / 2, box["y"] + box["height"] / 2])


def said(page, kind):
    return [detail for one, detail in page.evaluate("said") if one == kind]


def test_the_map_is_lamberts_and_its_inverse_leads_back(ball):
    page, rng = ball(), np.random.default_rng(0)
    given = np.column_stack([rng.uniform(-180, 180, 400), np.degrees(np.arcsin(rng.uniform(-1, 1, 400)))])
    given = np.vstack([given, [[0, 0], [0, 90], [0, -90], [90, 0], [180, 0], [-180, 0], [179.9, 0.1]]])
    places, back, angles = page.evaluate(
        """async (given) => {
            const { angles, direction, fromPlace, place } = await import("/static/sphere.js");
            const places = given.map((one) => place(direction(...one)));
            const back = places.map((one) => fromPlace(...one));
            return [places, back, back.map(angles)];
        }""",
        given.tolist(),
    )
    places, back, vectors = np.array(places), np.array(back), direction(*given.T)
    np.testing.assert_allclose(back, vectors, atol=1e-6)
    np.testing.assert_allclose(direction(*np.array(angles).T), vectors, atol=1e-6)
    # The map of equal areas: distances from the middle are as the chords from the camera.
    chords = np.linalg.norm(vectors - [0, 0, 1], axis=1)
    np.testing.assert_allclose(np.linalg.norm(places, axis=1), chords / np.sqrt(2), atol=1e-6)
    aside = np.linalg.norm(vectors[:, :2], axis=1) > 1e-6
    np.testing.assert_allclose(
        np.arctan2(places[aside, 1], places[aside, 0]),
        np.arctan2(-vectors[aside, 1], vectors[aside, 0]),
        atol=1e-6,
    )


LAMPS = [
    ([[-40, 30, 1, "#ffffff"]], 0.2),
    ([[0, 0, 1, "#ffd9a0"], [120, 10, 0.4, "#4060ff"]], 0.0),
    ([[60 * k - 170, 20 * k - 60, (1, 0.5)[k % 2], "#ff8040"] for k in range(6)], 0.5),
    ([], 0.3),
]


@pytest.mark.parametrize(("lamps", "fill"), LAMPS)
def test_the_ball_is_lit_by_lamberts_law(ball, lamps, fill):
    page = ball(handles=())
    page.evaluate("([lamps, fill]) => Object.assign(one, { lamps, fill })", [lamps, fill])
    drawn(page)
    pixels = page.evaluate("[...one.canvas.getContext('2d').getImageData(0, 0, 200, 200).data]")
    pixels = np.array(pixels).reshape(SIDE, SIDE, 4)
    at = (np.arange(SIDE) + 0.5 - SIDE / 2) / RADIUS
    x, y = np.meshgrid(at, -at)
    inside = np.hypot(x, y) < 1 - 2 / RADIUS
    normals = np.stack([x, y, np.sqrt(np.maximum(1 - x**2 - y**2, 0))], -1)

    def light(normals):
        total = np.zeros((*normals.shape[:-1], 3))
        for azimuth, elevation, power, color in lamps:
            value = np.array([int(color[k : k + 2], 16) for k in (1, 3, 5)]) / 255
            value = np.where(value <= 0.04045, value / 12.92, ((value + 0.055) / 1.055) ** 2.4)
            total += power * value * np.maximum(normals @ direction(azimuth, elevation), 0)[..., None]
        return total

    turns = np.stack(np.meshgrid(np.arange(-180, 180), np.arange(-90, 91)), -1)
    most = light(direction(turns[..., 0], turns[..., 1])).max() or 1
    linear = np.clip((1 - fill) * light(normals) / most + fill, 0, 1)
    encoded = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
    assert (pixels[inside, 3] == 255).all()
    # A level for rounding, and what the brightest of many lamps' middles is short of the very brightest.
    np.testing.assert_allclose(pixels[inside, :3], 255 * encoded[inside], atol=1.5 if len(lamps) < 3 else 4)


def test_a_lamp_goes_where_it_is_dragged_also_behind_the_ball(ball):
    page = ball()
    start = direction(KEY["azimuth"], KEY["elevation"])
    place = start[:2] * [1, -1] / np.sqrt(1 + start[2])
    np.testing.assert_allclose(place_of(page, 0) - middle(page), RADIUS * place, atol=1)
    to = middle(page) + RADIUS * np.array([-1.2, 0])
    drag(page, *place_of(page, 0), *(to - place_of(page, 0)))
    moved, *more = said(page, "change")
    assert not more
    assert said(page, "input")[-1] == moved
    assert moved["azimuth"] == pytest.approx(-2 * np.degrees(np.arcsin(1.2 / np.sqrt(2))), abs=1)
    assert moved | {"azimuth": 0} == {
        "index": 0,
        "azimuth": 0,
        "elevation": pytest.approx(0, abs=1),
        "size": 10,
    }
    np.testing.assert_allclose(place_of(page, 0), to, atol=1.5)


def test_the_chosen_lamp_is_dragged_from_anywhere_and_another_is_chosen_by_its_dot(ball):
    page = ball()
    page.mouse.click(*place_of(page, 1))
    assert said(page, "choose") == [{"index": 1}]
    before = place_of(page, 1)
    drag(page, *middle(page), 0, -15)
    np.testing.assert_allclose(place_of(page, 1) - before, [0, -15], atol=1.5)
    assert page.evaluate("one.handles[0]") == KEY


def test_by_keyboard(ball):
    page = ball()
    page.keyboard.press("Tab")
    for key in ("ArrowRight", "Shift+ArrowUp"):
        page.keyboard.press(key)
    assert said(page, "change")[-1] == {"index": 0, "azimuth": -28, "elevation": 30, "size": 10}
    for key in ("Tab", "Shift+Tab", "PageDown"):
        page.keyboard.press(key)
    assert page.evaluate("one.chosen") == 1
    assert [one["index"] for one in said(page, "choose")] == [1, 0, 1]
    page.evaluate("one.handles = one.handles.map((lamp) => ({ ...lamp, azimuth: 179, elevation: 85 }))")
    for key in ("ArrowRight", "Shift+ArrowUp"):
        page.keyboard.press(key)
    assert said(page, "change")[-1] == {"index": 1, "azimuth": -179, "elevation": 90, "size": 20}
    for _ in range(3):
        page.keyboard.press("+")
    assert said(page, "change")[-1]["size"] == round(20 * 1.15**3)
    assert page.get_by_role("button", name="Lamp 2 of 2: 179° to the left, 90° up").count() == 1
    page.keyboard.press("Tab")
    assert not page.evaluate("one.root.contains(document.activeElement)"), (
        "Tab leaves the ball after its lamps"
    )


def test_the_wheel_changes_the_size_of_the_lamp_that_has_the_focus(ball):
    page = ball()
    page.mouse.move(*middle(page))
    page.mouse.wheel(0, -100)
    assert said(page, "input") == []
    page.mouse.click(*place_of(page, 0))
    assert said(page, "change") == [], "a click that moves nothing changes nothing"
    page.mouse.wheel(0, -100)
    until(page, "said.some(([type]) => type === 'change')")
    assert said(page, "change")[-1]["size"] == round(10 * np.exp(0.2))
    page.mouse.wheel(0, -5000)
    until(page, "one.handles[0].size === 60")


def test_a_finger_moves_a_lamp_and_two_make_it_softer(ball):
    page = ball(has_touch=True)
    x, y = place_of(page, 0).tolist()
    touch(page, [(x, y)], [(x + 10, y + 4)], [(x + 20, y + 8)])
    np.testing.assert_allclose(place_of(page, 0), [x + 20, y + 8], atol=1.5)
    before = page.evaluate("one.handles[0]")
    x, y = middle(page).tolist()
    touch(page, [(x - 10, y)], [(x - 10, y), (x + 10, y)], [(x - 20, y), (x + 20, y)])
    after = page.evaluate("one.handles[0]")
    assert after["size"] == pytest.approx(2 * before["size"])
    assert after | {"size": 0} == before | {"size": 0}


def test_the_light_that_was_found_is_carried_round_the_head(ball):
    page = ball(mode="carry")
    page.evaluate("one.lamps = [[-40, 30, 1, '#ffffff'], [60, 0, 0.3, '#ffd9a0']]")
    assert page.locator("#one button").count() == 0
    drag(page, *middle(page), RADIUS / 3, -RADIUS / 6)
    moves = said(page, "input")
    assert len(moves) > 1
    assert sum(one["turn"] for one in moves) == pytest.approx(30, abs=1)
    assert sum(one["tilt"] for one in moves) == pytest.approx(15, abs=1)
    assert said(page, "change") == [{"turn": 0, "tilt": 0}]
    page.keyboard.press("ArrowLeft")
    page.keyboard.press("Shift+ArrowDown")
    assert said(page, "input")[-2:] == [{"turn": -2, "tilt": 0}, {"turn": 0, "tilt": -10}]
    assert "40° to the left, 30° up" in page.get_attribute("#one", "aria-label")
