"""The lighting desk: from a dropped portrait to a file with layers, in a light that a hand has moved."""

import base64
import io
import json
import zipfile

import numpy as np
import pytest
from PIL import Image
from PIL.PngImagePlugin import PngInfo

from relit.cli import app as cli
from relit.face.detect import detect_landmarks
from relit.photo.reading import read_image
from relit.settings_file import from_json
from tests.studio.e2e.page import api, drag, drop, on_screen, points, quiet, settled, touch, until

pytestmark = [pytest.mark.e2e, pytest.mark.slow, pytest.mark.rotating]

RESULT = "#viewer .main .after img"


def options(page):
    return json.loads(page.evaluate("sessionStorage.getItem('relit')"))["options"]


def seen(page):
    """Return the pixels of the result that is shown."""
    data = page.evaluate(
        """(selector) => {
            const picture = document.querySelector(selector);
            const canvas = document.createElement("canvas");
            [canvas.width, canvas.height] = [picture.naturalWidth, picture.naturalHeight];
            canvas.getContext("2d").drawImage(picture, 0, 0);
            return canvas.toDataURL().split(",")[1];
        }""",
        RESULT,
    )
    return np.asarray(Image.open(io.BytesIO(base64.b64decode(data))).convert("L"), float)


@pytest.fixture
def alone(visit, photos):
    """The page with a portrait and no reference."""
    page = visit(fit=False)
    drop(page, "#stage", photos[0])
    page.wait_for_selector(".stage.filled")
    settled(page)
    return page


