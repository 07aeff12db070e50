"""Where a change of the light on a head goes."""

import numpy as np
import pytest
from scipy.ndimage import distance_transform_edt, gaussian_filter

from relit.compose.hair import hair, sparing_hair
from relit.compose.person_matte import corners_round, person_matte
from relit.evaluate.color_difference import ciede2000
from relit.evaluate.heads import Heads
from relit.face.detect import detect_faces, detect_landmarks
from relit.face.landmarks import Landmarks
from relit.face.views import view_of, whole, window_round
from relit.photo.reading import read_image
from relit.photo.samples import sample
from relit.relighting import transfer


@pytest.fixture(scope="module")
def astronaut():
    photo = read_image(sample("target")).pixels
    return photo, detect_landmarks(photo)


def seen(photo, face, factor=1):
    return view_of(photo, face, window_round(corners_round(face), 0, photo.shape, factor), factor)


def people_of(heads):
    return sorted(path.name for path in heads.iterdir() if path.is_dir())


def test_the_matte_is_the_silhouette_of_rendered_heads(heads, part_of):
    corpus = Heads(heads)
    for name in part_of(people_of(heads), 4):
        face = corpus.landmarks(name, "front")
        view = seen(corpus.photo(name, "front"), face)
        mask, wall = person_matte(view), corpus.mask(name, "background")[view.window]
        away = distance_transform_edt(wall)
        assert mask[(away > 0) & (away <= 20)].mean() < 0.005
        assert mask[away > 20].max(initial=0) < 0.01
        head = ~wall & (np.indices(wall.shape)[0] < view.landmarks.xy[:, 1].max())
        assert (mask[head] > 0.5).mean() > 0.97
        assert mask[view.regions.skin_area].mean() > 0.99
        assert (mask[view.regions.distance > 0.25 * face.interocular_distance] == 1).all()


def test_a_wall_is_not_relit(heads, part_of):
    corpus = Heads(heads)
    for name in part_of(people_of(heads), 4):
        photo, face = corpus.photo(name, "front"), corpus.landmarks(name, "front")
        result = transfer(photo, light="split", target_landmarks=face)
        wall = corpus.mask(name, "background")
        away = distance_transform_edt(wall)
        off = ciede2000(photo, result.image)
        assert off[(away > 0) & (away <= 20)].mean() < 0.12
        assert off[away > 20].mean() < 0.01
        assert off[corpus.mask(name, "face")].mean() > 1


def test_nothing_changes_at_the_ends_of_the_view(astronaut):
    photo, face = astronaut
    large = np.pad(photo, ((300, 300), (300, 300), (0, 0)), mode="reflect")
    there = Landmarks(face.xy + 300)
    for turn in (there, Landmarks((there.xy - 556) @ [[0.8, 0.6], [-0.6, 0.8]] + 556)):
        view = seen(large, turn, 2)
        mask = person_matte(view)
        assert min(view.window[0].start, view.window[1].start) > 0
        for edge in (mask[0], mask[-1], mask[:, 0], mask[:, -1]):
            assert not edge.any()


def test_the_change_fades_down_the_shoulders_without_a_step(astronaut):
    photo, face = astronaut
    mask = person_matte(seen(photo, face))
    view = seen(photo, face)
    x, chin = view.landmarks.xy[152].round().astype(int)
    below = mask[chin:, x]
    assert below[0] == 1
    assert np.diff(gaussian_filter(below, 2)).max() < 0.02
    assert np.abs(np.diff(below)).max() < 0.1


def test_a_tight_crop_is_relit_up_to_its_frame(yaleb, yale_landmarks, part_of):
    for person, points in part_of(yale_landmarks.items(), 3, key=lambda item: item[0]):
        for light in ("P00A+000E+00", "P00A+035E-20", "P00A-070E-35"):
            photo = read_image(yaleb / person / f"{person}_{light}.pgm").pixels
            view = whole(photo, Landmarks(points))
            mask = person_matte(view)
            assert (mask > 0.99)[view.regions.inside].mean() > 0.97
            assert (mask[:, [0, -1]] > 0.9).mean() > 0.5


def test_hands_and_spectacles_before_a_face_are_relit_with_it(astronaut):
    photo, face = astronaut
    view = seen(photo, face)
    covered = photo.copy()
    x, y = face.xy[1].round().astype(int)
    covered[y - 10 : y + 10, x - 15 : x + 15] = (20, 90, 160)
    assert person_matte(seen(covered, face))[view.regions.skin_area].min() > 0.9


def test_who_stands_beside_is_left_alone(portraits):
    """Two portraits side by side: nothing of the other's head is relit."""
    one, other = (read_image(portraits / f"{name}_03.jpg").pixels for name in ("069", "136"))
    photo = np.hstack([one[:, 250:1000], other[:, 330:1100]])
    faces = sorted(detect_faces(photo), key=lambda face: face.xy[:, 0].mean())
    assert len(faces) == 2
    for face, others in zip(faces, (np.s_[:, 760:], np.s_[:, :740]), strict=True):
        view = seen(photo, face, 2)
        mask = np.zeros(photo.shape[:2], np.float32)
        mine = person_matte(view).repeat(2, 0).repeat(2, 1)
        part = mask[view.window]
        part[:] = mine[: part.shape[0], : part.shape[1]]
        head = np.indices(mask.shape)[0] < face.xy[:, 1].max() - 20
        assert mask[others][head[others]].mean() < 0.02


