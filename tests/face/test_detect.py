"""Tests of `relit.face.detect`: on a photo that scikit-image ships, and on the data beside the checkout."""

import functools
from concurrent.futures import ThreadPoolExecutor
from unittest.mock import patch

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image
from skimage import data

from relit.errors import FaceNotFoundError, ImageError, RelitError
from relit.face import face_models
from relit.face.detect import _views, detect_faces, detect_landmarks
from relit.face.face_models import Square, take_crop
from relit.face.schemes import SCHEMES
from tests.face.irises import LEFT_IRIS, RIGHT_IRIS, distance

MESH = SCHEMES["mesh478"]
RIGHT_EYE, LEFT_EYE = list(MESH.right_eye), list(MESH.left_eye)
# The astronaut's pupils and mouth corners, read off an eightfold enlargement of the photo, good to 1 px.
BY_EYE = {RIGHT_IRIS: (203.1, 100.5), LEFT_IRIS: (246.1, 102.9), 61: (202.6, 138.9), 291: (245.1, 140.5)}


@functools.cache
def astronaut():
    """(512, 512, 3) uint8, a face 110 px high with an interocular distance of 43 px."""
    photo = data.astronaut()
    photo.flags.writeable = False
    return photo


@pytest.fixture(scope="module")
def face():
    """The landmarks of the astronaut, whose places `test_finds_the_one_face` checks."""
    return detect_landmarks(astronaut())


def resized(photo, factor):
    size = (round(photo.shape[1] * factor), round(photo.shape[0] * factor))
    return np.asarray(Image.fromarray(photo).resize(size, Image.Resampling.BICUBIC))


def placed(photo, shape, x, y, colour=(128, 128, 128)):
    """Return a canvas with the photo's top left pixel at (x, y)."""
    canvas = np.full((*shape, 3), colour, np.uint8)
    canvas[y : y + photo.shape[0], x : x + photo.shape[1]] = photo
    return canvas


def test_finds_the_one_face():
    faces = detect_faces(astronaut())
    assert len(faces) == 1
    assert faces[0].scheme == "mesh478"
    assert faces[0].points.shape == (478, 3)
    assert faces[0].confidence > 0.9
    for row, place in BY_EYE.items():
        assert np.linalg.norm(faces[0].xy[row] - place) < 1.5, row


def test_depth_grows_away_from_the_camera_at_the_scale_of_x(face):
    nose, cheeks, temples = 1, [50, 280], [127, 356]
    z = face.points[:, 2]
    assert z[nose] < z[cheeks].mean() < z[temples].mean()
    # A head is about as deep, from the tip of the nose to the temples, as the pupils are apart, or twice.
    depth = (z[temples].mean() - z[nose]) / face.interocular_distance
    assert 0.7 < depth < 2.5


def test_same_input_gives_the_same_bits(face):
    assert detect_landmarks(astronaut()).points.tobytes() == face.points.tobytes()


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.float32, np.float64])
@pytest.mark.parametrize("grey", [False, True], ids=["colour", "grey"])
def test_pixel_types_agree(face, grey, dtype):
    photo = np.asarray(Image.fromarray(astronaut()).convert("L")) if grey else astronaut()
    full = np.iinfo(dtype).max if np.issubdtype(dtype, np.integer) else 1
    converted = (photo / 255 * full).round(0 if full > 1 else 9).astype(dtype)
    assert converted.max() <= full
    found = detect_landmarks(converted)
    assert distance(found, face) < 0.5
    # The same 8-bit values, however they are stored, are the same photo.
    assert found.points.tobytes() == detect_landmarks(photo).points.tobytes()


def test_leaves_the_image_alone():
    photo = astronaut().copy()
    detect_faces(photo)
    assert np.array_equal(photo, astronaut())


def test_takes_arrays_of_any_layout(face):
    turned = np.ascontiguousarray(astronaut().transpose(1, 0, 2)).transpose(1, 0, 2)
    assert not turned.flags.c_contiguous
    assert detect_landmarks(turned).points.tobytes() == face.points.tobytes()


