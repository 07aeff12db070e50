"""Splitting a reference in its own frame: the same light where the frame is one, and else its u, laid."""

import numpy as np
import pytest
from skimage import data
from skimage.color import rgb2gray
from skimage.transform import resize

from relit.face.landmarks import Landmarks
from relit.ltv.decomposition import decompose
from relit.photo.pixels import DARKEST
from relit.relighting import transfer
from relit.settings.options import TransferOptions
from relit.warp.alignment import align

OTHERS = [
    name for name in TransferOptions.__dataclass_fields__["method"].metadata["choices"] if name != "ltv"
]


@pytest.fixture
def face(face_points):
    """On the frames below."""
    return face_points * 0.9 + [26, 40]


@pytest.fixture
def target():
    return data.astronaut()[20:180, 140:300]


@pytest.fixture
def reference(target):
    return np.ascontiguousarray(target[:, ::-1, ::-1])


def grey(image):
    return np.rint(rgb2gray(image) * 255).astype(np.uint8)


@pytest.mark.parametrize("mask", [True, False])
@pytest.mark.parametrize("space", [{}, {"color_space": "hsv", "channels": "v"}, {"color_space": "ycbcr"}])
@pytest.mark.parametrize("greys", [(), (0,), (1,), (0, 1)])
def test_in_one_frame_the_order_changes_nothing(target, reference, face, mask, space, greys):
    pair = [grey(photo) if k in greys else photo for k, photo in enumerate((target, reference))]
    given = {"target_landmarks": face, "reference_landmarks": face, "method": "ltv", "mask": mask, **space}
    paper, ours = (transfer(*pair, **given, split_first=first) for first in (False, True))
    np.testing.assert_allclose(ours.change, paper.change, atol=1e-3)
    np.testing.assert_allclose(ours.image.astype(int), paper.image, atol=1)
    for part in ("u", "v"):
        one, other = (getattr(result.first.reference_split, part) for result in (ours, paper))
        np.testing.assert_allclose(one, other, rtol=1e-3)


@pytest.mark.parametrize("size", [0.7, 1.6])
def test_u_is_that_of_the_reference_alone_laid_over_the_target(target, reference, face, size):
    """λ goes by the size of the reference's own face."""
    theirs = np.rint(resize(reference, (int(160 * size),) * 2, order=3) * 255).astype(np.uint8)
    rng = np.random.default_rng(0)
    landmarks = Landmarks((face + 0.5) * size - 0.5 + rng.normal(0, 0.5, face.shape))
    result = transfer(
        target, theirs, target_landmarks=face, reference_landmarks=landmarks,
        method="ltv", lam=0.4, split_first=True, mask=False,
    )  # fmt: skip
    split = result.first.reference_split
    alone = decompose(theirs, 0.4, interocular_distance=landmarks.interocular_distance)
    laid = align(alone.u, landmarks, Landmarks(face), target.shape)
    np.testing.assert_array_equal(split.u, laid.warped)
    np.testing.assert_allclose(
        split.u * split.v, np.maximum(result.first.warped / 255, DARKEST), rtol=1e-5, atol=1e-6
    )
    assert split.lam == alone.lam
    product = split.u * result.first.target_split.v
    np.testing.assert_allclose(result.image, np.clip(product, 0, 1) * 255, atol=0.501)


def test_of_a_large_photo_the_face_and_its_surroundings_are_split(target, reference, face, monkeypatch):
    """What lies farther away cannot be seen in the result."""
    sizes = []
    split = decompose.__wrapped__
    monkeypatch.setattr(
        "relit.methods.paper.decompose",
        lambda image, *given, **named: (sizes.append(image.shape), split(image, *given, **named))[1],
    )
    given = {"target_landmarks": face, "method": "ltv", "split_first": True}
    around = np.pad(reference, ((300, 250), (200, 350), (0, 0)), mode="reflect")
    large = transfer(target, around, reference_landmarks=face + np.array([200, 300]), **given)
    assert max(np.prod(shape[:2]) for shape in sizes) < 300**2 < np.prod(around.shape[:2]) / 4
    changed = around.copy()
    changed[:100] = changed[-100:] = 255
    np.testing.assert_array_equal(
        transfer(target, changed, reference_landmarks=face + np.array([200, 300]), **given).image, large.image
    )
    # Against the whole photo's split, where the change is made.
    landmarks = Landmarks(face + np.array([200, 300]))
    whole = split(around, 0.2, interocular_distance=landmarks.interocular_distance)
    expected = align(whole.u, landmarks, large.view.landmarks, large.view.pixels.shape).warped
    difference = np.abs(large.first.reference_split.u - expected).max(axis=2)
    assert difference[large.mask > 0.01].max() < 0.02


@pytest.mark.slow
def test_other_methods_take_no_notice(target, reference, face):
    for method in OTHERS:
        second = {}
        if method in ("quotient", "expression-ratio"):
            second = {"second_reference": target, "second_landmarks": face}
        given = {"target_landmarks": face, "reference_landmarks": face + 2, "method": method, **second}
        images = [transfer(target, reference, **given, split_first=first).image for first in (False, True)]
        np.testing.assert_array_equal(*images, err_msg=method)


def test_a_light_by_name_has_no_other_frame(target, face):
    given = {"target_landmarks": face, "light": "rembrandt", "method": "ltv"}
    np.testing.assert_array_equal(
        *(transfer(target, **given, split_first=first).image for first in (False, True))
    )


def test_of_several_references_each_is_split_alone(target, reference, face):
    """The median of two is their mean, in the logarithm."""
    given = {"target_landmarks": face, "method": "ltv", "split_first": True, "mask": False}
    references, marks = [reference, np.rot90(reference, 2)], [face + 3, 158 - face]
    each = [
        transfer(target, one, reference_landmarks=mark, **given).change
        for one, mark in zip(references, marks, strict=True)
    ]
    both = transfer(target, references, reference_landmarks=marks, **given)
    np.testing.assert_allclose(both.change, np.mean(each, axis=0), atol=1e-5)
