"""The augmentation: what a call does, where references come from, what is refused."""

import shutil

import numpy as np
import pytest
from PIL import Image

import relit
from relit.errors import FaceNotFoundError, ImageError, LandmarkError, OptionError, RelitError
from relit.photo.color import luma
from relit.photo.pixels import from_unit, to_unit
from relit.train.augment import RelightAugment

NO_FACE = np.full((40, 40, 3), 90, np.uint8)


# What a call does


@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"strength": 0.7, "tint": ["take", 0.4], "exposure": (-0.5, 0.5)},
        {"method": ["ltv", "moments"], "lam": (0.1, 0.4), "mask": [True, False]},
    ],
)
@pytest.mark.parametrize("grey", [False, True])
@pytest.mark.rotating
def test_a_call_is_the_transfer_that_draw_tells_of(image, marks, reference, grey, changes):
    target = from_unit(luma(to_unit(image)), np.uint8) if grey else image
    lightness = from_unit(luma(to_unit(reference)), np.uint8) if grey else reference
    augment = RelightAugment([reference], lights="random", p=1, seed=5, **changes)
    face = relit.detect_landmarks(reference)
    assert face.interocular_distance > 2 * 90  # which shading asks for
    kinds = set()
    for number in range(4):
        draw = augment.draw(number)
        kinds.add(draw.reference)
        expected = relit.transfer(
            target,
            None if draw.reference is None else lightness,
            target_landmarks=marks,
            reference_landmarks=None if draw.reference is None else face,
            options=draw.options,
        ).image
        np.testing.assert_array_equal(augment(target, landmarks=marks), expected)
    assert kinds == {None, 0}


def test_faces_are_detected_as_transfer_does(image, folder):
    augment = RelightAugment(folder / "second.png", p=1, seed=1, detail=30)
    light = relit.read_image(folder / "second.png")
    expected = relit.transfer(image, light, detail=30, options=augment.draw(0).options).image
    np.testing.assert_array_equal(augment(image), expected)


def test_a_number_does_not_count_as_a_call(image, marks):
    augment = RelightAugment(p=1, seed=5)
    third, first = (augment(image, landmarks=marks, number=number) for number in (2, 0))
    calls = [augment(image, landmarks=marks) for _ in range(3)]
    np.testing.assert_array_equal(calls[0], first)
    np.testing.assert_array_equal(calls[2], third)
    assert not np.array_equal(first, third)


def test_without_a_face_an_image_is_kept_or_refused():
    assert RelightAugment(p=1, seed=0)(NO_FACE) is NO_FACE
    with pytest.raises(FaceNotFoundError, match="image: no face found"):
        RelightAugment(p=1, seed=0, on_missing="raise")(NO_FACE)


def test_a_reference_without_a_face_is_refused(image, marks, tmp_path):
    Image.fromarray(NO_FACE).save(tmp_path / "wall.png")
    augment = RelightAugment([tmp_path / "wall.png"], p=1, seed=0)
    with pytest.raises(FaceNotFoundError, match=r"wall\.png: no face found"):
        augment(image, landmarks=marks)
    with pytest.raises(FaceNotFoundError, match=r"references\[1\]: no face found"):
        RelightAugment([image, NO_FACE]).prepare()


# References by path


def test_a_folder_and_a_pattern_stand_for_their_photos(folder):
    photos = (folder / "b" / "first.JPG", folder / "second.png")
    assert RelightAugment(folder).references == RelightAugment(str(folder)).references == photos
    assert RelightAugment(f"{folder}/**/*.png").references == photos[1:]
    assert RelightAugment([f"{folder}/sec*", folder / "b"]).references == photos[::-1]
    odd = folder / "odd[1].png"
    shutil.copy(photos[1], odd)
    assert RelightAugment(str(odd)).references == (odd,)