@pytest.mark.parametrize(
    ("left", "top", "right", "bottom"),
    [(-30, -10, -92, -112), (23, 37, 53, 11), (0, 0, 300, 0), (-60, 90, 0, 0)],
)
def test_points_move_with_the_face(face, left, top, right, bottom):
    """Padded where positive, cropped where negative."""
    grown = np.pad(astronaut(), [(max(top, 0), max(bottom, 0)), (max(left, 0), max(right, 0)), (0, 0)])
    height, width = grown.shape[:2]
    shifted = grown[max(-top, 0) : height - max(-bottom, 0), max(-left, 0) : width - max(-right, 0)]
    assert distance(detect_landmarks(shifted), face.xy + np.array([left, top])) < 0.7


def test_mirrored_photo_mirrors_the_points(face):
    mirrored = detect_landmarks(astronaut()[:, ::-1])
    expected = (astronaut().shape[1] - 1, 0) + face.xy * (-1, 1)
    # The outline starts on the midline and goes once round, so that its mirror image is its reverse.
    outline = list(MESH.outline)
    assert distance(mirrored.xy[outline], expected[[outline[0], *outline[:0:-1]]]) < 1.5
    for mine, theirs in ((RIGHT_EYE, LEFT_EYE), (LEFT_EYE, RIGHT_EYE)):
        assert np.linalg.norm(mirrored.xy[mine].mean(axis=0) - expected[theirs].mean(axis=0)) < 0.7
    # The subject's right eye is on the left of any photo, mirrored or not.
    assert mirrored.xy[RIGHT_IRIS, 0] < mirrored.xy[LEFT_IRIS, 0]


@pytest.mark.parametrize("factor", [0.5, 2, 2.5])
def test_resized_photo_scales_the_points(face, factor):
    found = detect_landmarks(resized(astronaut(), factor))
    # Pixel centres are at integers, so that the photo's corner, not its first pixel, stays in place.
    assert distance(found, (face.xy + 0.5) * factor - 0.5) < 0.35 * max(factor, 1)
    assert found.interocular_distance == pytest.approx(face.interocular_distance * factor, rel=0.02)


@pytest.mark.parametrize("degrees", [20, 45, -45, 80])
def test_tilted_in_the_plane(face, degrees):
    tilted = np.asarray(Image.fromarray(astronaut()).rotate(degrees, Image.Resampling.BICUBIC))
    cos, sin = np.cos(np.deg2rad(degrees)), np.sin(np.deg2rad(degrees))
    centre = 255.5
    expected = (face.xy - centre) @ np.array([[cos, -sin], [sin, cos]]) + centre
    assert distance(detect_landmarks(tilted), expected) < 1


@pytest.mark.parametrize(("dx", "dy", "angle"), [(0, 0, 0), (4.3, -7.6, 0), (2, 5, 0.5)])
@pytest.mark.parametrize("step", [1, 3, 5])
def test_crop_samples_where_the_square_is(step, dx, dy, angle):
    """A ramp's value is its place; averages of 3 or 5 neighbours of it are whole numbers."""
    y, x = np.mgrid[:255, :255]
    ramp = Image.fromarray(np.stack([x, y, x], axis=-1).astype(np.uint8))
    square = Square(127 + dx, 127 + dy, 30 * step, angle)
    crop = 255 * take_crop(ramp, square, 30, "nearest")
    corner = np.stack(np.meshgrid(*[(np.arange(30) - 14.5) * step] * 2), axis=-1)
    cos, sin = np.cos(angle), np.sin(angle)
    places = corner @ np.array([[cos, sin], [-sin, cos]]) + (square.x, square.y)
    assert crop[..., :2] == pytest.approx(places, abs=1e-3)
    assert np.array_equal(crop[..., 2], crop[..., 0])


def test_crop_beyond_the_photo():
    white = Image.new("RGB", (20, 20), "white")
    square = Square(9.5, 9.5, 40)
    assert take_crop(white, square, 40, "nearest").min() == 1
    padded = take_crop(white, square, 40, "constant")[..., 0]
    assert padded[10:30, 10:30].min() == 1
    assert padded.sum() == 400


@pytest.mark.parametrize("quarters", [1, 2, 3])
def test_turned_crop_is_the_crop_turned(quarters):
    """On this, looking for boxes in quarter turns of one crop leans."""
    photo, square = Image.fromarray(astronaut()[:300]), Square(255.5, 149.5, 512)
    turned = take_crop(photo, square._replace(angle=quarters * np.pi / 2), 96, "constant")
    assert turned == pytest.approx(np.rot90(take_crop(photo, square, 96, "constant"), quarters), abs=1e-5)


