"""The mask of a face, and of its parts."""

import numpy as np
import pytest
from scipy.ndimage import binary_dilation, distance_transform_edt
from skimage.draw import polygon2mask

from relit.face.detect import detect_landmarks
from relit.face.landmarks import Landmarks
from relit.face.outline import face_outline
from relit.face.regions import FaceRegions
from relit.photo.reading import read_image
from relit.photo.samples import sample


def test_mask_is_one_in_the_face_and_zero_outside_its_outline(face_points):
    face = Landmarks(face_points * 3)
    mask = FaceRegions(face, (420, 400)).mask()
    outline = face_outline(face)
    inside = polygon2mask((420, 400), outline[:, ::-1])
    assert mask.min() == 0
    assert mask.max() == 1
    # Two rasterisers may differ by a pixel.
    assert not mask[~binary_dilation(inside, iterations=2)].any()
    depth = distance_transform_edt(inside)
    assert (mask[depth > 0.3 * face.interocular_distance + 2] > 0.99).all()
    x, y = face.xy[27:48].mean(axis=0).round().astype(int)  # between eyes and nose
    assert mask[y, x] == 1


def test_mask_falls_over_the_feather_and_is_smooth():
    square = Landmarks([[50, 50], [250, 50], [250, 250], [50, 250]])
    iod = square.interocular_distance
    mask = FaceRegions(square, (300, 300)).mask(feather=0.4)
    profile = mask[150, 45:151]
    assert (np.diff(profile) >= -1e-6).all()
    depth = np.arange(45, 151) - 50
    assert profile[depth > 0.4 * iod + 1].min() > 0.999
    assert abs(np.argmin(np.abs(profile - 0.5)) - 5 - 0.2 * iod) <= 2  # half way, to two pixels
    # No step larger than a straight ramp of a third of the feather would make.
    assert np.abs(np.diff(profile)).max() < 3 / (0.4 * iod)
    np.testing.assert_allclose(mask, mask.T, atol=1e-6)


def test_forehead_is_added_above_the_brows_of_schemes_without_one(face_points):
    face = Landmarks(face_points)
    top = face_outline(face)[:, 1].min()
    brows = face.xy[17:27, 1].min()
    assert top == pytest.approx(brows - 0.7 * face.interocular_distance)
    turned = Landmarks(face_points @ [[0, 1], [-1, 0]])  # a quarter turn; up is now to the right
    sideways = face_outline(turned)[:, 0]
    assert sideways.max() == pytest.approx(-brows + 0.7 * face.interocular_distance)


def test_the_frame_is_no_edge_of_the_face():
    face = Landmarks([[-50, -50], [150, -50], [150, 60], [-50, 60]])
    mask = FaceRegions(face, (100, 100)).mask()
    assert mask[0, 0] == mask[0, 50] == mask[10, 99] == 1
    assert mask[70].max() == 0
    larger = Landmarks([[-50, -50], [150, -50], [50, 400]])
    np.testing.assert_array_equal(FaceRegions(larger, (40, 40)).mask(), 1)


@pytest.mark.parametrize("turns", range(4))
def test_height_is_counted_from_the_chin_up_the_face(turns):
    face = detect_landmarks(read_image(sample("target")).pixels)
    straight, points = FaceRegions(face, (512, 512)), face.xy
    up = straight.up
    assert up[1] < -0.9
    y, x = np.indices((512, 512))
    heights = x * up[0] + y * up[1]
    expected = heights - (straight.outline @ up).min()
    np.testing.assert_allclose(straight.height, expected, atol=1e-3)
    for _ in range(turns):
        points = np.column_stack([points[:, 1], 511 - points[:, 0]])
    turned = FaceRegions(Landmarks(points, face.scheme), (512, 512))
    np.testing.assert_allclose(np.rot90(turned.height, -turns), expected, atol=1e-3)