# What is refused


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"p": 1.5}, "p: expected a probability"),
        ({"p": "often"}, "p: expected a probability"),
        ({"p": float("nan")}, "p: expected a probability"),
        ({"seed": -1}, "seed: expected an integer of 0 or more, got -1"),
        ({"seed": 1.5}, "seed: "),
        ({"on_missing": "skip"}, "on_missing: expected 'keep' or 'raise', got 'skip'"),
        ({"detail": 0}, "detail: "),
        ({"detail": "low"}, "detail: "),
        ({"lights": "sunset"}, "lights: expected random, rembrandt, .*, got 'sunset'"),
        ({"lights": ["loop", 3]}, "lights: .*, got 3"),
        ({"lights": []}, "lights: expected at least one"),
        ({"lights": 3}, "lights: "),
        ({"lights": (200, 0)}, r"lights: .*, got \(200, 0\)"),
        ({"lights": ["loop", (1, 2, 3)]}, r"lights: .*, got \(1, 2, 3\)"),
        ({"azimuth": (-200, 0)}, "azimuth: expected .*±180, got"),
        ({"azimuth": 30}, "azimuth: "),
        ({"elevation": (20, 10)}, "elevation: "),
        ({"strength": (0.5, 9)}, "strength: expected a finite number .*, got 9"),
        ({"strength": (1, 0.5)}, "strength: expected two numbers"),
        ({"strength": (0.1, 0.2, 0.3)}, "strength: expected two numbers"),
        ({"tint": ("keep", "take")}, "tint: expected two numbers .* list"),
        ({"tint": []}, "tint: expected at least one value"),
        ({"tint": ["keep", "drop"]}, "tint: .*'drop'"),
        ({"neighborhood": (4, 16)}, "neighborhood: "),
        ({"brightness": 2}, "brightness: no such option"),
        ({"light": "loop"}, "light: expected none; give lights"),
        ({"options": relit.TransferOptions(light="loop")}, "light: expected none; give lights"),
        ({"method": ["ltv", "quotient"]}, "method: expected one that takes no second reference"),
        ({"method": ["ltv", "shading"], "color_space": "hsv", "channels": ["v", "s"]}, "channels: "),
        ({"references": []}, "references: expected at least one"),
        ({"references": "/nowhere/*.jpg"}, r"references: no photo found at '/nowhere/\*\.jpg'"),
        ({"references": 3}, r"references\[0\]: expected an array"),
        ({"references": [np.zeros((40, 40, 5))]}, r"references\[0\]: expected shape"),
        ({"references": [NO_FACE], "reference_landmarks": []}, "reference_landmarks: expected one entry"),
        ({"references": [NO_FACE], "reference_landmarks": [[1]]}, r"reference_landmarks\[0\]: "),
        ({"reference_landmarks": []}, "reference_landmarks: expected none"),
    ],
)
def test_errors_name_the_argument(given, message):
    with pytest.raises(RelitError, match=f"^{message}"):
        RelightAugment(**given)


def test_choices_that_go_only_with_some_others_are_allowed():
    augment = RelightAugment(method=["ltv"], color_space=["hsv"], channels="s", seed=1)
    assert augment.draw(0).options.channels == "s"


@pytest.mark.parametrize("p", [0, 1])
@pytest.mark.parametrize(
    ("sample", "message"),
    [
        (NO_FACE + 1.0, r"image: floats must be .* in \[0, 1\]"),
        (np.dstack([NO_FACE, NO_FACE]), "image: expected shape"),
        (NO_FACE[:4], "image: 40x4 px"),
        ("photo.jpg", "image: expected an array, .* got str"),
        (Image.new("CMYK", (40, 40)), "image: expected mode .* got CMYK"),
        ((3, "label"), "sample: .* found int, str"),
        ([], "sample: .* found nothing"),
    ],
)
def test_what_is_no_image_is_refused_whatever_is_drawn(p, sample, message):
    with pytest.raises(ImageError, match=f"^{message}"):
        RelightAugment(p=p)(sample)


def test_other_calls_are_refused_by_name(image, tmp_path):
    augment = RelightAugment(p=1, seed=1)
    with pytest.raises(OptionError, match=r"^number: "):
        augment(image, number=-1)
    with pytest.raises(OptionError, match=r"^number: "):
        augment.draw("first")
    with pytest.raises(OptionError, match=r"^epoch: "):
        augment.set_epoch(0.5)
    unseeded = RelightAugment()
    unseeded.set_epoch(1)
    for unknown in (augment, unseeded):
        with pytest.raises(OptionError, match=r"^worker: .* seed and an epoch"):
            unknown.draw(0, worker=1)
    with pytest.raises(LandmarkError, match=r"^landmarks: "):
        augment(image, landmarks=[[1, 2]])
    with pytest.raises(LandmarkError, match=r"^landmarks: .* outside"):
        augment(image, landmarks=[[1000, 20], [1020, 20], [1010, 40]])
    with pytest.raises(ImageError, match=r"missing\.png"):
        RelightAugment(tmp_path / "missing.png").prepare()
    whole = tmp_path / "whole.png"
    Image.fromarray(image).save(whole)
    cut = tmp_path / "cut.png"
    cut.write_bytes(whole.read_bytes()[:2000])
    with Image.open(cut) as picture, pytest.raises(ImageError, match=r"^image: cannot be read"):
        augment(picture)
