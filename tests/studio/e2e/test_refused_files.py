"""What the page cannot take: it is named where it is seen, and there is a way on."""

import numpy as np
import pytest
from PIL import Image

from tests.studio.e2e.page import api, drop, on_screen, points, quiet, settled, until

pytestmark = [pytest.mark.e2e, pytest.mark.slow, pytest.mark.rotating]


@pytest.fixture
def broken(tmp_path, photos):
    """Files that are no photos, by name."""
    files = {
        "cut.jpg": photos[1].read_bytes()[:2000],
        "text.jpg": b"Dear diary",
        "empty.jpg": b"",
        "face.tem": b"3\n1 1\n2 2\n3 1\n",
    }
    for name, data in files.items():
        (tmp_path / name).write_bytes(data)
    return [tmp_path / name for name in files]


def wall(path):
    Image.new("RGB", (300, 200), "grey").save(path)
    return path


def in_sight(page, selector):
    """Whether something is seen without scrolling."""
    box, size = page.locator(selector).bounding_box(), page.viewport_size
    return (
        box is not None and box["height"] > 0 and 0 <= box["y"] < box["y"] + box["height"] <= size["height"]
    )


def told(page):
    assert in_sight(page, "#stage-problem")
    return page.inner_text("#stage-problem")


def test_a_broken_file_is_named_on_the_stage(visit, broken, photos):
    page = visit(fit=False)
    for file in broken:
        drop(page, "#stage", file)
        quiet(page)
        assert told(page).startswith(f"{file.name}: ")
    drop(page, "#stage", photos[0])
    page.wait_for_selector(".stage.filled")
    settled(page)
    assert page.inner_text("#stage-problem") == ""
    drop(page, "#stage", broken[0])
    quiet(page)
    assert told(page).startswith("cut.jpg: ")
    assert not page.inner_text("#status").startswith("Done")


def test_of_two_photos_the_broken_one_is_named_though_the_other_is_relit(visit, broken, photos):
    page = visit(fit=False)
    drop(page, "#stage", photos[0], broken[0])
    page.wait_for_selector(".stage.filled")
    settled(page)
    assert told(page).startswith("cut.jpg: ")


def test_a_reference_for_which_there_is_no_room_is_named(visit, photos):
    page, full = visit(fit=False), {"error": {"code": "full", "message": "There are 24 references at hand."}}
    drop(page, "#stage", photos[0])
    page.wait_for_selector(".stage.filled")
    settled(page)
    page.route("**/references/*", lambda route: route.fulfill(status=409, json=full))
    drop(page, "#stage", photos[1])
    quiet(page)
    assert told(page) == f"{photos[1].name}: There are 24 references at hand."


def test_a_broken_photo_of_a_film_strip_is_marked_and_the_one_in_hand_stays_current(visit, broken, photos):
    page = visit(fit=False)
    drop(page, "#stage", photos[0], photos[1], broken[0])
    page.wait_for_selector(".stage.filled")
    settled(page)
    page.locator("#film li button").nth(2).click()
    quiet(page)
    assert told(page).startswith("cut.jpg: ")
    buttons = page.locator("#film li button")
    assert [one.get_attribute("aria-current") for one in buttons.all()] == ["true", "false", "false"]
    assert page.locator("#film .bad").all_inner_texts() == ["cut.jpg"]
    page.locator("#film li button").nth(1).click()
    settled(page)
    assert buttons.nth(1).get_attribute("aria-current") == "true"
    assert page.inner_text("#stage-problem") == ""


def test_a_lone_photo_without_a_face_is_helped_by_points_of_its_own(visit, tmp_path):
    page = visit(fit=False)
    drop(page, "#stage", wall(tmp_path / "wall.png"))
    page.wait_for_selector(".photo[data-role=target].filled")
    quiet(page)
    assert in_sight(page, ".photo[data-role=target] .head"), "the page goes where the face is placed"
    assert not page.locator(".stage > .empty").is_visible()
    page.click("#by-hand")
    places = [(100, 60), (200, 60), (150, 110), (110, 150), (190, 150)]
    for number, place in enumerate(places, start=1):
        x, y, _ = on_screen(page, "target", place)
        page.mouse.click(x, y)
        assert "reference" not in page.inner_text("#points-note")
        if number < 3:
            assert f"{number} of at least 3" in page.inner_text("#points-note")
    page.wait_for_selector(".stage.filled")
    settled(page)
    np.testing.assert_allclose(points(page, "target"), places, atol=0.02)
    assert page.inner_text("#stage-problem") == ""
    page.select_option("#point", "4")
    page.click("#remove")
    settled(page)
    assert len(api(page, "/landmarks/target")[1]["points"]) == 4
    with page.expect_download():
        page.click("#export")
    until(page, "document.querySelector('#status').textContent.startsWith('Exported')")
