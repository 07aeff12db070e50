"""Landmarks in the page: by hand, by finger, from files, in groups."""

import re

import numpy as np
import pytest
from PIL import Image

from relit.face.landmark_files import read_landmarks, write_landmarks
from relit.face.landmarks import Landmarks
from tests.studio.e2e.page import api, drag, on_screen, points, quiet, settled, touch

pytestmark = [pytest.mark.e2e, pytest.mark.slow, pytest.mark.rotating]

#: Rows of the mesh that are about where the 68 points of iBUG are.
# fmt: off
MESH_TO_68 = [
    127, 234, 93, 132, 58, 172, 136, 150, 152, 379, 365, 397, 288, 361, 323, 454, 356, 70, 63, 105, 66, 107,
    336, 296, 334, 293, 300, 168, 197, 5, 4, 75, 97, 2, 326, 305, 33, 160, 158, 133, 153, 144, 362, 385, 387,
    263, 373, 380, 61, 39, 37, 0, 267, 269, 291, 405, 314, 17, 84, 181, 78, 82, 13, 312, 308, 317, 14, 87,
]
# fmt: on


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
        quiet(page)
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
    x, y, scale = on_screen(page, "target", (200, 40))
    page.mouse.click(x, y)
    assert "point 5 in the reference" in page.inner_text("#points-note")
    settled(page)
    assert len(points(page, "target")) == 5, "a point without its partner does not count"
    page.keyboard.press("Control+z")

    drag(page, x, y, 20, 10)
    settled(page)
    np.testing.assert_allclose(on_screen(page, "target", (200, 40)), [x + 20, y + 10, scale], atol=0.1)
    assert len(points(page, "target")) == 5, "a drag moves the photo, and places nothing"

    page.click("#add")
    page.select_option("#point", "4")
    page.click("#remove")
    settled(page)
    for role in ("target", "reference"):
        np.testing.assert_allclose(points(page, role), places[:4], atol=0.02)
    with page.expect_download():
        page.click("#export")


def test_what_is_done_can_be_undone_and_snapped_back(editing):
    before, brow = points(editing, "reference"), 105
    x, y, _ = on_screen(editing, "reference", before[brow])
    drag(editing, x, y, -12, 7)
    quiet(editing)
    moved = points(editing, "reference")
    assert (moved != before).any(axis=1).sum() == 1
    for keys, expected in (("Control+z", before), ("Control+Shift+Z", moved), ("Control+z", before)):
        editing.keyboard.press(keys)
        quiet(editing)
        np.testing.assert_array_equal(points(editing, "reference"), expected)
    editing.keyboard.press("Control+y")
    editing.click("#snap")
    quiet(editing)
    np.testing.assert_array_equal(points(editing, "reference"), before)


def test_a_group_that_is_switched_off_cannot_be_moved(editing):
    before, tip = points(editing, "target"), 4
    for name in ("nose", "mouth", "inner_mouth", "cheeks"):
        editing.uncheck(f"#groups input[value={name}]")
    x, y, _ = on_screen(editing, "target", before[tip])
    drag(editing, x, y, 0, 8)
    quiet(editing)
    np.testing.assert_array_equal(points(editing, "target"), before)
    assert on_screen(editing, "target", before[tip])[1] == pytest.approx(y + 8, abs=0.1), "it moves the photo"
    editing.check("#groups input[value=nose]")
    drag(editing, x, y + 8, 0, 8)
    quiet(editing)
    assert (points(editing, "target") != before).any(axis=1).nonzero()[0].tolist() == [tip]


def test_deleting_a_landmark_of_the_mesh_keeps_both_faces_paired(editing):
    before = points(editing, "target")
    editing.select_option("#point", "152")
    editing.click("#remove")
    quiet(editing)
    target, reference = points(editing, "target"), points(editing, "reference")
    assert len(target) == len(reference) < 478
    assert not (target == before[152]).all(axis=1).any()
    assert api(editing, "/landmarks/reference")[1]["scheme"] == "points"
    editing.click("#undo")
    quiet(editing)
    np.testing.assert_array_equal(points(editing, "target"), before)


