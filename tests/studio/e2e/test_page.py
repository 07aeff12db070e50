"""The studio's page in a real browser, against the real server."""

import io
import json
import re

import numpy as np
import pytest
from PIL import Image

from relit.face.detect import detect_landmarks
from tests.studio.e2e.page import api, drop, points, quiet, settled

pytestmark = [pytest.mark.e2e, pytest.mark.slow, pytest.mark.rotating]

#: The pixels of the result that is shown, or of one that is asked for.
PIXELS = """async (request) => {
    let picture = document.querySelector("#viewer .main .after img");
    if (request) {
        const { session } = JSON.parse(sessionStorage.getItem("relit"));
        const headers = { "Content-Type": "application/json" };
        const init = { method: "POST", headers, body: JSON.stringify(request) };
        const answer = await fetch(`/api/v1/sessions/${session}/render`, init);
        picture = await createImageBitmap(await answer.blob());
    }
    const canvas = document.createElement("canvas");
    canvas.width = picture.naturalWidth ?? picture.width;
    canvas.height = picture.naturalHeight ?? picture.height;
    canvas.getContext("2d").drawImage(picture, 0, 0);
    return canvas.toDataURL();
}"""


def test_the_newest_change_wins(sitting):
    asked = []
    sitting.on("request", lambda sent: asked.append(sent.post_data_json) if "/render" in sent.url else None)
    sitting.focus("#option-strength")
    for _ in range(30):
        sitting.keyboard.press("ArrowRight")
    settled(sitting)
    newest = asked[-1]
    assert newest["options"]["strength"] == 2.5
    sequences = [one["sequence"] for one in asked]
    assert sequences == sorted(set(sequences))
    seen = sitting.evaluate(PIXELS, None)
    for strength, alike in ((2.5, True), (1.0, False)):
        newest["sequence"] += 1
        newest["options"]["strength"] = strength
        assert (sitting.evaluate(PIXELS, newest) == seen) is alike


@pytest.mark.parametrize(
    ("method", "pictures"),
    [
        ("shading", {"Result": 2, "Overlay": 2, "Light and person": 3, "Mask": 2, "Difference": 1}),
        ("ltv", {"Result": 2, "Overlay": 2, "u and v": 4, "Mask": 2, "Difference": 1}),
    ],
)
def test_every_view_of_a_method_is_shown(sitting, method, pictures):
    sitting.click("#expert summary")
    sitting.select_option("#option-method", label=method)
    settled(sitting)
    tabs = [tab for tab in sitting.get_by_role("tab").all() if tab.is_visible()]
    assert [tab.inner_text() for tab in tabs] == list(pictures)
    for tab in tabs:
        tab.click()
        settled(sitting)
        seen = sitting.locator(f"#{tab.get_attribute('aria-controls')} img:visible").all()
        assert len(seen) == pictures[tab.inner_text()]
        assert all(one.evaluate("one => one.complete && one.naturalWidth > 0") for one in seen)


def test_a_view_that_a_method_does_not_have_gives_way_to_the_result(sitting):
    sitting.click("#tab-layers")
    settled(sitting)
    sitting.click("#expert summary")
    sitting.select_option("#option-method", label="moments")
    sitting.wait_for_selector("#tab-layers", state="hidden")
    settled(sitting)
    assert sitting.get_by_role("tab", name="Result").get_attribute("aria-selected") == "true"


def test_the_reference_lies_over_the_target(sitting):
    sitting.click("#tab-warped")
    settled(sitting)
    sheet = sitting.locator(".onion .sheet")
    scale = sheet.bounding_box()["width"] / api(sitting, "")[1]["target"]["width"]
    seen = {}
    for share in (0, 100):
        sitting.locator("#onion").fill(str(share))
        seen[share] = Image.open(io.BytesIO(sheet.screenshot())).convert("RGB")
        found = detect_landmarks(np.asarray(seen[share]), name="what is seen")
        off = np.linalg.norm((found.xy + 0.5) / scale - 0.5 - points(sitting, "target"), axis=1)
        assert np.median(off) < 0.05 * found.interocular_distance / scale
    assert np.abs(np.asarray(seen[0], float) - np.asarray(seen[100], float)).mean() > 10


def test_a_photo_that_is_chosen_while_the_other_is_on_its_way_keeps_its_landmarks(visit, photos):
    page, held = visit(), []
    page.route(re.compile(r"/photos/target\?side"), lambda route: held.append(route))
    page.set_input_files(".photo[data-role=target] .head input", photos[0])
    while not held:
        page.wait_for_timeout(50)
    page.set_input_files(".photo[data-role=reference] .head input", photos[1])
    page.wait_for_selector(".photo[data-role=reference].filled")
    held[0].continue_()
    page.wait_for_selector("#export:not([disabled])")


@pytest.mark.parametrize("often", [2, 99])
def test_a_busy_server_is_asked_again_and_then_told_of(sitting, often):
    asked, busy = [], {"error": {"code": "busy", "message": "Too much is to be done."}}

    def answer(route):
        asked.append(route)
        if len(asked) > often:
            return route.continue_()
        return route.fulfill(status=503, json=busy, headers={"Retry-After": "0"})

    sitting.route("**/render", answer)
    sitting.fill("#option-strength-number", "0.5")
    sitting.keyboard.press("Tab")
    quiet(sitting)
    if often == 2:
        assert len(asked) > 2
        assert sitting.inner_text("#stage-problem") == ""
    else:
        assert len(asked) % 6 == 0
        assert sitting.inner_text("#stage-problem") == busy["error"]["message"]


