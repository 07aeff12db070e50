"""On a phone the picture stays in sight, and leaves room for what changes it."""

import pytest

from tests.studio.e2e.page import drawn, drop, settled, touch

pytestmark = [pytest.mark.e2e, pytest.mark.slow, pytest.mark.rotating]

#: The shares of things that are seen, of what is looked at in a grid of places of each.
SHARES = """(selectors) => selectors.map((selector) => {
    const box = document.querySelector(selector).getBoundingClientRect();
    const shares = [...Array(9).keys()].map((k) => (k + 0.5) / 9);
    const places = shares.flatMap((x) => shares.map((y) => [box.x + x * box.width, box.y + y * box.height]));
    const seen = ([x, y]) => document.elementFromPoint(x, y)?.closest(selector);
    return places.filter(seen).length / places.length;
})"""


@pytest.fixture
def phone(visit, photos):
    """Open the page on a phone, with so many portraits."""

    def open_page(height, many):
        page = visit(fit=False, viewport={"width": 360, "height": height}, has_touch=True, is_mobile=True)
        drop(page, "#stage", *[photos[0]] * many)
        page.wait_for_selector(".stage.filled")
        settled(page)
        return page

    return open_page


@pytest.mark.parametrize(("height", "many"), [(640, 1), (740, 4)])
def test_the_picture_is_seen_with_the_whole_ball_and_with_every_control(phone, height, many):
    page = phone(height, many)
    for selector in ("#desk .ball", "#option-strength"):
        seen = []
        for top in range(0, page.evaluate("document.documentElement.scrollHeight") - height, 20):
            page.evaluate("(top) => scrollTo(0, top)", top)
            seen.append(page.evaluate(SHARES, [selector, "#viewer .panes"]))
        together = [picture for control, picture in seen if control == 1]
        assert max(together) == 1
        assert page.locator("#viewer .panes").bounding_box()["height"] < 0.45 * height
        assert len(together) >= 3, "not at one place alone"


def test_one_finger_scrolls_the_page_from_the_picture_and_from_its_bar(phone):
    page = phone(640, 1)
    picture = page.locator("#viewer .pane.main").bounding_box()
    for share in (0.25, 0.5):
        page.evaluate("scrollTo(0, 0)")
        drawn(page)
        x, y = picture["x"] + share * picture["width"], picture["y"] + 0.9 * picture["height"]
        touch(page, *([(x, y - 10 * k)] for k in range(15)))
        assert page.evaluate("scrollY") > 50
