"""The studio's page in a real browser, against the real server."""

from __future__ import annotations

import io
import json
import re
import subprocess
import sys
import zipfile
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

BROWSER = Path("/usr/bin/chromium")
playwright = pytest.importorskip("playwright.sync_api", reason="the browser tests need playwright")
pytestmark = [
    pytest.mark.e2e,
    pytest.mark.slow,
    pytest.mark.skipif(not BROWSER.exists(), reason=f"the browser tests need {BROWSER}"),
]
WAIT = 30_000  # ms
#: The pixels of the result that is shown, or of one that is asked for.
PIXELS = """async (request) => {
    let picture = document.querySelector("[data-view=result]");
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


@pytest.fixture(scope="module")
def address():
    """Start the studio as its command does, on any port that is free."""
    command = [sys.executable, "-c", "from relit.cli import main; main()"]
    with subprocess.Popen(
        [*command, "studio", "--port", "0", "--no-open"],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    ) as server:
        try:
            line = server.stdout.readline()
            found = re.search(r"http://\S+", line)
            assert found, line
            yield found[0]
        finally:
            server.terminate()
            server.wait(20)


@pytest.fixture(scope="module")
def browser():
    with playwright.sync_playwright() as started:
        opened = started.chromium.launch(
            executable_path=str(BROWSER), args=["--no-sandbox", "--disable-background-networking"]
        )
        yield opened
        opened.close()


@pytest.fixture
def visit(browser, address):
    """Open the page as a new visitor; what it says on the console at the end must be nothing bad."""
    contexts, complaints = [], []

    def open_page(**settings):
        context = browser.new_context(viewport={"width": 1280, "height": 800}, **settings)
        contexts.append(context)
        page = context.new_page()
        page.set_default_timeout(WAIT)
        page.on("pageerror", lambda error: complaints.append(str(error)))
        page.on("console", lambda said: complaints.append(said.text) if refused(said) else None)
        page.on("dialog", lambda dialog: complaints.append(f"a dialog: {dialog.message}"))
        page.goto(address)
        page.wait_for_selector("#samples:enabled")
        return page

    def refused(said):
        # A browser reports every answer of 4xx by itself; those are the server's, and shown in the page.
        return said.type == "error" and "the server responded with a status of 4" not in said.text

    yield open_page
    for context in contexts:
        context.close()
    assert complaints == []


def api(page, path, method="GET"):
    """Ask the server what it holds of this page's session; the status and the answer."""
    return page.evaluate(
        """async ([path, method]) => {
            const { session } = JSON.parse(sessionStorage.getItem("relit"));
            const answer = await fetch(`/api/v1/sessions/${session}${path}`, { method });
            const json = answer.headers.get("Content-Type")?.includes("json");
            return [answer.status, json ? await answer.json() : null];
        }""",
        [path, method],
    )


def points(page, role):
    return np.array(api(page, f"/landmarks/{role}")[1]["points"])[:, :2]


def settled(page):
    """Wait until the preview shows the newest state."""
    playwright.expect(page.locator("#stage")).to_have_attribute("aria-busy", "false", timeout=WAIT)
    playwright.expect(page.locator("#status")).to_have_text(re.compile("^Done"), timeout=WAIT)


def on_screen(page, role, place):
    """Return where a pixel of the photo is seen, and how large it is there, by where the picture is."""
    box = page.locator(f".photo[data-role={role}] .frame img").bounding_box()
    scale = box["width"] / api(page, "")[1][role]["width"]
    return box["x"] + (place[0] + 0.5) * scale, box["y"] + (place[1] + 0.5) * scale, scale


def with_samples(page):
    page.click("#samples")
    page.wait_for_selector(".stage.filled")
    settled(page)
    return page


