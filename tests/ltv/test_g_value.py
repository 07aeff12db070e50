"""G-values against closed forms, brute force, and what the solver itself keeps and drops."""

import itertools

import numpy as np
import pytest
from scipy.optimize import minimize_scalar

from relit.errors import ImageError, LandmarkError, OptionError
from relit.face.landmarks import Landmarks
from relit.ltv.g_value import automatic_lam, feature_mask, lam_for, scale_of
from relit.settings.options import TransferOptions
from relit.solver.exact import tv_l1
from relit.solver.neighborhoods import UNIT, Grid, paired


def in_room(shape, room=6):
    return np.pad(np.ones(shape, bool), room)


@pytest.mark.parametrize(("height", "width"), [(1, 1), (4, 4), (9, 9), (3, 11), (1, 20)])
def test_rectangles_of_four_neighbours_have_their_perimeter_over_their_area(height, width):
    scale = scale_of(in_room((height, width)))
    assert scale.critical_lam == pytest.approx(2 * (height + width) / (height * width), abs=2 / UNIT)
    np.testing.assert_array_equal(scale.core, in_room((height, width)))


def disc(radius):
    y, x = np.mgrid[-radius - 8 : radius + 9, -radius - 8 : radius + 9]
    return x**2 + y**2 <= radius**2


@pytest.mark.parametrize("radius", [12, 25, 40])
def test_discs_have_two_over_their_radius_where_length_is_round(radius):
    assert scale_of(disc(radius), 16).critical_lam * radius == pytest.approx(2, rel=0.02)


def test_the_frame_of_the_mask_is_no_boundary():
    square = np.ones((6, 6), bool)
    assert (
        scale_of(square).critical_lam
        == scale_of(np.pad(square, 30)).critical_lam
        == pytest.approx(4 / 6, abs=1e-5)
    )


@pytest.mark.parametrize("radius", [25, 60])
def test_discs_under_four_neighbours_lose_and_gain_corners(radius):
    """The best set is a square with round corners: four sides cut the disc, all at the distance a r."""

    def ratio(a):
        inside = np.pi - 4 * (np.arccos(a) - a * np.sqrt(1 - a * a)) if a < 1 else np.pi
        return 8 * a / inside

    best = minimize_scalar(ratio, bounds=(0.5, 1), method="bounded").fun
    assert scale_of(disc(radius)).critical_lam * radius == pytest.approx(best, rel=0.03)


@pytest.mark.parametrize("neighborhood", [4, 8, 16])
@pytest.mark.parametrize("seed", range(4))
def test_no_set_has_a_smaller_ratio(neighborhood, seed):
    mask = np.random.default_rng(seed).random((3, 4)) < 0.6
    grid = Grid.of(neighborhood)
    best = np.inf
    for bits in itertools.product([False, True], repeat=mask.size):
        candidate = np.array(bits).reshape(mask.shape)
        inside = (candidate & mask).sum() - (candidate & ~mask).sum()
        if inside > 0:
            plane = np.pad(candidate, 2)
            perimeter = sum(
                weight * np.count_nonzero(plane[here] != plane[there])
                for step, weight in zip(grid.steps, grid.weights, strict=True)
                for here, there in [paired(plane.shape, step)]
            )
            best = min(best, perimeter / inside / UNIT)
    assert scale_of(mask, neighborhood).critical_lam == pytest.approx(best, abs=2 / UNIT)


def test_shapes_leave_u_just_below_and_stay_just_above():
    mask = disc(15)
    mask[20:32, 26:38] = True
    scale = scale_of(mask)
    image = mask.astype(np.uint8)
    assert not tv_l1(image, scale.critical_lam * 0.999).any()
    assert tv_l1(image, scale.critical_lam * 1.001)[scale.core].all()


def test_masks_that_are_none_are_refused():
    for mask in (np.ones((3, 3)), np.ones((2, 2, 2), bool), [[True]]):
        with pytest.raises(ImageError, match="booleans"):
            scale_of(mask)
    with pytest.raises(ImageError, match="no pixel set"):
        scale_of(np.zeros((4, 4), bool))


def test_features_are_on_a_face_of_one_size_wherever_it_was(face_points):
    face = Landmarks(face_points)
    mask = feature_mask(face)
    large = feature_mask(Landmarks(3 * face_points + 50))
    assert mask.shape == large.shape
    assert (mask != large).mean() < 0.01
    assert automatic_lam(face) == pytest.approx(automatic_lam(Landmarks(3 * face_points + 50)), rel=0.02)


def test_automatic_lambda_takes_no_feature_out_of_the_person(face_points):
    face = Landmarks(face_points)
    mask = feature_mask(face).astype(np.uint8)
    assert not tv_l1(mask, automatic_lam(face)).any()
    assert tv_l1(mask, 1.1 * automatic_lam(face)).any()


def test_a_number_stays_and_other_words_are_refused(face_points):
    assert lam_for(Landmarks(face_points), TransferOptions(lam=0.3)) == 0.3
    face = Landmarks(face_points)
    assert lam_for(face, TransferOptions(lam="auto")) == automatic_lam(face)
    with pytest.raises(OptionError, match="or 'auto', got 'automatic'"):
        TransferOptions(lam="automatic")


def test_points_without_names_have_no_features():
    with pytest.raises(LandmarkError, match="give λ as a number"):
        automatic_lam(Landmarks(np.random.default_rng(0).random((9, 2)) * 100))
