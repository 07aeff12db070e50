"""What is taken out of the page: the command, settings, and the picture itself."""

import io
import json
import re
import shlex
import zipfile

import numpy as np
import pytest
from PIL import Image

from relit.cli import app as cli
from relit.photo.samples import SAMPLES
from tests.studio.e2e.page import begin, drag, drop, on_screen, points, quiet, settled, until

pytestmark = [pytest.mark.e2e, pytest.mark.slow, pytest.mark.rotating]


def options(page):
    return json.loads(page.evaluate("sessionStorage.getItem('relit')"))["options"]


@pytest.fixture
def alone(visit, photos):
    """The page with a portrait and no reference, and what can be taken further in sight."""

    def open_page(photo=photos[0], **settings):
        page = visit(**settings)
        drop(page, "#stage", photo)
        page.wait_for_selector(".stage.filled")
        settled(page)
        page.get_by_text("Take it further").click()
        return page

    return open_page


def command(page):
    """Return the words of the command that is copied, and what is said of it."""
    page.evaluate("document.querySelector('#status').textContent = ''")
    page.click("#command")
    until(page, "document.querySelector('#status').textContent.includes('relit transfer')")
    text, _, more = page.inner_text("#status").removeprefix("Copied: ").partition(" (")
    return shlex.split(text), more


def exported(page):
    with page.expect_download() as download:
        page.click("#export")
    return zipfile.ZipFile(download.value.path())


def test_the_command_takes_landmarks_that_were_placed_from_the_export(alone, photos, tmp_path, monkeypatch):
    page = alone()
    assert "--config" not in command(page)[0]
    x, y, _ = on_screen(page, "target", points(page, "target")[152])
    drag(page, x, y, 12, 12)
    settled(page)
    words, more = command(page)
    assert "settings.json" in more
    with exported(page) as packed:
        packed.extractall(tmp_path)
    (tmp_path / photos[0].name).write_bytes(photos[0].read_bytes())
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SystemExit) as stop:
        cli.main(words[1:])
    assert stop.value.code == 0
    assert (tmp_path / words[-1]).read_bytes() == (tmp_path / "relit.png").read_bytes()


def test_the_command_names_files_that_are_there(alone, photos, tmp_path):
    odd = tmp_path / "-rf.jpg"
    odd.write_bytes(photos[1].read_bytes())
    page = alone(odd)
    page.select_option("#format", ".exr")
    words, _ = command(page)
    assert words[2] == "./-rf.jpg"
    with exported(page) as packed:
        made = packed.namelist()[0]
    assert words[-1] == f"./-rf-{made}"
    page.click("#samples")
    page.wait_for_selector(".photo[data-role=reference].filled")
    settled(page)
    assert command(page)[0][2:4] == [SAMPLES["target"], SAMPLES["reference"]]


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"light": 5}, "light: expected a text, got 5"),
        ({"strength": "much"}, "strength: expected a number"),
        ({"strength": 40}, "strength: expected a number"),
        ({"region": None}, "region: expected a text, got null"),
        ({"full_resolution": 1}, "full_resolution: expected true or false, got 1"),
        ({"method": "magic"}, "method: expected one of shading"),
        ({"streng": 2}, "streng is no option"),
        ([], "is not a file of settings"),
    ],
)
def test_settings_of_a_wrong_kind_are_refused_by_name(blank, address, given, said):
    page = blank()
    page.goto(address)
    page.wait_for_selector("#samples:enabled")
    file = {
        "name": "my.json",
        "mimeType": "application/json",
        "buffer": json.dumps({"options": given}).encode(),
    }
    page.set_input_files("#load-settings", file)
    until(page, "document.querySelector('#stage-problem').textContent")
    told = page.inner_text("#stage-problem")
    assert told.startswith("my.json")
    assert said in told
    page.reload()
    page.wait_for_selector("#samples:enabled")
    assert page.inner_text("#stage-problem") == ""


def test_settings_that_were_exported_can_be_dropped(alone, tmp_path):
    page = alone()
    page.fill("#option-strength-number", "0.6")
    page.keyboard.press("Tab")
    settled(page)
    with exported(page) as packed:
        packed.extract("settings.json", tmp_path)
    page.click("#reset")
    settled(page)
    drop(page, "#stage", tmp_path / "settings.json")
    quiet(page)
    settled(page)
    assert options(page)["strength"] == 0.6
    assert options(page)["light"] == "loop"


def test_the_picture_is_copied_in_full_resolution(visit, photos, tmp_path):
    page = visit(fit=False, permissions=["clipboard-read", "clipboard-write"])
    large = tmp_path / "large.png"
    with Image.open(photos[0]) as photo:
        photo.resize((1350, 1530)).save(large)
    begin(page, large)
    shown = page.evaluate("document.querySelector('#viewer .main .after img').naturalWidth")
    assert shown < 1350
    page.get_by_text("Take it further").click()
    page.click("#copy-picture")
    until(page, "document.querySelector('#status').textContent.startsWith('Copied')")
    assert re.fullmatch(r"Copied the picture, 1350 . 1530\.", page.inner_text("#status"))
    copied = page.evaluate(
        """async () => {
            const [item] = await navigator.clipboard.read();
            const bytes = new Uint8Array(await (await item.getType("image/png")).arrayBuffer());
            return Array.from(bytes);
        }"""
    )
    with exported(page) as packed, Image.open(io.BytesIO(packed.read("relit.png"))) as made:
        expected = np.asarray(made.convert("RGB"))
    with Image.open(io.BytesIO(bytes(copied))) as picture:
        np.testing.assert_array_equal(np.asarray(picture.convert("RGB")), expected)


def test_a_fine_preview_is_as_sharp_as_what_is_seen(visit, photos, tmp_path):
    page = visit(fit=False)
    large = tmp_path / "large.png"
    with Image.open(photos[0]) as photo:
        photo.resize((1350, 1350)).save(large)
    begin(page, large)
    picture = page.locator("#viewer .main .after img")
    assert picture.evaluate("one => one.naturalWidth") >= picture.bounding_box()["width"]