@pytest.fixture(scope="module")
def two_photos():
    """The astronaut's head twice, at 1.5 times the size on the right."""
    head = astronaut()[:256, 100:356]
    large = resized(head, 1.5)
    pair = placed(head, (384, 640), 0, 60)
    pair[:, 256:] = large
    return pair


def test_several_faces_come_largest_first(two_photos, face):
    faces = detect_faces(two_photos)
    assert len(faces) == 2
    large, small = faces
    assert large.interocular_distance > 1.3 * small.interocular_distance
    assert distance(large, (face.xy + 0.5 - (100, 0)) * 1.5 - 0.5 + (256, 0)) < 1.2
    assert distance(small, face.xy - (100, -60)) < 0.8


def test_face_chooses_among_several(two_photos):
    assert (
        detect_landmarks(two_photos, face=1).xy[:, 0].max()
        < 256
        < detect_landmarks(two_photos).xy[:, 0].min()
    )


@pytest.mark.parametrize("number", [2, 5, -1])
def test_face_that_is_not_there(two_photos, number):
    with pytest.raises(FaceNotFoundError, match=rf"^reference: there is no face {number}; 2 found"):
        detect_landmarks(two_photos, face=number, name="reference")


@pytest.mark.parametrize(
    ("x", "y", "width", "height"), [(175, 60, 100, 125), (185, 75, 80, 95), (165, 50, 120, 140)]
)
def test_tighttake_crop(face, x, y, width, height):
    found = detect_faces(astronaut()[y : y + height, x : x + width])
    assert len(found) == 1
    assert distance(found[0], face.xy - (x, y)) < 1.5


@pytest.mark.parametrize(("x", "y"), [(40, 60), (980, 700), (1900, 1250)])
def test_tiny_face_on_a_large_canvas(face, x, y):
    """A face of 5 % of the long side."""
    canvas = placed(astronaut()[:250, 90:360], (1500, 2200), x, y)
    assert np.ptp(face.xy[:, 1]) / max(canvas.shape) < 0.055
    found = detect_faces(canvas)
    assert len(found) == 1
    assert distance(found[0], face.xy + np.array([x - 90, y])) < 1


@pytest.mark.parametrize("darken", [lambda x: x**3, lambda x: x**6, lambda x: x * 0.02])
def test_dark_photo(face, darken):
    dark = np.round(255 * darken(astronaut() / 255)).astype(np.uint8)
    found = detect_landmarks(dark)
    assert found.confidence > 0.9
    assert distance(found, face) < 1


@pytest.mark.parametrize("degrees", [100, 120, 135, 150, 180, -130, -90])
def test_photo_on_its_side_or_head(face, degrees):
    """The mesh is sure of itself on a face upside down, with points 20 px off and more."""
    turned = np.asarray(Image.fromarray(astronaut()).rotate(degrees, Image.Resampling.BICUBIC))
    cos, sin = np.cos(np.deg2rad(degrees)), np.sin(np.deg2rad(degrees))
    expected = (face.xy - 255.5) @ np.array([[cos, -sin], [sin, cos]]) + 255.5
    found = detect_faces(turned)
    assert len(found) == 1
    assert distance(found[0], expected) < 1


@functools.cache
def portrait():
    """The astronaut's face before an even backdrop."""
    y, x = np.mgrid[:512, :512]
    share = np.clip((1 - np.hypot((x - 225) / 62, (y - 110) / 85)) / 0.1, 0, 1)[..., None]
    return (share * astronaut() + (1 - share) * 180).astype(np.uint8)[:256, 97:353]


def test_one_face_alone_is_not_looked_for_in_turns():
    with patch.object(face_models, "_run", wraps=face_models._run) as run:
        assert len(detect_faces(portrait())) == 1
    # Two gammas, for boxes in two views and for the mesh, and the mesh once more.
    assert run.call_count == 7


@pytest.mark.parametrize("size", [256, 190])
@pytest.mark.parametrize("degrees", [90, 135, 180, 270])
def test_turned_face_beside_an_upright_one(degrees, size):
    photo = placed(portrait(), (384, 512), 0, 128, colour=(180, 180, 180))
    small = Image.fromarray(portrait()).resize((size, size)).rotate(degrees, fillcolor=(180, 180, 180))
    photo[:size, -size:] = np.asarray(small)
    left, right = sorted(face.xy.mean(axis=0)[0] for face in detect_faces(photo))
    assert left < 256 < right


