"""Who is relit and who gives the light: photos that come later, and photos that change places."""

import numpy as np
import pytest

from tests.studio.e2e.page import api, begin, drop, points, quiet, settled

pytestmark = [pytest.mark.e2e, pytest.mark.slow, pytest.mark.rotating]


@pytest.fixture
def pair(visit, photos):
    """The page with a person and a light."""
    page = visit(fit=False)
    begin(page, *photos)
    return page


def names(page):
    return page.evaluate("JSON.parse(sessionStorage.getItem('relit')).names")


def looks(page):
    """The looks of photos, and which one is in use."""
    cards = page.locator("#looks li:has(.away) .look")
    return [(one.inner_text(), one.get_attribute("aria-pressed") == "true") for one in cards.all()]


def test_after_a_swap_both_photos_can_still_be_had(pair, photos):
    page, (one, other) = pair, [photo.name for photo in photos]
    there = {role: points(page, role) for role in ("target", "reference")}
    page.evaluate("document.querySelector('#fit').open = true")
    page.click("#swap")
    settled(page)
    assert names(page) == {"target": other, "reference": one}
    assert sorted(looks(page)) == sorted([(one, True), (other, False)])
    for look in (other, one):
        page.locator("#looks .look", has_text=look).click()
        settled(page)
    assert names(page)["reference"] == one
    np.testing.assert_array_equal(points(page, "target"), there["reference"])
    np.testing.assert_array_equal(points(page, "reference"), there["target"])
    page.click("#undo")
    settled(page)
    assert api(page, "")[1]["reference"]["width"] == api(page, "")[1]["target"]["width"], (
        "the other's own light"
    )
    np.testing.assert_array_equal(points(page, "reference"), there["reference"])
    page.click("#swap")
    settled(page)
    assert len(looks(page)) == 2, "who is at hand already is not there twice"


def test_a_third_photo_does_not_replace_the_person(pair, photos, tmp_path):
    page = pair
    third = tmp_path / "third.png"
    third.write_bytes(photos[0].read_bytes())
    drop(page, "#stage", third)
    settled(page)
    assert names(page) == {"target": photos[0].name, "reference": third.name}
    assert looks(page) == [(photos[1].name, False), (third.name, True)]
    page.set_input_files("#open", photos[1])
    settled(page)
    assert names(page)["target"] == photos[0].name


def test_two_places_are_offered_while_a_third_photo_is_dragged(pair, photos):
    page = pair
    assert not page.locator("#zones").is_visible()
    carried = page.evaluate_handle(
        """() => {
            const carried = new DataTransfer();
            carried.items.add(new File(["x"], "x.png"));
            return carried;
        }"""
    )
    page.dispatch_event("#stage", "dragover", {"dataTransfer": carried})
    assert page.locator("#zones").is_visible()
    page.dispatch_event("#zones [data-role=target]", "dragover", {"dataTransfer": carried})
    assert page.locator("#zones").is_visible()
    drop(page, "#zones [data-role=target]", photos[1])
    settled(page)
    assert names(page) == {"target": photos[1].name, "reference": photos[1].name}
    drop(page, "#zones [data-role=reference]", photos[0])
    settled(page)
    assert names(page) == {"target": photos[1].name, "reference": photos[0].name}
    assert not page.locator("#zones").is_visible()
    quiet(page)
