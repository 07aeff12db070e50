"""Where a change of light is known, and where it goes."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.ndimage import gaussian_filter, gaussian_gradient_magnitude
from scipy.sparse import coo_array
from scipy.sparse.csgraph import dijkstra

from relit.compose.matte import REACH, eyes_and_teeth, matte, shortest_ways
from relit.errors import LandmarkError
from relit.face.detect import detect_landmarks
from relit.face.landmark_files import read_landmarks
from relit.face.landmarks import Landmarks
from relit.face.outline import face_outline
from relit.face.regions import FaceRegions
from relit.face.trust import known
from relit.face.views import whole
from relit.photo.color import luma
from relit.photo.pixels import to_unit
from relit.photo.reading import read_image
from relit.photo.resampling import reduced
from relit.photo.samples import sample
from relit.relighting import transfer
from relit.solver.neighborhoods import paired
from tests.faces import off_the_face


@pytest.fixture(scope="module")
def astronaut():
    photo = read_image(sample("target")).pixels
    return photo, detect_landmarks(photo)


@pytest.fixture
def drawn(face_points):
    """A flat face with skin beyond its outline, a dark fringe, and a wall to the right."""
    face = Landmarks(face_points * 2)
    y, x = np.mgrid[:300, :260]
    image = np.full((300, 260, 3), (205, 150, 125), np.uint8)
    image[y < face.xy[:, 1].min() - 10] = (30, 22, 18)
    image[x > face.xy[:, 0].max() + 4] = (170, 180, 190)
    return image, face


def test_skin_round_the_face_is_relit_hair_and_wall_are_not(drawn):
    image, face = drawn
    mask = matte(whole(image, face))
    left, right = face.xy[:, 0].min(), face.xy[:, 0].max()
    middle = int(face.xy[8, 1]) - 40
    assert mask[middle, int(left) + 20 : int(right) - 20].min() > 0.95
    assert mask[middle, int(left) - 8] > 0.3  # skin
    assert mask[middle, int(right) + 14 :].max() < 0.05  # wall
    assert mask[: int(face.xy[:, 1].min()) - 22].max() < 0.05  # hair


def test_nothing_is_relit_out_of_reach(drawn):
    image, face = drawn
    mask = matte(whole(np.full_like(image, 128), face))
    assert not mask[off_the_face(face, mask.shape, face_outline(face))].any()
    assert REACH == 0.9
    assert ((mask > 0.1) & (mask < 0.9)).any()


@given(st.integers(1, 30), st.integers(1, 30), st.integers(0, 2**32 - 1))
def test_shortest_ways_are_those_of_dijkstra(height, width, seed):
    random = np.random.default_rng(seed)
    start = random.random((height, width)) < 0.02
    start[random.integers(height), random.integers(width)] = True
    number = np.arange(start.size, dtype=np.int32).reshape(start.shape)
    ways, edges = [], []
    for step in ((0, 1), (1, 0), (1, 1), (1, -1)):
        here, there = paired(start.shape, step)
        ways.append((here, there, random.uniform(0.02, 0.4, number[here].shape)))
        edges.append([each.ravel() for each in (ways[-1][2], number[here], number[there])])
    lengths, *ends = (np.concatenate(part) for part in zip(*edges, strict=True))
    graph = coo_array((lengths, ends), shape=(start.size,) * 2).tocsr()
    truth = dijkstra(graph, directed=False, indices=number[start], min_only=True)
    np.testing.assert_array_equal(shortest_ways(start, ways).ravel(), np.minimum(truth, 1))


def test_a_face_that_fills_the_frame_is_relit_whole():
    face = Landmarks([[-50, -50], [150, -50], [50, 400]])
    np.testing.assert_array_equal(matte(whole(np.zeros((40, 40, 3), np.uint8), face)), 1)


def test_the_references_fringe_and_its_spectacles_are_not_known(drawn):
    image, face = drawn
    reference = np.full_like(image, (150, 105, 90))
    fringe = np.s_[: int(face.xy[17:27, 1].min()) - 12]
    reference[fringe] = (25, 20, 18)
    bridge = face.xy[30].round().astype(int)  # a blue bridge of spectacles across the nose
    reference[bridge[1] - 6 : bridge[1] + 6, bridge[0] - 14 : bridge[0] + 14] = (40, 60, 160)
    seen = np.ones(image.shape[:2], bool)
    trust = known(whole(image, face), reference, seen)
    assert trust[fringe].max() < 0.1
    assert trust[bridge[1], bridge[0]] < 0.1
    cheek = (face.xy[2] * 0.45 + face.xy[31] * 0.55).round().astype(int)
    assert trust[cheek[1], cheek[0]] > 0.9
    # Where the reference ends, nothing is known; of what was rendered, features are.
    seen[cheek[1] - 5 :] = False
    assert known(whole(image, face), reference, seen)[cheek[1] + 5 :].max() < 0.1
    eye = face.xy[36:42].mean(axis=0).round().astype(int)
    assert trust[eye[1], eye[0]] < 0.1
    assert known(whole(image, face), reference, seen, rendered=True)[eye[1], eye[0]] > 0.9


def test_the_half_of_a_face_in_another_light_is_known_and_hair_over_it_is_not(drawn):
    image, face = drawn
    reference = np.full_like(image, (150, 30, 70))
    middle = int(face.xy[30, 0])
    reference[:, middle:] = (5, 70, 80)
    cheek = (0.45 * face.xy[2] + 0.55 * face.xy[31]).round().astype(int)
    reference[:, cheek[0] - 4 : cheek[0] + 5] = (25, 20, 18)
    trust = known(whole(image, face), reference, np.ones(image.shape[:2], bool), narrow=True)
    beside = (face.xy[14] * 0.6 + face.xy[35] * 0.4).round().astype(int)
    assert trust[beside[1], beside[0]] > 0.9
    assert trust[cheek[1], cheek[0]] < 0.1


def test_eyes_and_catchlights_are_found(astronaut):
    photo, face = astronaut
    white, share = eyes_and_teeth(whole(photo, face))
    for eye in face.eyes[:, :2].round().astype(int):
        assert white[eye[1], eye[0]] > 0.9
        assert share[eye[1], eye[0]] < 0.95
    nose = face.xy[1].round().astype(int)
    assert white[nose[1], nose[0]] == 0
    assert share[nose[1], nose[0]] == 1
    lit = photo.copy()
    x, y = face.eyes[0, :2].round().astype(int)
    lit[y - 1 : y + 1, x - 1 : x + 1] = 255
    assert eyes_and_teeth(whole(lit, face))[1][y - 1 : y + 1, x - 1 : x + 1].max() < 0.2


@pytest.mark.parametrize("scheme", ["mesh478", "points"])
def test_halves_meet_in_the_middle(scheme, astronaut):
    photo, face = astronaut
    face = face if scheme == "mesh478" else Landmarks(face.xy[::10], "points")
    left, right = (FaceRegions(face, photo.shape[:2]).parts(side) for side in ("left", "right"))
    np.testing.assert_allclose(left + right, 1, atol=1e-6)
    outline = face_outline(face)
    assert left[int(outline[:, 1].mean()), int(outline[:, 0].min())] > 0.99
    assert right[int(outline[:, 1].mean()), int(outline[:, 0].max())] > 0.99


def test_parts_lie_on_their_landmarks_and_add_up(astronaut):
    photo, face = astronaut
    for name in ("forehead", "cheeks", "nose", "mouth", "eyes", "chin"):
        mask = FaceRegions(face, photo.shape[:2]).parts(name)
        inside = face.xy[list(face.groups[name])]
        x, y = inside.mean(axis=0).round().astype(int)
        assert 0.02 < (mask > 0.5).sum() / face.interocular_distance**2 < 2
        if name not in ("eyes", "cheeks"):  # whose middle is the nose
            assert mask[y, x] > 0.9
    both = FaceRegions(face, photo.shape[:2]).parts("nose+mouth")
    parts = [FaceRegions(face, photo.shape[:2]).parts(name) for name in ("nose", "mouth")]
    np.testing.assert_array_equal(both, np.maximum(*parts))
    with pytest.raises(LandmarkError, match=r"^region: these landmarks \(points\) do not say where the nose"):
        FaceRegions(Landmarks(face.xy[::10], "points"), photo.shape[:2]).parts("nose")


def test_a_part_whose_points_lie_on_one_line_is_drawn(astronaut):
    photo, face = astronaut
    points = face.points.copy()
    rows = list(face.groups["chin"])
    points[rows, 0] = 200
    mask = FaceRegions(Landmarks(points), photo.shape[:2]).parts("chin")
    x, y = points[rows, :2].mean(axis=0).astype(int)
    assert mask[y, x] > 0.8


PAIRS = [
    ("005", "096"),
    ("096", "005"),
    ("142", "i9"),
    ("030", "split"),
    ("064", "rim"),
    ("099", "rembrandt"),
]


@pytest.mark.slow
@pytest.mark.parametrize(("target", "light"), PAIRS)
def test_no_seam(target, light, portraits, lit_photos):
    """Along the mask's edge a relit photo is no steeper than 1.2 times the target."""
    photo = read_image(portraits / f"{target}_03.jpg").pixels
    other = lit_photos / f"{light}.jpg" if light.startswith("i") else portraits / f"{light}_03.jpg"
    if other.is_file():
        other = read_image(other).pixels
        result = transfer(photo, other)
    else:
        result = transfer(photo, light=light)
    edge = (result.mask > 0.02) & (result.mask < 0.98)
    before, after = (
        luma(to_unit(reduced(image[result.window], result.view.factor))) for image in (photo, result.image)
    )
    assert np.abs(before - after)[result.mask > 0.9].mean() > 0.01
    for sigma in (1, 3):
        steep = [gaussian_gradient_magnitude(image, sigma)[edge] for image in (before, after)]
        assert steep[1].mean() < 1.2 * steep[0].mean()
        assert np.percentile(steep[1], 95) < 1.25 * np.percentile(steep[0], 95)


@pytest.mark.slow
@pytest.mark.parametrize("target", ["005", "142", "114"])
def test_a_plain_background_has_no_halo(target, portraits):
    """Beside the silhouette, where no skin is, the wall stays as it was."""
    photo = read_image(portraits / f"{target}_03.jpg").pixels
    face = read_landmarks(portraits / f"{target}_03.tem")
    result = transfer(photo, light="split")
    smooth = gaussian_filter(to_unit(photo), (2, 2, 0))
    wall = np.median(smooth[:60].reshape(-1, 3), axis=0)
    background = (np.abs(smooth - wall).max(axis=2) < 0.04) & (np.arange(1350)[:, None] < face.xy[:, 1].max())
    assert background.mean() > 0.1
    assert np.abs(result.image.astype(int) - photo)[background].mean() < 0.35
    assert np.percentile(np.abs(result.image.astype(int) - photo)[background], 99.5) < 8
