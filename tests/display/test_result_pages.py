"""Results as HTML that stands alone."""

import base64
import io
import re
from html.parser import HTMLParser

import numpy as np
import pytest
from PIL import Image

from relit import sample, transfer
from relit.display.html import LONGEST, image_html, result_html
from relit.photo.foreign_images import pixels_of


class Seen(HTMLParser):
    """What is in a page; fails if tags are left open."""

    VOID = ("img", "input", "meta", "link")

    def __init__(self, page):
        super().__init__()
        self.tags, self.open = [], []
        self.feed(page)
        self.close()
        assert self.open == []

    def handle_starttag(self, tag, attributes):
        self.tags.append((tag, dict(attributes)))
        if tag not in self.VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def all(self, name):
        return [attributes for tag, attributes in self.tags if tag == name]


def picture_of(attributes):
    kind, data = attributes["src"].split(",", 1)
    assert kind == "data:image/webp;base64"
    with Image.open(io.BytesIO(base64.b64decode(data))) as picture:
        assert (str(picture.width), str(picture.height)) == (attributes["width"], attributes["height"])
        return np.asarray(picture.convert("RGB"), int)


@pytest.fixture(scope="module")
def result():
    return transfer(sample("target"), light="split")


@pytest.fixture(scope="module")
def page(result):
    return result._repr_html_()


def test_before_and_after_are_in_it(result, page):
    before, after = (picture_of(one) for one in Seen(page).all("img")[:2])
    for shown, pixels in ((before, result.target), (after, result.image)):
        assert np.abs(shown - pixels).mean() < 3  # WebP loses a little
    assert np.abs(after - before).mean() > 3


def test_the_stages_are_those_of_the_figures(result, page):
    from relit.figures import STAGES, stage_pictures

    told = re.findall(r"<figcaption>([^<]*)</figcaption></figure>", page)
    assert told == [STAGES[name] for name in stage_pictures(result)]


def test_it_needs_no_script_and_fetches_nothing(page):
    seen = Seen(page)
    assert not {"script", "iframe", "link", "object"} & {tag for tag, _ in seen.tags}
    assert all(not name.startswith("on") for _, attributes in seen.tags for name in attributes)
    assert not re.search(r"https?:|url\(|@import", page)
    assert len(page) < 2_000_000


def test_the_slider_has_a_place_for_every_step(page):
    seen = Seen(page)
    steps = [one for one in seen.all("input") if one["type"] == "radio"]
    places = [float(re.search(r"left:([\d.]+)%", one["style"])[1]) for one in steps]
    assert np.allclose(np.diff([*places, 100]), 100 / len(steps))
    assert sum("checked" in one for one in steps) == 1


def test_what_is_told_is_escaped():
    page = image_html(np.zeros((9, 9), np.uint8), '<script>alert("x")</script> & "more"')
    assert [one["alt"] for one in Seen(page).all("img")] == ['<script>alert("x")</script> & "more"']
    assert Seen(page).all("script") == []


def test_large_photos_are_reduced():
    (shown,) = Seen(image_html(np.zeros((900, 3000), np.uint8))).all("img")
    assert picture_of(shown).shape == (round(900 * LONGEST / 3000), LONGEST, 3)


def test_results_of_every_kind_are_shown(result):
    target = Image.open(sample("target")).convert("RGBA")
    made = transfer(target, light="split")
    assert isinstance(made.image, Image.Image)
    np.testing.assert_array_equal(pixels_of(made.image, "image"), result.image)
    assert len(Seen(result_html(made)).all("img")) == len(Seen(result_html(result)).all("img"))


@pytest.mark.e2e
@pytest.mark.slow
def test_the_slider_moves_in_a_browser_without_scripts(result, page, tmp_path, browser):
    file = tmp_path / "page.html"
    file.write_text(f"<!doctype html><meta charset=utf-8><body style='margin:0'>{page}", "utf-8")
    context = browser.new_context(java_script_enabled=False)
    tab = context.new_page()
    tab.goto(file.as_uri())

    def half(x):
        """Return which picture is seen at a column, by the nearer of the two."""
        seen = Image.open(io.BytesIO(tab.screenshot())).convert("RGB").crop((0, 0, 512, 512))
        column = np.asarray(seen, int)[:, x]
        apart = [np.abs(column - one[:, x]).sum() for one in (result.target, result.image)]
        return ("before", "after")[int(np.argmin(apart))]

    tab.mouse.move(400, 600)
    assert (half(170), half(300)) == ("before", "after")
    tab.mouse.move(330, 100)
    assert (half(170), half(300)) == ("before", "before")
    tab.mouse.move(140, 100)
    assert (half(170), half(300)) == ("after", "after")
    tab.mouse.move(400, 600)
    tab.locator("input:checked").focus()
    for _ in range(8):
        tab.keyboard.press("ArrowRight")
    assert (half(170), half(300)) == ("before", "before")
    context.close()
