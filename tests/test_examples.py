"""The gallery: every figure is drawn, and what can be proven of it is."""

import functools
import re
from collections import Counter
from pathlib import Path

import numpy as np
import pytest

from examples import average, by_lambda, fig04_scales, lit
from examples.faces import Face, Faces, in_light, turned
from examples.gallery import FIGURES, figure
from relit import Landmarks, read_image, transfer
from relit.photo.samples import sample

drawn = functools.cache(figure)
#: On the same day as the test below, which draws it as well.
SHARED = {"complexions": pytest.mark.rotating("complexions")}


@pytest.fixture(scope="session")
def faces(yaleb, portraits):
    return Faces(yaleb, portraits)


@pytest.mark.slow
@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=SHARED.get(name, pytest.mark.rotating)) for name in FIGURES]
)
def test_figures_are_drawn(name, faces, monkeypatch):
    # The average itself is held to the truth in test_yaleb; a part of it is drawn like the whole.
    monkeypatch.setattr(average, "EVERY", 24)
    paper, picture, ours = drawn(name, faces)
    assert picture.dtype == np.uint8
    assert picture.ndim == 3
    assert paper.endswith(".")
    assert ours.endswith(".")
    assert re.search(r"\d", ours), "what we see is told in figures"
    if off := re.findall(r"([\d.]+) % off the (?:rendered )?truth", ours):
        # Relighting is nearer to the truth than leaving the target alone.
        own = re.findall(r"target(?: itself:|) \(?([\d.]+) %|was by ([\d.]+) %|\(target ([\d.]+) %", ours)
        assert max(map(float, off)) < max(float(part) for found in own for part in found if part)


@pytest.mark.rotating("complexions")
@pytest.mark.slow
def test_skin_keeps_its_hue(faces):
    _, _, seen = drawn("complexions", faces)
    largest, by_ltv = map(float, re.findall(r"largest ([\d.]+)", seen))
    assert largest <= 6 < by_ltv


def test_shapes_are_parted_exactly(faces):
    assert "6 of 6 λ" in fig04_scales.draw(faces)[1]
    planes = fig04_scales.shapes()
    assert np.sum(planes, axis=0).max() == 1, "shapes overlap"


@pytest.fixture
def ball():
    """A white half ball, as a face of many points."""
    angle, radius = np.meshgrid(np.linspace(0, 2 * np.pi, 40, endpoint=False), np.linspace(0.02, 1, 20))
    x, y = (radius * np.cos(angle)).ravel(), (radius * np.sin(angle)).ravel()
    points = np.column_stack([60 + 40 * x, 60 + 40 * y, -40 * np.sqrt(np.maximum(1 - x**2 - y**2, 0))])
    return Face(np.full((120, 120, 3), 200, np.uint8), Landmarks(points))


def test_light_from_the_side_is_lamberts(ball):
    lit = in_light(ball, 60, 0, (1, 0.5, 0)).pixels
    across = np.linspace(-0.5, 0.5, 11)
    lambert = np.maximum(-across * np.sin(np.pi / 3) + np.sqrt(1 - across**2) * np.cos(np.pi / 3), 0)
    for channel, share in enumerate((1, 0.5, 0)):
        wanted = 200 * (0.25 + 0.75 * share * lambert) ** (1 / 2.2)
        np.testing.assert_allclose(lit[60, np.rint(60 + 40 * across).astype(int), channel], wanted, atol=6)


def test_a_ball_that_turns_stays_a_ball_and_its_marks_move(ball):
    marked = ball.pixels.copy()
    marked[55:66, 55:66] = (255, 0, 0)
    view = turned(Face(marked, ball.landmarks), 40)
    red = np.argwhere((view.pixels[..., 0] > 240) & (view.pixels[..., 1] < 20)).mean(axis=0)
    # In the middle, it was nearest to the camera; the pivot lies at the ball's centre.
    assert red[0] == pytest.approx(60, abs=1.5)
    assert abs(red[1] - 60) == pytest.approx(40 * np.sin(np.deg2rad(40)), abs=2)
    front = np.argmin(ball.landmarks.points[:, 2])
    assert view.landmarks.xy[front] == pytest.approx(red[::-1], abs=2.5)


@pytest.mark.slow
def test_more_light_is_carried_by_larger_lambdas(faces):
    _, seen = by_lambda.by_lambda(faces, ("yaleB07", 0, 0), ("yaleB08", 50, 0), (0.01, 0.2))
    least, most = map(float, re.findall(r"([\d.]+) % off", seen))
    assert most < least / 2


def test_every_light_and_every_portrait_is_among_the_pairs(portraits, lit_photos):
    # The list is fixed, so that results from before and after a change can be compared.
    uses = Counter(pair.reference for pair in lit.PAIRS)
    assert all(uses[photo.stem] >= 3 for photo in lit_photos.glob("*.jpg"))
    assert {photo.name[:3] for photo in portraits.glob("*_03.jpg")} <= {pair.target for pair in lit.PAIRS}
    for pair in lit.PAIRS:
        for name in pair[:2]:
            assert lit.photo_of(name, lit_photos, portraits).is_file()


def test_the_page_of_verdicts_has_the_pairs_in_order():
    text = Path(__file__).parents[1].joinpath("docs", "portraits.md").read_text("utf-8")
    rows = re.findall(r"^\| (\d+) \| (\w+) \| (\w+) \| (yes|no)\b.* \| .+ \|$", text, re.MULTILINE)
    assert [row[:3] for row in rows] == [
        (str(number), pair.target, pair.reference) for number, pair in enumerate(lit.PAIRS, 1)
    ]
    accepted = sum(row[3] == "yes" for row in rows)
    assert f"Before: {accepted} of {len(rows)} are acceptable" in text


def test_a_sheet_of_pairs_has_results_strips_and_pages(tmp_path, monkeypatch, capsys):
    pairs = (lit.Pair("astronaut", "president", "samples"), lit.Pair("005", "i9", "not there"))
    monkeypatch.setattr(lit, "PAIRS", pairs)
    folders = ["--lit", str(tmp_path), "--portraits", str(tmp_path)]
    lit.main([*folders, "-o", str(tmp_path / "sheet")])
    written = {str(path.relative_to(tmp_path / "sheet").as_posix()) for path in tmp_path.rglob("*.png")}
    name = "01 astronautxpresident.png"
    assert written == {f"results/{name}", f"strips/{name}", "page 01.png", "overview.png"}
    result, strip, page = (
        read_image(tmp_path / "sheet" / part).pixels
        for part in (f"results/{name}", f"strips/{name}", "page 01.png")
    )
    target, reference = (read_image(sample(one)).pixels for one in ("target", "reference"))
    np.testing.assert_array_equal(result, transfer(target, reference).image)
    np.testing.assert_array_equal(strip, page)
    assert "02 005xi9: left out: " in capsys.readouterr().out


def test_some_pairs_come_without_pages(tmp_path, monkeypatch):
    monkeypatch.setattr(lit, "PAIRS", (lit.Pair("astronaut", "president", "samples"),) * 2)
    lit.main(["--lit", "nowhere", "--portraits", "nowhere", "--only", "2", "-o", str(tmp_path)])
    assert {path.name for path in tmp_path.rglob("*.png")} == {"02 astronautxpresident.png"}


@pytest.mark.parametrize("only", ["0", "41", "1,x"])
def test_pairs_that_are_not_there_are_refused(only, capsys):
    with pytest.raises(SystemExit):
        lit.main(["--lit", "nowhere", "--portraits", "nowhere", "--only", only])
    assert "--only" in capsys.readouterr().err
