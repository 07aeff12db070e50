"""What results say of themselves."""

import re

import numpy as np
import pytest

import relit
from relit.solver.isotropic import tv_l1_isotropic

POINTS = [[16, 20], [48, 20], [32, 36], [22, 50], [42, 50]]


@pytest.fixture(scope="module")
def result():
    ramp = np.tile(np.linspace(40, 200, 64), (64, 1)).astype(np.uint8)
    faces = {"target_landmarks": POINTS, "reference_landmarks": POINTS}
    return relit.transfer(np.dstack([ramp] * 3)[:60], ramp, **faces, method="ltv")


def test_a_result_is_told_in_one_line(result):
    assert re.fullmatch(r"TransferResult\(64x60 uint8, 1 reference, method='ltv', \d+\.\d s\)", repr(result))
    two = relit.transfer(
        result.target,
        [result.target] * 2,
        target_landmarks=POINTS,
        reference_landmarks=[POINTS] * 2,
        method="moments",
    )
    assert re.fullmatch(r"TransferResult\(64x60 uint8, 2 references, method='moments', .*", repr(two))
    lit = relit.transfer(result.target, target_landmarks=POINTS, light=(-30, 20))
    assert re.fullmatch(
        r"TransferResult\(64x60 uint8, light='-30,20', method='shading', \d+\.\d s\)", repr(lit)
    )


def test_every_step_is_told_in_one_line(result):
    expected = {
        "first": r"Lighting\(59x53 grey uint8, known=\d+%\)",
        "first.alignment": r"Alignment\(59x53 grey uint8, folded=0, smoothing=0\.001, scale=1\)",
        "first.target_split": r"Decomposition\(59x53 (grey )?float32, lam=\d\.\d+, neighborhood=4\)",
        "view": r"View\(59x53 uint8, factor=1\)",
        "target_landmarks": r"Landmarks\(5 points, interocular distance \d+\.\d px\)",
    }
    for path, pattern in expected.items():
        part = result
        for name in path.split("."):
            part = getattr(part, name)
        assert re.fullmatch(pattern, repr(part)), repr(part)
    solution = tv_l1_isotropic(np.eye(9), 0.5)
    assert re.fullmatch(
        r"IsotropicSolution\(9x9 grey float64, gap=[\d.e-]+, iterations=\d+\)", repr(solution)
    )


def test_photos_and_detected_faces_are_told_in_one_line():
    photo = relit.read_image(relit.sample("reference"))
    height, width = photo.pixels.shape[:2]
    assert repr(photo).startswith(f"Photo({width}x{height} uint8, JPEG, profile")
    assert len(repr(photo)) < 80
    assert repr(relit.Photo(photo.pixels[..., 0], alpha=photo.pixels[..., 0])) == (
        f"Photo({width}x{height} grey uint8, alpha)"
    )
    face = relit.detect_landmarks(photo.pixels)
    assert re.fullmatch(
        r"Landmarks\(mesh478, interocular distance \d+\.\d px, confidence [01]\.\d\d\)", repr(face)
    )