@pytest.mark.parametrize("name", ["005", "017", "064", "142"])
def test_dark_hair_is_no_skin(name, portraits):
    photo = read_image(portraits / f"{name}_03.jpg").pixels
    view = seen(photo, detect_landmarks(photo), 2)
    share, dark = hair(view), view.brightness < 0.2
    face, rows = view.regions, np.indices(view.brightness.shape)[0]
    above = (rows < face.outline[:, 1].min()) & (person_matte(view) > 0.99)
    assert share[above & dark].mean() > 0.8
    assert share[face.skin_area & (face.below_brows > 0.99)].max() < 0.05
    wall = (rows < face.outline[:, 1].min()) & (view.brightness > 0.7)
    assert share[wall].mean() < 0.02


def test_a_painted_plane_falls_back_to_skin(face_points):
    """Where no person is seen, the face is relit for all that, and a wall far from it is not."""
    face = Landmarks(face_points * 2 + 100)
    mask = person_matte(whole(np.full((460, 460, 3), (205, 150, 125), np.uint8), face))
    assert mask[whole(np.zeros((460, 460), np.uint8), face).regions.skin_area].min() > 0.99
    assert not mask[:20].any()


def test_hair_and_cloth_take_less_of_brightness_than_of_hue(portraits):
    photo = read_image(portraits / "030_03.jpg").pixels
    view, base = seen(photo, detect_landmarks(photo)), photo.astype(np.float32) / 255 + 1e-3
    change = np.broadcast_to(np.float32([-0.4, -0.9, -1.3]), photo.shape).copy()
    made, cloth, skin = sparing_hair(change, base, view), hair(view) > 0.99, hair(view) < 0.001
    assert min(cloth.mean(), skin.mean()) > 0.02
    np.testing.assert_allclose(made[skin], change[skin], atol=2e-3)
    share = made[cloth] / change[cloth]
    assert np.all((share[:, 0] > 0) & (share[:, 0] < 0.5))
    hue, whole_hue = (one[cloth][:, 1:] - one[cloth][:, :1] for one in (made, change))
    assert np.all((hue / whole_hue > share[:, :1]) & (hue / whole_hue < 1))


def test_white_cloth_does_not_burn_out_but_is_coloured(portraits):
    photo = read_image(portraits / "030_03.jpg").pixels
    view, base = seen(photo, detect_landmarks(photo)), np.minimum(photo.astype(np.float32) / 255 + 1e-3, 1)
    change = np.broadcast_to(np.float32([0.3, 0.6, 0.1]), photo.shape).copy()
    cloth = (hair(view) > 0.999) & (photo.min(axis=2) > 240)
    assert cloth.mean() > 0.02
    made = (base * np.exp(sparing_hair(change, base, view)))[cloth]
    np.testing.assert_allclose(made[:, 1], 1, atol=2e-3)
    assert np.all(made[:, 0] < 0.97)
    assert np.all(made[:, 2] < made[:, 0])


def test_a_coloured_spot_beside_a_neck_is_spread_over_the_shirt(portraits):
    photo = read_image(portraits / "030_03.jpg").pixels
    view, base = seen(photo, detect_landmarks(photo)), photo.astype(np.float32) / 255 + 1e-3
    rows, columns = np.indices(photo.shape[:2])
    cloth = (hair(view) > 0.999) & (view.regions.height < -0.4 * view.regions.interocular_distance)
    middle = np.argwhere(cloth)[len(np.argwhere(cloth)) // 2]
    spot = np.exp(-((rows - middle[0]) ** 2 + (columns - middle[1]) ** 2) / 2 / 15**2)
    change = np.asarray(-0.3 - spot[..., None] * [0.0, 0.4, 0.8], np.float32)
    made = sparing_hair(change, base, view)[cloth]
    assert np.ptp(made[:, 2]) < 0.1 * np.ptp(change[cloth][:, 2])
    level = np.full_like(change, -0.3)
    np.testing.assert_allclose(sparing_hair(level, base, view)[cloth], 0.4 * -0.3, atol=2e-3)


def test_beside_another_a_change_ends_before_the_other(portraits):
    photo = read_image(portraits / "030_03.jpg").pixels[::2, ::2]
    two = np.hstack([photo, photo[:, ::-1]])
    face = detect_landmarks(photo)
    alone, beside = person_matte(seen(photo, face)), person_matte(seen(two, face))
    assert alone[-1, : photo.shape[1] // 8].max() > 0.2
    assert beside[:, photo.shape[1] + 5 :].max() < 0.1
