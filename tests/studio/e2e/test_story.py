"""The story that the studio is for, from two dropped photos to a file, and by keyboard alone."""

import re
import zipfile

import numpy as np
import pytest
from PIL import Image

from relit.cli import app as cli
from relit.face.detect import detect_landmarks
from relit.photo.reading import read_image
from tests.studio.e2e.page import drag, drop, on_screen, points, settled

pytestmark = [pytest.mark.e2e, pytest.mark.slow]


def finest(page):
    return float(re.search(r"below ([\d.]+) px", page.inner_text("#finest"))[1])


def test_from_two_photos_to_the_file_that_the_command_makes(visit, photos, tmp_path, monkeypatch):
    page = visit()
    drop(page, ".photo[data-role=reference]", *photos)
    page.wait_for_selector(".stage.filled")
    settled(page)
    for role, file in zip(("target", "reference"), photos, strict=True):
        np.testing.assert_allclose(
            points(page, role), detect_landmarks(read_image(file).pixels).xy, atol=1e-9
        )

    before, chin = points(page, "target"), 152
    x, y, scale = on_screen(page, "target", before[chin])
    page.mouse.move(x, y)
    for role in ("target", "reference"):
        place = on_screen(page, role, points(page, role)[chin])
        ring = page.locator(f".photo[data-role={role}] path.hovered").bounding_box()
        assert ring["x"] + ring["width"] / 2 == pytest.approx(place[0], abs=1), (
            "a hovered point shows its pair"
        )
    drag(page, x, y, 15, 9)
    settled(page)
    moved = points(page, "target")
    np.testing.assert_allclose(moved[chin] - before[chin], np.array([15, 9]) / scale, atol=0.02)
    np.testing.assert_array_equal(np.delete(moved, chin, 0), np.delete(before, chin, 0))

    page.click("#expert summary")
    coarse = finest(page)
    page.fill("#option-lam-number", "0.1")
    page.keyboard.press("Tab")
    settled(page)
    assert finest(page) == pytest.approx(2 * coarse, abs=0.11), "half the lambda is twice the size"

    bar = page.get_by_role("slider", name="Before and after")
    box = page.locator("#viewer .pane.main").bounding_box()
    drag(page, box["x"] + box["width"] / 2, box["y"] + 20, -box["width"] / 4, 0)
    assert float(bar.get_attribute("aria-valuenow")) == pytest.approx(25, abs=1)

    reference = points(page, "reference")
    page.click("#swap")
    settled(page)
    np.testing.assert_array_equal(points(page, "target"), reference)
    np.testing.assert_array_equal(points(page, "reference"), moved)

    page.select_option("#format", ".jpg")
    with page.expect_download() as download:
        page.click("#export")
    with zipfile.ZipFile(download.value.path()) as packed:
        assert set(packed.namelist()) == {"relit.jpg", "target.json", "reference.json", "settings.json"}
        packed.extractall(tmp_path)
    monkeypatch.chdir(tmp_path)
    with Image.open("relit.jpg") as picture, Image.open(photos[1]) as target:
        assert picture.size == target.size
    command = ["transfer", str(photos[1]), str(photos[0]), "--config", "settings.json"]
    for more, alike in ((["-o", "again.jpg"], True), (["--strength", "0", "-o", "other.jpg"], False)):
        with pytest.raises(SystemExit) as stop:
            cli.main([*command, *more])
        assert stop.value.code == 0
        made = (tmp_path / more[-1]).read_bytes()
        assert (made == (tmp_path / "relit.jpg").read_bytes()) is alike


@pytest.mark.rotating
def test_by_keyboard_alone(visit):
    page = visit()

    def tab_to(selector):
        for _ in range(200):
            if page.evaluate("s => document.activeElement.matches(s)", selector):
                return
            page.keyboard.press("Tab")
        raise AssertionError(f"Tab never comes to {selector}")

    tab_to("#samples")
    page.keyboard.press("Enter")
    page.wait_for_selector(".stage.filled")
    settled(page)
    first = points(page, "target")
    tab_to("#swap")
    page.keyboard.press("Enter")
    settled(page)
    before = points(page, "reference")
    np.testing.assert_array_equal(before, first)
    tab_to(".photo[data-role=reference] .frame")
    page.keyboard.press("PageDown")
    row = int(page.input_value("#point"))
    page.keyboard.press("ArrowRight")
    page.keyboard.press("Shift+ArrowDown")
    assert f"Point {row}" in page.inner_text("#status")
    settled(page)
    moved = points(page, "reference")
    np.testing.assert_allclose(moved[row] - before[row], [1, 10], atol=1e-9)
    np.testing.assert_array_equal(np.delete(moved, row, 0), np.delete(before, row, 0))

    tab_to("#point")
    page.keyboard.press("ArrowDown")
    assert int(page.input_value("#point")) != row
    tab_to("#groups input[value=mouth]")
    page.keyboard.press("Space")
    assert page.evaluate("document.activeElement.value") == "mouth", "a group that is toggled keeps the focus"
    assert "mouth 61" not in page.inner_text("#point")
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
    page.keyboard.press("Control+z")
    settled(page)
    assert page.input_value("#option-strength-number") == "1"
    tab_to("#export")
    with page.expect_download():
        page.keyboard.press("Enter")


def test_everything_has_a_name_and_every_description_is_there(sitting):
    for field in sitting.locator("#controls input, #controls select").all():
        for name in (field.get_attribute("aria-describedby") or "").split():
            assert sitting.locator(f"#{name}").count() == 1
    unnamed = sitting.evaluate(
        """() => [...document.querySelectorAll("button, input, select, [role=slider]")].filter(
            (one) => !(one.labels?.length || one.getAttribute("aria-label") || one.textContent.trim())
        ).map((one) => one.outerHTML)"""
    )
    assert unnamed == []
