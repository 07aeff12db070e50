"""What goes into a transfer: images of every kind, which come out as the kind that they were."""

import numpy as np
import pytest
from PIL import Image
from skimage import data

import relit
from relit.photo.photo import Photo
from relit.photo.writing import write_image


@pytest.fixture
def target():
    return data.astronaut()[20:180, 140:300]


@pytest.fixture
def faces(face_points):
    face = face_points * 0.9 + [26, 40]
    return {"target_landmarks": face, "reference_landmarks": face, "method": "moments"}


@pytest.fixture
def reference(target):
    return np.ascontiguousarray(target[:, ::-1])


@pytest.fixture
def plain(target, reference, faces):
    return relit.transfer(target, reference, **faces).image


def test_an_image_of_any_kind_comes_back_as_it_was(target, reference, faces, plain, tmp_path):
    alpha = np.tile(np.arange(160, dtype=np.uint8), (160, 1))
    write_image(tmp_path / "target.png", target)
    write_image(tmp_path / "reference.png", Photo(reference, alpha))
    lights = [tmp_path / "reference.png", Image.fromarray(reference), np.dstack([reference, alpha])]
    for given, light in zip(
        (tmp_path / "target.png", str(tmp_path / "target.png"), Photo(target)), lights, strict=True
    ):
        made = relit.transfer(given, light, **faces).image
        assert type(made) is np.ndarray
        np.testing.assert_array_equal(made, plain)
    picture = relit.transfer(Image.fromarray(np.dstack([target, alpha])), lights[0], **faces).image
    assert picture.mode == "RGBA"
    for made in (relit.transfer(np.dstack([target, alpha]), reference, **faces).image, np.asarray(picture)):
        np.testing.assert_array_equal(made, np.dstack([plain, alpha]))


@pytest.mark.parametrize("colour", [False, True])
def test_a_single_channel_keeps_its_axis(target, reference, faces, colour):
    light = reference if colour else reference[..., 1]
    made = relit.transfer(target[..., 1:2], light, **faces).image
    expected = relit.transfer(target[..., 1], light, **faces).image
    assert made.shape == (160, 160, 3 if colour else 1)
    np.testing.assert_array_equal(made, np.atleast_3d(expected))


def test_several_references_may_be_of_different_kinds(target, reference, faces, tmp_path):
    write_image(tmp_path / "c.png", target)
    arrays = [reference, reference[::-1].copy(), target]
    kinds = [Image.fromarray(arrays[0]), np.dstack([arrays[1], arrays[1][..., 0]]), tmp_path / "c.png"]
    several = faces | {"reference_landmarks": [faces["reference_landmarks"]] * 3}
    expected = relit.transfer(target, arrays, **several)
    made = relit.transfer(target, kinds, **several)
    np.testing.assert_array_equal(made.image, expected.image)
    for one, other in zip(made.references, expected.references, strict=True):
        np.testing.assert_array_equal(one, other)


def test_a_second_reference_may_be_of_any_kind(target, reference, faces):
    settings = faces | {"method": "quotient", "second_landmarks": faces["reference_landmarks"]}
    expected = relit.transfer(target, reference, second_reference=target, **settings).image
    made = relit.transfer(target, reference, second_reference=Image.fromarray(target), **settings).image
    np.testing.assert_array_equal(made, expected)


def test_a_lamp_may_be_given_by_its_angles(target, faces):
    face = {"target_landmarks": faces["target_landmarks"]}
    made = relit.transfer(target, light=(-30, 20), **face)
    assert made.options.light == "-30,20"
    np.testing.assert_array_equal(made.image, relit.transfer(target, light="-30,20", **face).image)


def test_other_functions_take_every_kind_too(target, faces):
    picture = Image.fromarray(np.dstack([target, target[..., 0]]))
    np.testing.assert_array_equal(
        relit.detect_landmarks(picture).points, relit.detect_landmarks(target).points
    )
    np.testing.assert_array_equal(relit.decompose(picture).u, relit.decompose(target).u)
    np.testing.assert_array_equal(relit.normalize(Photo(target)), relit.normalize(target))
    marks = faces["target_landmarks"], faces["target_landmarks"] + 3, target.shape
    np.testing.assert_array_equal(relit.align(picture, *marks).warped, relit.align(target, *marks).warped)