def test_one_photo_beside_the_panels_goes_where_there_is_none(visit, photos):
    page = visit()
    for photo, role in zip(photos, ("target", "reference"), strict=True):
        drop(page, "#stage", photo)
        page.wait_for_selector(f".photo[data-role={role}].filled")
        quiet(page)
        assert photo.name in page.inner_text(f".photo[data-role={role}] .facts")
    drop(page, "#stage", photos[0])
    quiet(page)
    assert photos[0].name in page.inner_text(".photo[data-role=reference] .facts"), "the person stays"


@pytest.mark.parametrize("name", ["photo.jpg", "<img src=x onerror=alert(1)>.png"])
def test_what_is_no_photo_is_told_beside_it(sitting, name):
    held = points(sitting, "target")
    sitting.set_input_files(
        ".photo[data-role=target] .head input",
        {"name": name, "mimeType": "image/jpeg", "buffer": b"<svg onload=alert(1)>" * 50},
    )
    problem = sitting.locator(".photo[data-role=target] .problem")
    problem.filter(has_text="text file").wait_for()
    assert problem.get_attribute("role") == "alert"
    assert "Traceback" not in problem.inner_text()
    np.testing.assert_array_equal(points(sitting, "target"), held)


def test_of_two_photos_the_good_one_is_taken(visit, photos, tmp_path):
    page = visit()
    bad = tmp_path / "bad.jpg"
    bad.write_bytes(photos[1].read_bytes()[:2000])
    drop(page, "#stage", bad, photos[1])
    page.wait_for_selector(".photo[data-role=reference].filled")
    quiet(page)
    assert "damaged or cut short" in page.inner_text(".photo[data-role=target] .problem")
    assert page.inner_text(".photo[data-role=reference] .problem") == ""
    assert page.locator(".photo.filled").count() == 1


def test_a_refused_option_is_told_beside_it(sitting):
    sitting.click("#expert summary")
    sitting.fill("#option-channels", "x")
    sitting.keyboard.press("Tab")
    quiet(sitting)
    assert sitting.inner_text("#option-channels-problem").startswith("Channels: expected")
    sitting.click("#reset")
    settled(sitting)
    assert sitting.inner_text("#option-channels-problem") == ""


def test_help_is_that_of_the_options_without_the_command_line(visit):
    page = visit()
    declared = page.evaluate("fetch('/api/v1/options').then(r => r.json())")["options"]
    for option in declared:
        words = option["help"].split()
        shown = page.text_content(f"#option-{option['name']}-help")
        assert "--" not in shown
        assert "REFERENCE" not in shown
        assert len(set(words) - set(shown.split())) <= 1
    assert "or (Blend into the photo off) the whole image" in page.text_content("#option-mask-help")


def test_visitors_do_not_see_each_others_photos(sitting, visit):
    first, second = sitting, visit()
    assert api(first, "/photos/target?side=64")[0] == 200
    assert api(second, "/photos/target?side=64")[0] == 404
    second.reload()
    second.wait_for_selector("#samples:enabled")
    assert second.locator(".photo.filled").count() == 0
    first.fill("#option-strength-number", "0.5")
    first.keyboard.press("Tab")
    settled(first)
    first.reload()
    first.wait_for_selector(".stage.filled")
    assert first.locator(".photo.filled").count() == 2
    assert first.input_value("#option-strength-number") == "0.5"
    tokens = {
        json.loads(one.evaluate("sessionStorage.getItem('relit')"))["session"] for one in (first, second)
    }
    assert len(tokens) == 2


def test_a_session_in_the_address_is_opened_and_does_not_stay_there(sitting, visit, address):
    second = visit()
    token = json.loads(sitting.evaluate("sessionStorage.getItem('relit')"))["session"]
    second.goto("about:blank")
    second.goto(f"{address}#{token}")
    second.wait_for_selector(".stage.filled")
    assert second.url == address
    np.testing.assert_array_equal(points(second, "target"), points(sitting, "target"))
    second.goto("about:blank")
    second.goto(f"{address}#nobody")
    second.wait_for_selector("#samples:enabled")
    assert second.locator(".photo.filled").count() == 0


def test_nothing_hangs_over_the_edge_and_the_preview_stays_in_sight(sitting):
    for width in (360, 700, 1280, 3840):
        sitting.set_viewport_size({"width": width, "height": 900})
        quiet(sitting)
        assert sitting.evaluate("document.documentElement.scrollWidth") == width
        sitting.focus("#option-strength")
        picture = sitting.locator("#viewer .pane.main").bounding_box()
        control = sitting.locator("#option-strength").bounding_box()
        assert picture["y"] > -0.1 * picture["height"]
        beside = control["x"] > picture["x"] + picture["width"]
        assert beside or control["y"] > picture["y"] + picture["height"]