def test_landmarks_go_to_files_of_every_format_and_come_from_them(editing, tmp_path):
    expected = points(editing, "target")
    formats = editing.locator(".photo[data-role=target] .landmark-format option").all_inner_texts()
    assert formats == editing.evaluate(
        "fetch('/api/v1/options').then(r => r.json()).then(o => o.landmark_formats)"
    )
    editing.select_option("#point", "152")
    for suffix in formats:
        editing.select_option(".photo[data-role=target] .landmark-format", suffix)
        with editing.expect_download() as download:
            editing.click(".photo[data-role=target] [data-do=save]")
        assert download.value.suggested_filename == f"target{suffix}"
        file = tmp_path / f"face{suffix}"
        download.value.save_as(file)
        saved = read_landmarks(file)
        np.testing.assert_allclose(saved.xy, expected, atol=1e-6)
        expected += (0.5, -0.25)
        write_landmarks(file, saved.shifted(0.5, -0.25), overwrite=True)
        editing.set_input_files(".photo[data-role=target] .landmark-file", file)
        quiet(editing)
        np.testing.assert_allclose(points(editing, "target"), expected, atol=1e-6)
        shown = re.search(r"target ([\d.]+), ([\d.]+)", editing.inner_text("#place"))
        np.testing.assert_allclose([float(at) for at in shown.groups()], expected[152], atol=0.051)


def test_landmarks_of_another_kind_need_a_partner_and_bring_their_groups(editing, tmp_path):
    for role in ("target", "reference"):
        few = Landmarks(points(editing, role)[MESH_TO_68], scheme="ibug68")
        write_landmarks(tmp_path / f"{role}.pts", few)
    editing.set_input_files(".photo[data-role=target] .landmark-file", tmp_path / "target.pts")
    quiet(editing)
    assert "load two files of one kind" in editing.inner_text("#points-note")
    assert editing.locator("#export").is_disabled()
    editing.set_input_files(".photo[data-role=reference] .landmark-file", tmp_path / "reference.pts")
    quiet(editing)
    assert editing.inner_text("#points-note") == ""
    groups = editing.locator("#groups input").evaluate_all("boxes => boxes.map((box) => box.value)")
    assert set(groups) >= {"jaw", "brows", "eyes", "nose", "mouth"}


def test_a_file_that_holds_no_landmarks_is_told_beside_the_photo(editing):
    problem = editing.locator(".photo[data-role=target] .problem")
    for name, text, said in (
        ("face.txt", "10 20", ".pts"),
        ("face.pts", "10 20", "the file: expected the points"),
    ):
        editing.set_input_files(
            ".photo[data-role=target] .landmark-file",
            {"name": name, "mimeType": "text/plain", "buffer": text.encode()},
        )
        quiet(editing)
        assert said in problem.inner_text()
    assert len(points(editing, "target")) == 478


def test_two_fingers_zoom_and_move_a_photo(editing):
    page = editing
    before, nose = points(page, "target"), 4
    x, y, scale = on_screen(page, "target", before[nose])
    apart = [[(x - far, y), (x + far, y)] for far in (30, 40, 50, 60)]
    touch(page, apart[0][:1], *apart)
    np.testing.assert_allclose(on_screen(page, "target", before[nose]), [x, y, 2 * scale], atol=0.5)
    touch(page, apart[0][:1], *([(a + by, b + by) for a, b in apart[0]] for by in (0, 10, 20)))
    np.testing.assert_allclose(on_screen(page, "target", before[nose]), [x + 20, y + 20, 2 * scale], atol=0.5)
    quiet(page)
    np.testing.assert_array_equal(points(page, "target"), before)

    page.click("#by-hand")
    touch(page, [(x, y)], apart[0], apart[0][:1])
    assert page.evaluate("document.getElementById('point').options.length") == 1, "two fingers place nothing"
    touch(page, [(x, y)])
    assert page.evaluate("document.getElementById('point').options.length") == 2, "one does"
    touch(page, [(x, y)], [(x + 20, y)], [(x + 30, y + 5)])
    assert "20" not in page.inner_text("#place")