def sides(picture):
    """Return how bright the left and the right half of the middle are."""
    height, width = picture.shape
    middle = picture[height // 4 : 3 * height // 4]
    return middle[:, width // 4 : width // 2].mean(), middle[:, width // 2 : 3 * width // 4].mean()


def test_a_portrait_a_lamp_a_look_and_a_file_with_layers(alone, photos, tmp_path):
    page = alone
    assert options(page)["light"] == "loop", "a portrait alone gets a lamp"
    assert page.locator("#fit").get_attribute("open") is None
    left, right = sides(seen(page))
    box = page.locator("#desk .ball button").bounding_box()
    drag(page, box["x"] + box["width"] / 2, box["y"] + box["height"] / 2, 60, 0)
    settled(page)
    azimuth = float(options(page)["light"].split(",")[0])
    assert azimuth > 0, "the lamp went to the right"
    assert right / left < sides(seen(page))[1] / sides(seen(page))[0], "and so did the light"

    page.focus("#option-strength")  # which digits are not typed into
    page.keyboard.press("3")
    settled(page)
    third = page.locator("#looks li").nth(2)
    assert options(page)["light"] == third.locator(".look").inner_text().lower()
    assert third.locator(".look").get_attribute("aria-pressed") == "true"
    # Each look is shown on the face in hand.
    until(page, "[...document.querySelectorAll('#looks img')].filter((one) => one.naturalWidth).length === 6")

    page.get_by_role("button", name="Side by side").click()
    assert page.locator("#viewer .twin img").is_visible()

    page.select_option("#format", ".ora")
    with page.expect_download() as download:
        page.click("#export")
    with zipfile.ZipFile(download.value.path()) as packed:
        assert set(packed.namelist()) == {"relit.ora", "target.json", "settings.json"}
        packed.extractall(tmp_path)
    pyora = pytest.importorskip("pyora")
    project = pyora.Project.load(str(tmp_path / "relit.ora"))
    names = [layer.name for layer in project.children]
    assert names[0] == "Relit"
    assert names[-1] == "Photo"
    with Image.open(photos[0]) as photo:
        assert project.dimensions == photo.size
        bottom = np.asarray(project.children[-1].get_image_data(raw=True).convert("RGB"))
        np.testing.assert_array_equal(bottom, np.asarray(photo.convert("RGB")))


def test_the_command_that_is_copied_makes_what_is_exported(alone, photos, tmp_path, monkeypatch):
    page = alone
    page.fill("#option-strength-number", "0.6")
    page.keyboard.press("Tab")
    settled(page)
    page.get_by_text("Take it further").click()
    page.click("#command")
    until(page, "document.querySelector('#status').textContent.includes('relit transfer')")
    told = page.inner_text("#status").removeprefix("Copied: ")
    words = told.split()
    assert words[:3] == ["relit", "transfer", photos[0].name]
    monkeypatch.chdir(photos[0].parent)
    made = tmp_path / "made.png"
    with pytest.raises(SystemExit) as stop:
        cli.main([*words[1:-1], str(made)])
    assert stop.value.code == 0
    with page.expect_download() as download:
        page.click("#export")
    with zipfile.ZipFile(download.value.path()) as packed:
        exported = Image.open(io.BytesIO(packed.read("relit.png")))
    with Image.open(made) as picture:
        np.testing.assert_array_equal(np.asarray(picture), np.asarray(exported))


def test_what_a_format_cannot_keep_is_told(alone, photos, tmp_path):
    page, texts = alone, PngInfo()
    texts.add_text("Title", "A face")
    with Image.open(photos[0]) as photo:
        photo.save(tmp_path / "told.png", pnginfo=texts)
    drop(page, ".photo[data-role=target]", tmp_path / "told.png")
    settled(page)
    for suffix, told in ((".png", ""), (".jpg", " This format does not keep text (Title).")):
        page.select_option("#format", suffix)
        with page.expect_download():
            page.click("#export")
        # At once: a preview that comes later says so there.
        until(page, f"document.querySelector('#status').textContent === 'Exported relit.zip.{told}'")
        page.evaluate("document.querySelector('#status').textContent = ''")


def test_references_are_kept_as_looks_and_carried_round(alone, photos):
    page = alone
    drop(page, "#stage", photos[1])
    settled(page)
    assert options(page)["light"] is None, "a second photo gives its light"
    look = page.locator("#looks li", has_text=photos[1].name)
    assert look.locator(".look").get_attribute("aria-pressed") == "true"
    ball = page.locator("#desk .ball").bounding_box()
    drag(page, ball["x"] + ball["width"] / 2, ball["y"] + ball["height"] / 2, 40, -20)
    settled(page)
    assert options(page)["turn"] > 5
    assert options(page)["tilt"] > 5
    page.locator("#looks li", has_text="Rim").locator(".look").click()
    settled(page)
    assert (options(page)["light"], options(page)["turn"]) == ("rim", 0)
    look.locator(".look").click()
    settled(page)
    assert options(page)["light"] is None
    look.get_by_label("in front").click()
    assert photos[1].name in page.locator("#looks li").first.inner_text(), "a starred look comes first"
    page.reload()
    page.wait_for_selector(".stage.filled")
    settled(page)
    assert photos[1].name in page.locator("#looks li").first.inner_text()
    page.locator("#looks li").first.get_by_label("Take").click()
    quiet(page)
    assert list(api(page, "/references")[1]) == []


def test_two_settings_are_compared(alone):
    page = alone
    page.fill("#option-strength-number", "0.5")
    page.keyboard.press("Tab")
    settled(page)
    page.click("#slot-b")
    page.fill("#option-strength-number", "1.5")
    page.keyboard.press("Tab")
    settled(page)
    for slot, strength in (("a", 0.5), ("b", 1.5), ("a", 0.5)):
        page.click(f"#slot-{slot}")
        settled(page)
        assert options(page)["strength"] == strength


def test_undo_goes_back_to_the_settings_that_it_undoes(alone):
    page = alone

    def chosen():
        lit = page.locator("#slot-a, #slot-b").evaluate_all("all => all.map((one) => one.ariaPressed)")
        return "ab"[lit.index("true")], options(page)["light"]

    page.locator("#looks .look", has_text="Rembrandt").click()
    page.click("#slot-b")
    page.locator("#looks .look", has_text="Split").click()
    for do, then in (
        ("#slot-a", ("a", "rembrandt")),
        ("#slot-b", ("b", "split")),
        ("#undo", ("a", "rembrandt")),
        ("#slot-b", ("b", "split")),
        ("#slot-a", ("a", "rembrandt")),
    ):
        page.click(do)
        settled(page)
        assert chosen() == then


def test_two_settings_are_compared_on_whatever_photo_is_in_hand(alone, photos):
    """Neither keeps the landmarks of the photo that it was made on."""
    page = alone
    page.click("#slot-b")
    page.evaluate("document.querySelector('#fit').open = true")
    page.set_input_files(".photo[data-role=target] .head input", photos[1])
    settled(page)
    placed = points(page, "target")
    for slot in ("a", "b"):
        page.click(f"#slot-{slot}")
        settled(page)
        np.testing.assert_array_equal(points(page, "target"), placed)


def test_a_reference_that_was_taken_out_stays_in_use(alone, photos):
    page = alone
    drop(page, "#stage", photos[1])
    settled(page)
    page.locator("#looks li", has_text="Rim").locator(".look").click()
    settled(page)
    assert page.locator("#undo").is_enabled()
    page.locator("#looks li", has_text=photos[1].name).get_by_label("Take").click()
    settled(page)
    page.click("#undo")
    settled(page)
    assert options(page)["light"] is None, "it gives its light, if it did"


def test_lamps_are_added_coloured_and_taken_away(alone):
    page = alone
    assert not page.locator("#desk [name=power]").is_visible(), "the strongest lamp counts as 1"
    page.click("#desk [data-do=add]")
    assert page.locator("#desk [name=power]").nth(1).is_visible()
    page.locator("#desk li").nth(1).locator("[name=color]").fill("#ff8000")
    settled(page)
    assert options(page)["light"].count("+") == 1
    assert "color=#ff8000" in options(page)["light"]
    page.locator("#desk li").first.locator("[data-do=remove]").click()
    settled(page)
    assert "+" not in options(page)["light"]


def test_many_photos_become_a_film_strip_that_is_saved_together(visit, photos, tmp_path):
    page, files = visit(fit=False), []
    for k in range(2):
        files.append(tmp_path / f"portrait {k}.png")
        files[-1].write_bytes(photos[0].read_bytes())
    files.append(tmp_path / "wall.png")
    Image.new("RGB", (200, 200), "grey").save(files[-1])
    drop(page, "#stage", *files)
    page.wait_for_selector(".stage.filled")
    settled(page)
    assert page.locator("#film li").count() == 3
    page.click("#fit > summary")  # which nothing hides
    with page.expect_download() as download:
        page.click("#film [data-do=all]")
    with zipfile.ZipFile(download.value.path()) as packed:
        assert packed.testzip() is None
        assert packed.namelist() == ["portrait 0.png", "portrait 1.png"]
        one, other = (Image.open(io.BytesIO(packed.read(name))) for name in packed.namelist())
        np.testing.assert_array_equal(np.asarray(one), np.asarray(other))
    assert "2 photos relit. 1 could not be" in page.inner_text("#film [role=status]")
    assert "No face" in page.locator("#film .bad").get_attribute("title")
    assert list(api(page, "/references")[1]) == []


def test_a_film_strip_tells_what_the_format_does_not_keep(visit, photos, tmp_path):
    page, files = visit(fit=False), [tmp_path / f"{k}.jpg" for k in range(3)]
    for file in files:
        with Image.open(photos[0]) as image:
            image.convert("RGB").save(file, **({"comment": b"on the stairs"} if file is files[1] else {}))
    drop(page, "#stage", *files)
    page.wait_for_selector(".stage.filled")
    settled(page)
    page.select_option("#format", ".exr")
    with page.expect_download() as download:
        page.click("#film [data-do=all]")
    assert download.value.path()
    told = page.inner_text("#film [role=status]")
    assert told.startswith("3 photos relit. This format does not keep ")
    assert "text (Comment)" in told
    titles = [button.get_attribute("title") for button in page.locator("#film li button").all()]
    assert [bool(title) for title in titles] == [False, True, False]
    assert titles[1].startswith("Saved without ")


def test_a_photo_without_a_face_leads_to_the_fit_and_is_named(visit, tmp_path):
    page, wall = visit(fit=False), tmp_path / "wall.png"
    Image.new("RGB", (200, 200), "grey").save(wall)
    drop(page, "#stage", wall)
    page.wait_for_selector(".photo[data-role=target].filled")
    quiet(page)
    assert page.locator("#fit").get_attribute("open") is not None
    assert page.inner_text("#stage-problem").startswith("wall.png: No face")


def test_help_is_in_whole_sentences_on_hover_focus_and_tap(alone):
    page = alone
    hint, ask = page.locator("#option-strength-help"), page.get_by_label("Help on Strength")
    assert not hint.is_visible()
    ask.hover()
    assert hint.is_visible()
    page.mouse.move(0, 0)
    assert not hint.is_visible()
    ask.click()
    page.mouse.move(0, 0)
    assert hint.is_visible()
    assert hint.inner_text().endswith(".")


@pytest.mark.parametrize(
    ("width", "scheme"), [(360, "dark"), (768, "light"), (1280, "dark"), (1920, "light"), (3840, "dark")]
)
def test_the_result_is_first_and_the_largest_at_every_width(visit, photos, width, scheme):
    page = visit(fit=False, viewport={"width": width, "height": 900}, color_scheme=scheme, has_touch=True)
    drop(page, "#stage", photos[0])
    page.wait_for_selector(".stage.filled")
    settled(page)
    assert page.evaluate("document.documentElement.scrollWidth") == width
    result = page.locator("#viewer .pane.main").bounding_box()
    assert result["y"] < 300
    area = result["width"] * result["height"]
    for other in page.locator("#looks img, .ball").all():
        if box := other.bounding_box():
            assert box["width"] * box["height"] < area
    x, y = result["x"] + result["width"] / 2, result["y"] + result["height"] / 2
    before = page.locator(RESULT).bounding_box()["width"]
    touch(page, ((x - 20, y), (x + 20, y)), ((x - 60, y), (x + 60, y)))
    assert page.locator(RESULT).bounding_box()["width"] > 1.5 * before


def test_a_part_is_picked_on_the_face(alone, photos):
    page = alone
    nose = detect_landmarks(read_image(photos[0]).pixels).xy[4]
    page.click("#pick")
    with Image.open(photos[0]) as photo:
        width = photo.width
    box = page.locator(RESULT).bounding_box()
    x, y = (nose + 0.5) * box["width"] / width
    page.mouse.click(box["x"] + x, box["y"] + y)
    settled(page)
    assert options(page)["region"] == "nose"
    page.mouse.click(box["x"] + 3, box["y"] + 3)
    quiet(page)
    assert options(page)["region"] == "nose"
    assert page.inner_text("#status") == "That is beside the face."
    page.click("#pick")
    page.click("[data-part=face]")
    settled(page)
    assert options(page)["region"] == "face"


def test_settings_go_to_a_file_and_come_from_it(alone, visit, photos, tmp_path):
    page = alone
    page.fill("#option-strength-number", "0.7")
    page.keyboard.press("Tab")
    settled(page)
    page.get_by_text("Take it further").click()
    with page.expect_download() as download:
        page.click("#save-settings")
    download.value.save_as(tmp_path / "settings.json")
    assert from_json((tmp_path / "settings.json").read_bytes()).options.strength == 0.7
    other = visit(fit=False)
    drop(other, "#stage", photos[0])
    other.wait_for_selector(".stage.filled")
    (tmp_path / "other.json").write_text("[1]")
    for name, strength in (("other.json", 1), ("settings.json", 0.7)):
        other.set_input_files("#load-settings", tmp_path / name)
        quiet(other)
        assert options(other)["strength"] == strength


def test_the_export_of_a_film_strip_can_be_stopped(visit, photos, tmp_path):
    page, files = visit(fit=False), []
    for k in range(6):
        files.append(tmp_path / f"portrait {k}.png")
        files[-1].write_bytes(photos[0].read_bytes())
    drop(page, "#stage", *files)
    page.wait_for_selector(".stage.filled")
    settled(page)
    held = []  # else all may be exported before the second click
    page.route("**/export", lambda route: held.append(route))
    page.click("#film [data-do=all]")
    page.click("#film [data-do=stop]")
    until(page, "!document.querySelector('#film [data-do=all]').hidden")
    assert "Stopped after" in page.inner_text("#film [role=status]")
    assert "of 6" in page.inner_text("#film [role=status]")


def test_a_magnifier_shows_what_the_hand_hides(sitting):
    before = points(sitting, "target")
    x, y, _ = on_screen(sitting, "target", before[152])
    loupe = sitting.locator(".photo[data-role=target] .loupe")
    assert not loupe.is_visible()
    sitting.mouse.move(x, y)
    sitting.mouse.down()
    sitting.mouse.move(x + 5, y + 5, steps=3)
    assert loupe.is_visible()
    sitting.mouse.up()
    assert not loupe.is_visible()


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("width", [360, 1280])
def test_axe_finds_nothing(visit, photos, width, scheme):
    axe = pytest.importorskip("axe_playwright_python.sync_playwright")
    # Axe is put into the page, which lets in no script of others.
    viewport = {"width": width, "height": 900}
    page = visit(viewport=viewport, color_scheme=scheme, bypass_csp=True)
    drop(page, "#stage", *photos)
    page.wait_for_selector(".stage.filled")
    settled(page)
    for part in page.locator("details").all():
        part.evaluate("one => (one.open = true)")
    page.click("[data-from=lamp]")
    settled(page)
    found = axe.Axe().run(page)
    assert found.violations_count == 0, found.generate_report()
