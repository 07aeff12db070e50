"""What comes in another order than it was asked for: the newest wish counts, and nothing is lost by it."""

import json
import zipfile

import numpy as np
import pytest
from PIL import Image

from relit.face.detect import detect_landmarks
from relit.photo.reading import read_image
from tests.studio.e2e.page import api, begin, drop, points, quiet, settled, until

pytestmark = [pytest.mark.e2e, pytest.mark.slow, pytest.mark.rotating]


@pytest.fixture
def three(photos, tmp_path):
    """The files of three photos, no two of one size."""
    files = [tmp_path / name for name in ("one.png", "two.png", "three.png")]
    with Image.open(photos[0]) as image:
        for size, file in zip(((150, 170), (140, 160), (130, 148)), files, strict=True):
            image.resize(size).save(file)
    return files


@pytest.fixture
def strip(visit, three):
    """The page with a film strip."""
    page = visit(fit=False)
    begin(page, *three)
    return page


@pytest.fixture
def lit(visit, photos, tmp_path):
    """The page with a person and two references, of which the second is in use."""
    page = visit(fit=False)
    begin(page, photos[0])
    for name in ("first.jpg", "second.jpg"):
        (tmp_path / name).write_bytes(photos[1].read_bytes())
        drop(page, "#stage", tmp_path / name)
        settled(page)
    return page


def hold(page, pattern, method, nth=0):
    """Hold back one of the requests that fit, and let the others go."""
    kept, seen = [], []

    def decide(route):
        if route.request.method != method:
            return route.fallback()
        seen.append(route)
        return kept.append(route) if len(seen) == nth + 1 else route.fallback()

    page.route(pattern, decide)

    def release():
        kept.pop().continue_()
        quiet(page)

    def waits():
        for _ in range(1000):
            if kept:
                return
            page.wait_for_timeout(20)
        raise AssertionError(f"never asked: {method} {pattern}")

    release.waits = waits
    return release


def kept(page):
    return json.loads(page.evaluate("sessionStorage.getItem('relit')"))


def look(page, name):
    return page.locator("#looks li", has_text=name).locator(".look")


def in_use(page):
    return page.locator("#looks .look[aria-pressed=true]").inner_text()


def in_hand(page):
    return page.locator("#film [aria-current=true]").all_inner_texts()


def forget(page):
    """Have the server end the session."""
    end = "(session) => fetch(`/api/v1/sessions/${session}`, { method: 'DELETE' }).then(() => {})"
    page.evaluate(end, kept(page)["session"])


def nudge(page, times=1):
    """Move a point of the target by so many times 10 px, by keys."""
    page.evaluate("document.querySelector('#fit').open = true")
    page.select_option("#point", index=5)
    page.locator(".photo[data-role=target] .frame").focus()
    for _ in range(times):
        page.keyboard.press("Shift+ArrowDown")


def exported(page, button):
    with page.expect_download() as download:
        page.click(button)
    with zipfile.ZipFile(download.value.path()) as packed:
        return {name: packed.read(name) for name in packed.namelist()}


def test_the_frame_that_was_chosen_last_is_in_hand(strip, three):
    page, release = strip, hold(strip, "**/photos/target", "PUT")
    page.locator("#film li button").nth(1).click()
    release.waits()
    page.locator("#film li button").nth(2).click()
    until(page, "JSON.parse(sessionStorage.getItem('relit')).names.target === 'three.png'")
    release()
    settled(page)
    assert in_hand(page) == ["three.png"]
    assert kept(page)["names"]["target"] == "three.png"
    assert api(page, "")[1]["target"]["width"] == 130
    np.testing.assert_allclose(
        points(page, "target"), detect_landmarks(read_image(three[2]).pixels).xy, atol=1e-9
    )


def test_no_frame_is_marked_while_another_photo_is_in_hand(strip, photos):
    strip.evaluate("document.querySelector('#fit').open = true")
    strip.set_input_files(".photo[data-role=target] .head input", photos[0])
    settled(strip)
    assert in_hand(strip) == []


def test_frames_show_their_photos_as_long_as_they_are_there(visit, three):
    page = visit(fit=False)
    page.set_input_files("#open", three)
    page.wait_for_selector(".stage.filled")
    until(page, "[...document.querySelectorAll('#film img')].filter((one) => one.naturalWidth).length === 3")
    gone = page.locator("#film img").evaluate_all("all => all.map((one) => one.src)")
    page.evaluate("""() => {
        const revoke = URL.revokeObjectURL.bind(URL);
        window.revoked = [];
        URL.revokeObjectURL = (place) => (revoked.push(place), revoke(place));
    }""")
    page.set_input_files("#open", three)
    settled(page)
    assert set(gone) <= set(page.evaluate("revoked"))


