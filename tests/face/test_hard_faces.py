"""Faces as they come: small, tilted, cut, covered, in shadow, several, or none."""

import io

import numpy as np
import pytest
from PIL import Image, ImageDraw

from relit.errors import FaceNotFoundError
from relit.face.detect import detect_faces, detect_landmarks
from relit.face.landmarks import Landmarks
from relit.photo.reading import read_image
from relit.photo.samples import sample
from relit.relighting import transfer


@pytest.fixture(scope="module")
def sitter():
    """A photo of a face 300 px wide, and its landmarks."""
    with Image.open(sample("target")) as opened:
        photo = opened.convert("RGB").crop((125, 0, 325, 230)).resize((600, 690), Image.Resampling.BICUBIC)
    return photo, detect_landmarks(np.asarray(photo))


@pytest.fixture(scope="module")
def light():
    photo = read_image(sample("reference")).pixels
    return {"reference": photo, "reference_landmarks": detect_landmarks(photo)}


def shadowed(photo):
    fall = np.clip((0.5 - np.linspace(0, 1, photo.width)) / 0.06, 0.08, 1)[None, :, None]
    return Image.fromarray((np.asarray(photo) * fall).astype(np.uint8))


def with_sunglasses(photo, face):
    dark, draw = (12, 12, 15), ImageDraw.Draw(worn := photo.copy())
    unit, eyes = face.interocular_distance, face.eyes[:, :2]
    for x, y in eyes:
        draw.ellipse((x - 0.38 * unit, y - 0.22 * unit, x + 0.38 * unit, y + 0.3 * unit), fill=dark)
    draw.line([tuple(eye) for eye in eyes], fill=dark, width=int(0.08 * unit))
    return worn


def as_met(name, photo, face):
    left, top = face.xy.min(axis=0)
    right, bottom = face.xy.max(axis=0)
    match name:
        case "small":
            room = Image.new("RGB", (1400, 1000), (110, 125, 120))
            room.paste(photo.resize((150, 172)), (800, 500))
            return room
        case "tilted":
            return photo.rotate(35, fillcolor=(120, 120, 120))
        case "lying":
            return photo.rotate(90, expand=True)
        case "upside down":
            return photo.rotate(180)
        case "cut at the side":
            return photo.crop((0, 0, int(face.xy[:, 0].mean() + 0.2 * (right - left)), photo.height))
        case "cut above":
            return photo.crop((0, int(face.eyes[0, 1] - 0.2 * (bottom - top)), photo.width, photo.height))
        case "cut below":
            return photo.crop((0, 0, photo.width, int(bottom - 0.15 * (bottom - top))))
        case "filling the frame":
            return photo.crop((int(left), int(top), int(right), int(bottom)))
        case "in shadow":
            return shadowed(photo)
        case "in sunglasses":
            return with_sunglasses(photo, face)
        case "grey":
            return photo.convert("L")
    raise AssertionError(name)


CASES = [
    *("small", "tilted", "lying", "upside down", "cut at the side", "cut above", "cut below"),
    *("filling the frame", "in shadow", "in sunglasses", "grey"),
]


@pytest.mark.slow
@pytest.mark.parametrize("name", CASES)
@pytest.mark.rotating
def test_it_is_found_and_relit(name, sitter, light):
    photo = np.asarray(as_met(name, *sitter))
    (found,) = detect_faces(photo)
    assert found.confidence > 0.5
    for options in (light, {"light": "rembrandt"}):
        result = transfer(photo, target_landmarks=found, **options)
        before = photo if photo.ndim == result.image.ndim else np.repeat(photo[..., None], 3, axis=2)
        changed = np.abs(result.image.astype(int) - before)
        assert changed.max() > 15
        inside = np.zeros(photo.shape[:2], bool)
        inside[result.window] = True
        assert not changed[~inside].any()


Turn = Image.Transpose
UNDONE = {
    2: Turn.FLIP_LEFT_RIGHT,
    3: Turn.ROTATE_180,
    4: Turn.FLIP_TOP_BOTTOM,
    5: Turn.TRANSPOSE,
    6: Turn.ROTATE_90,
    7: Turn.TRANSVERSE,
    8: Turn.ROTATE_270,
}


@pytest.mark.parametrize("orientation", range(1, 9))
def test_a_turned_camera_makes_no_difference(orientation, sitter):
    """The pixels lie as EXIF says; upright they are the same."""
    photo, _face = sitter
    stored = photo if orientation == 1 else photo.transpose(UNDONE[orientation])
    tags = Image.Exif()
    tags[0x0112] = orientation
    file = io.BytesIO()
    stored.save(file, "PNG", exif=tags)
    read = read_image(io.BytesIO(file.getvalue())).pixels
    np.testing.assert_array_equal(read, np.asarray(photo))


@pytest.mark.parametrize("name", ["nothing", "too small"])
def test_where_none_is_found_the_message_says_what_helps(name, sitter):
    wall = Image.new("RGB", (1400, 1000), (110, 125, 120))
    if name == "too small":
        wall.paste(sitter[0].resize((40, 46)), (700, 500))
    photo = np.asarray(wall)
    with pytest.raises(FaceNotFoundError, match=r"^target: no face found; .*--target-landmarks FILE"):
        transfer(photo, light="rim")


def test_hand_made_landmarks_do_where_detection_fails(sitter):
    """Five points on a face that is too small to be found."""
    photo, face = sitter
    wall = Image.new("RGB", (700, 500), (110, 125, 120))
    wall.paste(photo.resize((40, 46)), (300, 200))
    points = face.xy[[33, 263, 1, 61, 291, 10, 152, 234, 454]] * 40 / 600 + [300, 200]
    result = transfer(np.asarray(wall), light="split", target_landmarks=Landmarks(points))
    changed = np.abs(result.image.astype(int) - np.asarray(wall)).sum(axis=2) > 0
    assert 100 < changed.sum() < 3000