def test_the_whole_story(visit):
    page = with_samples(visit())
    before = points(page, "target")
    assert len(before) == len(points(page, "reference")) == 478

    chin = 152
    x, y, scale = on_screen(page, "target", before[chin])
    page.mouse.move(x, y)
    for role in ("target", "reference"):
        assert page.locator(f".photo[data-role={role}] path.hovered").get_attribute("d"), role
    page.mouse.down()
    page.mouse.move(x + 15, y + 9, steps=4)
    page.mouse.up()
    settled(page)
    moved = points(page, "target")
    np.testing.assert_allclose(moved[chin] - before[chin], np.array([15, 9]) / scale, atol=0.02)
    np.testing.assert_array_equal(np.delete(moved, chin, 0), np.delete(before, chin, 0))

    page.keyboard.press("Control+z")
    settled(page)
    np.testing.assert_array_equal(points(page, "target"), before)
    page.keyboard.press("Control+Shift+Z")
    settled(page)
    np.testing.assert_array_equal(points(page, "target"), moved)
    page.click("#snap")
    settled(page)
    np.testing.assert_array_equal(points(page, "target"), before)

    def finest():
        return float(re.search(r"below ([\d.]+) px", page.inner_text("#finest"))[1])

    coarse = finest()
    page.fill("#option-lam-number", "0.1")
    page.keyboard.press("Tab")
    settled(page)
    assert finest() == pytest.approx(2 * coarse, abs=0.11), "half the lambda is twice the size"

    bar = page.get_by_role("slider", name="Before and after")
    box = page.locator(".compare").bounding_box()
    page.mouse.click(box["x"] + box["width"] / 4, box["y"] + 20)
    assert float(bar.get_attribute("aria-valuenow")) == pytest.approx(25, abs=1)

    target, reference = points(page, "target"), points(page, "reference")
    page.click("#swap")
    playwright.expect(page.locator("[data-role=target] .facts")).to_contain_text("910", timeout=WAIT)
    settled(page)
    np.testing.assert_array_equal(points(page, "target"), reference)
    np.testing.assert_array_equal(points(page, "reference"), target)

    with page.expect_download() as download:
        page.click("#export")
    packed = zipfile.ZipFile(io.BytesIO(Path(download.value.path()).read_bytes()))
    with packed, packed.open("relit.png") as picture:
        assert Image.open(picture).size == (910, 1137)
        assert "0.1" in packed.read("settings.json").decode()


def test_the_newest_change_wins(visit):
    page = with_samples(visit())
    asked = []
    page.on("request", lambda sent: asked.append(sent.post_data_json) if "/render" in sent.url else None)
    page.focus("#option-strength")
    for _ in range(30):
        page.keyboard.press("ArrowRight")
    settled(page)
    newest = asked[-1]
    assert newest["options"]["strength"] == 2.5
    sequences = [one["sequence"] for one in asked]
    assert sequences == sorted(set(sequences))
    seen = page.evaluate(PIXELS, None)
    for strength, alike in ((2.5, True), (1.0, False)):
        newest["sequence"] += 1
        newest["options"]["strength"] = strength
        assert (page.evaluate(PIXELS, newest) == seen) is alike


def test_every_view_of_a_method_is_shown(visit):
    page = with_samples(visit())
    page.select_option("#option-method", label="ltv")
    settled(page)
    for tab in page.get_by_role("tab").all():
        if not tab.is_visible():
            continue
        tab.click()
        panel = page.locator(f"#{tab.get_attribute('aria-controls')}")
        settled(page)
        pictures = panel.locator("img:visible").all()
        assert pictures, tab.inner_text()
        assert all(one.evaluate("one => one.complete && one.naturalWidth > 0") for one in pictures)
    page.get_by_role("tab", name="u and v").click()
    settled(page)
    assert page.locator("#panel-split img:visible").count() == 4
    page.select_option("#option-method", label="shading")
    page.wait_for_selector("#tab-split", state="hidden")
    assert page.get_by_role("tab", name="Result").get_attribute("aria-selected") == "true"