@pytest.mark.parametrize("then", ["second.jpg", "Split"])
def test_the_look_that_was_chosen_last_is_in_use(lit, then):
    page = lit
    look(page, "Rim").click()
    settled(page)
    release = hold(page, "**/choose", "POST")
    look(page, "first.jpg").click()
    release.waits()
    look(page, then).click()
    quiet(page) if then == "second.jpg" else until(
        page, "JSON.parse(sessionStorage.getItem('relit')).options.light === 'split'"
    )
    release()
    settled(page)
    assert in_use(page) == then
    assert kept(page)["options"]["light"] == (None if then == "second.jpg" else "split")


def test_a_reference_that_comes_late_joins_the_looks_alone(lit, photos, tmp_path):
    page, late = lit, tmp_path / "late.jpg"
    late.write_bytes(photos[1].read_bytes())
    release = hold(page, "**/references/*", "PUT")
    drop(page, "#stage", late)
    release.waits()
    look(page, "Split").click()
    page.fill("#option-strength-number", "0.5")
    page.keyboard.press("Tab")
    release()
    settled(page)
    assert in_use(page) == "Split"
    assert kept(page)["options"]["strength"] == 0.5
    assert look(page, "late.jpg").count() == 1
    page.click("#undo")
    page.click("#undo")
    settled(page)
    assert in_use(page) == "second.jpg"


def test_a_set_has_the_light_that_it_was_begun_with(lit, three):
    page, asked = lit, []
    drop(page, "#stage", *three)
    quiet(page)
    page.on("request", lambda sent: asked.append(sent.post_data_json) if "/export" in sent.url else None)
    release = hold(page, "**/export", "POST", 1)
    page.click("#film [data-do=all]")
    release.waits()
    look(page, "first.jpg").click()
    until(page, "document.querySelector('#looks .look[aria-pressed=true]').textContent === 'first.jpg'")
    with page.expect_download():
        release()
    used = {name: one for one, name in kept(page)["references"].items()}
    assert [one["reference"] for one in asked] == [used["second.jpg"]] * 3
    assert page.inner_text("#film [role=status]") == "3 photos relit."


def test_a_new_set_ends_the_export_of_the_one_before(strip, photos, three):
    page, release = strip, hold(strip, "**/export", "POST", 1)
    page.click("#film [data-do=all]")
    release.waits()
    with page.expect_download():
        drop(page, "#stage", *three, photos[0])
    settled(page)
    assert page.locator("#film li").count() == 4
    assert page.inner_text("#film [role=status]") == "Stopped after 1 of 3."
    assert in_hand(page) == ["one.png"]
    assert list(api(page, "/references")[1]) == []


def test_landmarks_by_hand_stay_with_their_frame(strip):
    page, found = strip, points(strip, "target")
    nudge(page, 2)
    settled(page)
    moved = points(page, "target")
    assert np.ptp(moved - found) == pytest.approx(20)
    alone, together = exported(page, "#export"), exported(page, "#film [data-do=all]")
    assert alone["relit.png"] == together["one.png"]
    for frame in (1, 0):
        page.locator("#film li button").nth(frame).click()
        settled(page)
    np.testing.assert_array_equal(points(page, "target"), moved)


def test_a_frame_whose_face_was_placed_by_hand_is_relit(visit, three, tmp_path):
    page, wall = visit(), tmp_path / "wall.png"
    Image.new("RGB", (150, 170), "grey").save(wall)
    begin(page, *three[:2], wall)
    with page.expect_download() as download:
        page.locator(".photo[data-role=target] [data-do=save]").click()
    marks = tmp_path / download.value.suggested_filename
    download.value.save_as(marks)
    page.locator("#film li button").nth(2).click()
    quiet(page)
    page.set_input_files(".photo[data-role=target] .landmark-file", marks)
    settled(page)
    page.locator("#film li button").nth(0).click()
    settled(page)
    assert set(exported(page, "#film [data-do=all]")) == {"one.png", "two.png", "wall.png"}
    assert page.inner_text("#film [role=status]") == "3 photos relit."


def test_landmarks_of_a_photo_do_not_go_to_the_next(strip, three):
    page, sent = strip, []
    release = hold(page, "**/photos/target", "PUT")
    page.on("request", lambda one: sent.append(one) if "/landmarks/target" in one.url else None)
    page.locator("#film li button").nth(1).click()
    release.waits()
    nudge(page)
    page.wait_for_timeout(300)
    assert sent == []
    release()
    settled(page)
    np.testing.assert_allclose(
        points(page, "target"), detect_landmarks(read_image(three[1]).pixels).xy, atol=1e-9
    )


