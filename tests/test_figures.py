"""The pictures show what they say."""

import numpy as np
import pytest
from skimage import data

from relit.face.landmarks import Landmarks
from relit.figures import STAGES, contact_sheet, landmark_overlay, split_pictures, stage_pictures
from relit.ltv.decomposition import decompose
from relit.relighting import transfer


@pytest.fixture
def result(face_points):
    target = data.astronaut()[20:180, 140:300]
    face = face_points * 0.9 + [26, 40]
    return transfer(target, target[:, ::-1].copy(), target_landmarks=face, reference_landmarks=face)


def again(result, **changes):
    return transfer(
        result.target,
        result.reference,
        target_landmarks=result.target_landmarks,
        reference_landmarks=result.reference_landmarks,
        **changes,
    )


def test_every_stage_has_its_picture(result):
    pictures = stage_pictures(result)
    split = {f"{role}_{part}" for role in ("target", "reference") for part in "uv"}
    assert tuple(pictures) == tuple(
        name for name in STAGES if name not in {"warped_second_reference", *split}
    )
    by_ltv = stage_pictures(again(result, method="ltv"))
    assert set(pictures) - set(by_ltv) == {*result.first.layers, "light"}
    assert set(by_ltv) - set(pictures) == split
    np.testing.assert_array_equal(pictures["result"], result.image)
    np.testing.assert_array_equal(pictures["warped_reference"], result.first.alignment.warped)
    np.testing.assert_array_equal(pictures["mask"], np.rint(result.mask * 255))


def test_u_shows_as_it_is_and_v_with_one_at_mid_grey():
    image = data.astronaut()[60:100, 200:240]
    split = decompose(image, 0.4)
    u, v = split_pictures(split)
    np.testing.assert_array_equal(u, np.rint(split.u * 255))
    assert set(np.unique(v[split.v == 1])) <= {127, 128}
    assert (v[split.v >= 2] == 255).all()


def test_without_a_mask_there_is_no_picture_of_it(result):
    whole = again(result, mask=False)
    assert set(stage_pictures(result)) - set(stage_pictures(whole)) == {"mask"}
    assert contact_sheet(whole, height=80).ndim == 3


def test_overlay_marks_the_points_and_nothing_else():
    face = Landmarks([[20, 20], [70, 25], [45, 70]])
    image = np.full((100, 120, 3), 9, np.uint8)
    picture = landmark_overlay(image, face)
    changed = (picture != image).any(axis=-1)
    y, x = np.nonzero(changed)
    distance = np.hypot(x[:, None] - face.xy[:, 0], y[:, None] - face.xy[:, 1])
    assert distance.min(axis=1).max() <= 3
    assert (distance.min(axis=0) <= 0.5).all()
    np.testing.assert_array_equal(image, 9)


def test_sheet_holds_all_pictures(result):
    sheet = contact_sheet(result, height=100)
    assert sheet.dtype == np.uint8
    height, width = sheet.shape[:2]
    assert height > 3 * 100
    assert width > 3 * 80
    # Paper between the pictures, and pictures on it.
    assert (sheet[0] == 255).all()
    assert (sheet != 255).any(axis=-1).mean() > 0.3