def test_by_keyboard_alone(visit):
    page = visit()

    def tab_to(selector):
        for _ in range(90):
            if page.evaluate("s => document.activeElement.matches(s)", selector):
                return
            page.keyboard.press("Tab")
        raise AssertionError(f"Tab never comes to {selector}")

    tab_to("#samples")
    page.keyboard.press("Enter")
    page.wait_for_selector(".stage.filled")
    settled(page)
    before = points(page, "reference")
    tab_to(".photo[data-role=reference] .frame")
    page.keyboard.press("PageDown")
    row = int(page.input_value("#point"))
    page.keyboard.press("ArrowRight")
    page.keyboard.press("Shift+ArrowDown")
    assert f"Point {row}" in page.inner_text("#status")
    page.wait_for_timeout(200)
    settled(page)
    moved = points(page, "reference")
    np.testing.assert_allclose(moved[row] - before[row], [1, 10], atol=1e-9)
    np.testing.assert_array_equal(np.delete(moved, row, 0), np.delete(before, row, 0))

    tab_to("#point")
    page.keyboard.press("ArrowDown")
    assert int(page.input_value("#point")) != row
    tab_to("[role=tab][aria-selected=true]")
    page.keyboard.press("ArrowRight")
    assert page.get_by_role("tab", name="Overlay").get_attribute("aria-selected") == "true"
    page.keyboard.press("Home")
    tab_to("[role=slider]")
    page.keyboard.press("Home")
    assert page.get_by_role("slider", name="Before and after").get_attribute("aria-valuenow") == "0"
    tab_to("#option-strength")
    page.keyboard.press("ArrowRight")
    settled(page)
    assert page.input_value("#option-strength-number") == "1.05"
    for field in page.locator("#controls input, #controls select").all():
        for name in (field.get_attribute("aria-describedby") or "").split():
            assert page.locator(f"#{name}").count() == 1
    unnamed = page.evaluate(
        """() => [...document.querySelectorAll("button, input, select, [role=slider]")].filter(
            (one) => !(one.labels?.length || one.getAttribute("aria-label") || one.textContent.trim())
        ).map((one) => one.outerHTML)"""
    )
    assert unnamed == []


def test_pairs_are_placed_by_hand_where_there_is_no_face(visit, tmp_path):
    page = visit()
    shade = np.linspace(40, 200, 400).astype(np.uint8)
    for role, pixels in (
        ("target", np.tile(shade, (300, 1))),
        ("reference", np.tile(shade[:300, None], 400)),
    ):
        Image.fromarray(pixels).save(tmp_path / f"{role}.png")
        page.set_input_files(f".photo[data-role={role}] .head input", tmp_path / f"{role}.png")
        page.wait_for_selector(f".photo[data-role={role}].filled")
        assert "face" in page.inner_text(f".photo[data-role={role}] .problem").lower()
    assert page.locator("#export").is_disabled()
    page.click("#by-hand")
    places = [(100, 80), (300, 80), (200, 150), (140, 230), (260, 230)]
    for number, place in enumerate(places):
        for role in ("target", "reference"):
            x, y, _ = on_screen(page, role, place)
            page.mouse.click(x, y)
        if number < 2:
            assert "at least 3" in page.inner_text("#points-note")
            assert page.locator("#export").is_disabled()
    page.wait_for_selector(".stage.filled")
    settled(page)
    for role in ("target", "reference"):
        np.testing.assert_allclose(points(page, role), places, atol=0.02)
    x, y, _ = on_screen(page, "target", (200, 40))
    page.mouse.click(x, y)
    assert "point 5 in the reference" in page.inner_text("#points-note")
    settled(page)
    assert len(points(page, "target")) == 5, "a point without its partner does not count"
    page.keyboard.press("Control+z")

    page.click("#add")
    page.select_option("#point", "4")
    page.click("#remove")
    settled(page)
    for role in ("target", "reference"):
        np.testing.assert_allclose(points(page, role), places[:4], atol=0.02)