def test_landmarks_of_a_photo_that_stays_after_all_are_sent(strip, tmp_path):
    page, before = strip, points(strip, "target")
    (tmp_path / "bad.png").write_bytes(b"no photo" * 99)
    page.route("**/photos/target", lambda route: (nudge(page), route.fallback()))
    page.set_input_files(".photo[data-role=target] .head input", tmp_path / "bad.png")
    settled(page)
    assert np.ptp(points(page, "target") - before) == pytest.approx(10)


def test_taking_out_one_reference_leaves_the_history_of_others(lit):
    page = lit
    look(page, "first.jpg").click()
    settled(page)
    look(page, "Rim").click()
    settled(page)
    page.locator("#looks li", has_text="second.jpg").get_by_label("Take").click()
    quiet(page)
    page.click("#undo")
    settled(page)
    assert in_use(page) == "first.jpg"
    while page.locator("#undo").is_enabled():
        page.click("#undo")
        settled(page)
        assert in_use(page) in ("first.jpg", "Loop"), "what the other lit is left out"


def test_a_reference_that_is_taken_out_while_it_is_chosen_has_its_name(lit):
    page, release = lit, hold(lit, "**/choose", "POST")
    look(page, "first.jpg").click()
    release.waits()
    page.locator("#looks li", has_text="first.jpg").get_by_label("Take").click()
    release()
    settled(page)
    assert look(page, "first.jpg").count() == 0
    assert kept(page)["names"]["reference"] == "first.jpg"
    assert page.inner_text("#desk figcaption") == "The light of first.jpg"


def test_two_clicks_export_once(strip):
    page, asked = strip, []
    page.on("request", lambda sent: asked.append(sent) if "/export" in sent.url else None)
    with page.expect_download():
        page.dblclick("#export")
    quiet(page)
    assert len(asked) == 1
    assert page.locator("#export").is_enabled()


def test_a_tab_that_is_duplicated_has_a_session_of_its_own(strip):
    page = strip
    page.fill("#option-strength-number", "0.5")
    page.keyboard.press("Tab")
    settled(page)
    with page.expect_popup() as opened:
        page.evaluate("window.open(location.href) && 0")
    other = opened.value
    other.wait_for_selector("#samples:enabled")
    assert kept(other)["session"] != kept(page)["session"]
    assert other.input_value("#option-strength-number") == "0.5"
    assert "open in another tab" in other.inner_text("#status")
    page.reload()
    page.wait_for_selector(".stage.filled")
    assert page.locator(".photo[data-role=target].filled").count() == 1, "loaded again, it has its own"


def test_work_goes_on_where_the_server_has_forgotten_the_session(lit):
    page, before = lit, kept(lit)["session"]
    nudge(page)
    settled(page)
    moved = {role: points(page, role) for role in ("target", "reference")}
    forget(page)
    page.fill("#option-strength-number", "0.5")
    page.keyboard.press("Tab")
    settled(page)
    assert kept(page)["session"] != before
    for role, there in moved.items():
        np.testing.assert_array_equal(points(page, role), there)
    assert set(api(page, "/references")[1]) == set(kept(page)["references"])
    assert page.inner_text("#stage-problem") == ""


def test_settings_outlive_a_session(strip):
    page = strip
    page.fill("#option-strength-number", "0.5")
    page.keyboard.press("Tab")
    settled(page)
    forget(page)
    page.reload()
    page.wait_for_selector("#samples:enabled")
    assert page.input_value("#option-strength-number") == "0.5"
    assert "drop them again" in page.inner_text("#status")


def test_a_set_stops_where_the_session_has_ended(strip):
    page = strip
    ended = {"error": {"code": "not_found", "message": "This session has ended."}}
    for place in ("**/references/film", "**/api/v1/sessions"):
        page.route(place, lambda route: route.fulfill(status=404, json=ended))
    page.click("#film [data-do=all]")
    until(page, "!document.querySelector('#film [data-do=all]').hidden")
    assert page.inner_text("#film [role=status]").startswith("Stopped after 0 of 3. This session has ended.")
    assert page.locator("#film .bad").count() == 0


def test_photos_that_the_page_does_not_have_itself_are_asked_for(strip):
    page = strip
    page.reload()
    page.wait_for_selector(".stage.filled")
    quiet(page)
    forget(page)
    page.fill("#option-strength-number", "0.5")
    page.keyboard.press("Tab")
    quiet(page)
    assert page.inner_text("#stage-problem").endswith("reload the page, and drop them again.")