# The first is found by the centred square alone.
@pytest.mark.parametrize(("half", "gamma"), [(30, 0.4), (33, 1), (36, 0.4), (36, 3), (40, 3), (44, 1)])
def test_crop_that_cuts_the_outline(face, half, gamma):
    """Of a face with an interocular distance of 43 px, with neither chin nor forehead nor cheeks whole."""
    x, y = np.round(face.xy[[1, 168]].mean(axis=0)).astype(int)
    crop = astronaut()[y - half : y + half, x - half : x + half]
    found = detect_faces(np.round(255 * (crop / 255) ** gamma).astype(np.uint8))
    assert len(found) == 1
    inside = np.abs(face.xy - (x, y)).max(axis=1) < half
    assert 200 < inside.sum() < 478
    assert distance(found[0].xy[inside], face.xy[inside] - (x - half, y - half)) < 2


def test_margin_gives_a_tight_crop_room(face):
    """The detector itself sees such a face only with a margin, before the centred square is tried."""
    x, y = np.round(face.xy[[1, 168]].mean(axis=0)).astype(int)
    crop = Image.fromarray(astronaut()[y - 36 : y + 36, x - 36 : x + 36])
    (square,) = next(_views(crop))
    assert np.hypot(square.x - 35.5, square.y - 35.5) < 10


@given(st.floats(-50, 500), st.floats(-50, 500), st.floats(1, 300), st.floats(-4, 4), st.integers(1, 9))
def test_scaled_square_covers_the_same_of_a_larger_photo(x, y, side, angle, factor):
    corners = np.array([[0.0, 0], [1, 0], [0.3, 0.8]])
    small = Square(x, y, side, angle)
    expected = (small.to_photo(corners) + 0.5) * factor - 0.5
    assert small.scaled(factor).to_photo(corners) == pytest.approx(expected, abs=1e-6)


def test_large_photo_is_looked_over_small_and_measured_large(face):
    """Boxes are looked for in a reduced photo, but points are as good as the photo's own pixels."""
    large = placed(resized(astronaut()[:300], 5), (2500, 3800), 700, 600)
    expected = (face.xy + 0.5) * 5 - 0.5 + (700, 600)
    assert distance(detect_landmarks(large), expected) < 0.005 * 5 * face.interocular_distance * 2


def flat(*shape):
    return np.full(shape, 128, np.uint8)


def noise(*shape):
    return np.random.default_rng(0).integers(0, 256, shape, dtype=np.uint8)


NO_FACES = {
    "coffee": data.coffee,
    "cat": data.chelsea,
    "brick": data.brick,
    "noise": lambda: noise(300, 400, 3),
    "flat": lambda: flat(300, 400),
    "8x8": lambda: flat(8, 8),
    "8x500": lambda: noise(8, 500),
    "500x8": lambda: noise(500, 8, 3),
}


@pytest.mark.parametrize("make", NO_FACES.values(), ids=NO_FACES)
def test_no_face(make):
    assert detect_faces(make()) == []


@pytest.mark.parametrize(
    ("name", "option"),
    [
        ("target", "--target-landmarks FILE"),
        ("reference", "--reference-landmarks FILE"),
        ("image", "--landmarks FILE"),
    ],
)
def test_no_face_names_the_image_and_the_way_out(name, option):
    with pytest.raises(FaceNotFoundError) as caught:
        detect_landmarks(flat(8, 200), name=name)
    assert str(caught.value).startswith(f"{name}: no face found")
    assert f"(in relit studio, or {option})" in str(caught.value)
    assert isinstance(caught.value, RelitError)


@pytest.mark.parametrize(
    "image", [np.zeros((7, 100)), np.full((20, 20), np.nan), np.zeros((20, 20, 5)), np.zeros((20, 20), int)]
)
def test_what_is_no_photo(image):
    with pytest.raises(ImageError, match=r"^reference: "):
        detect_faces(image, name="reference")


def test_threads_give_the_same_bits():
    photos = [astronaut(), astronaut()[:, ::-1], resized(astronaut(), 0.5), astronaut()[60:185, 175:275]]
    work = [photos[k % len(photos)] for k in range(8)]
    alone = [detect_landmarks(photo).points.tobytes() for photo in photos]
    with ThreadPoolExecutor(4) as pool:
        together = list(pool.map(lambda photo: detect_landmarks(photo).points.tobytes(), work))
    assert together == [alone[k % len(photos)] for k in range(8)]