def test_deleting_a_landmark_of_the_mesh_keeps_both_faces_paired(visit):
    page = with_samples(visit())
    before = points(page, "target")
    page.select_option("#point", "152")
    page.click("#remove")
    settled(page)
    target, reference = points(page, "target"), points(page, "reference")
    assert len(target) == len(reference) < 478
    assert not (target == before[152]).all(axis=1).any()
    assert api(page, "/landmarks/reference")[1]["scheme"] == "points"
    page.click("#undo")
    settled(page)
    np.testing.assert_array_equal(points(page, "target"), before)


@pytest.mark.parametrize("name", ["photo.jpg", "<img src=x onerror=alert(1)>.png"])
def test_what_is_no_photo_is_told_beside_it(visit, name):
    page = with_samples(visit())
    held = points(page, "target")
    page.set_input_files(
        ".photo[data-role=target] .head input",
        {"name": name, "mimeType": "image/jpeg", "buffer": b"<svg onload=alert(1)>" * 50},
    )
    problem = page.locator(".photo[data-role=target] .problem")
    playwright.expect(problem).not_to_be_empty()
    assert problem.get_attribute("role") == "alert"
    assert "Traceback" not in problem.inner_text()
    np.testing.assert_array_equal(points(page, "target"), held)


def test_landmarks_go_to_a_file_and_back(visit, tmp_path):
    page = with_samples(visit())
    before = points(page, "target")
    formats = page.locator(".photo[data-role=target] .landmark-format option").all_inner_texts()
    assert formats == page.evaluate(
        "fetch('/api/v1/options').then(r => r.json()).then(o => o.landmark_formats)"
    )
    for suffix in formats:
        page.select_option(".photo[data-role=target] .landmark-format", suffix)
        with page.expect_download() as download:
            page.click(".photo[data-role=target] [data-do=save]")
        file = tmp_path / f"face{suffix}"
        download.value.save_as(file)
        page.set_input_files(".photo[data-role=target] .landmark-file", file)
        settled(page)
        np.testing.assert_allclose(points(page, "target"), before, atol=1e-6)


def test_a_refused_option_is_told_beside_it(visit):
    page = with_samples(visit())
    page.fill("#option-region", "ears")
    page.keyboard.press("Tab")
    problem = page.locator("#option-region-problem")
    playwright.expect(problem).to_contain_text("ears")
    page.click("#reset")
    playwright.expect(problem).to_be_empty()


def test_visitors_do_not_see_each_others_photos(visit):
    first, second = with_samples(visit()), visit()
    assert api(first, "/photos/target?side=64")[0] == 200
    assert api(second, "/photos/target?side=64")[0] == 404
    second.reload()
    second.wait_for_selector("#samples:enabled")
    assert second.locator(".photo.filled").count() == 0
    first.reload()
    first.wait_for_selector(".stage.filled")
    assert first.locator(".photo.filled").count() == 2
    first.fill("#option-strength-number", "0.5")
    first.keyboard.press("Tab")
    settled(first)
    first.reload()
    first.wait_for_selector(".stage.filled")
    assert first.input_value("#option-strength-number") == "0.5"
    tokens = {
        json.loads(one.evaluate("sessionStorage.getItem('relit')"))["session"] for one in (first, second)
    }
    assert len(tokens) == 2


def test_a_session_in_the_address_is_opened_and_does_not_stay_there(visit, address):
    first, second = with_samples(visit()), visit()
    token = json.loads(first.evaluate("sessionStorage.getItem('relit')"))["session"]
    second.goto("about:blank")
    second.goto(f"{address}#{token}")
    second.wait_for_selector(".stage.filled")
    assert second.url == address
    np.testing.assert_array_equal(points(second, "target"), points(first, "target"))
    second.goto("about:blank")
    second.goto(f"{address}#nobody")
    second.wait_for_selector("#samples:enabled")
    assert second.locator(".photo.filled").count() == 0


@pytest.mark.parametrize("width", [360, 1280, 3840])
def test_nothing_hangs_over_the_edge(visit, width):
    page = visit()
    page.set_viewport_size({"width": width, "height": 900})
    with_samples(page)
    assert page.evaluate("document.documentElement.scrollWidth") == width
