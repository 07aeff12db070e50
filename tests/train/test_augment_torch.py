"""The augmentation among what it is made for: tensors, transforms and data loaders of PyTorch."""

# ruff: noqa: F811 (fixtures of another module)

import subprocess
import sys

import numpy as np
import pytest

import relit
from relit.errors import ImageError
from relit.train.augment import RelightAugment
from tests.train.test_augment import image, marks  # noqa: F401 (fixtures)

torch = pytest.importorskip("torch")
loaders = pytest.importorskip("torch.utils.data")


def planes(pixels):
    return torch.from_numpy(np.ascontiguousarray(np.atleast_3d(pixels).transpose(2, 0, 1)))


@pytest.mark.parametrize("colour", [True, False])
@pytest.mark.parametrize("dtype", ["uint8", "uint16", "float32", "float64"])
def test_a_tensor_is_relit_as_the_array_is(image, marks, dtype, colour):
    pixels = image if colour else image[..., 1]
    whole = {"uint8": pixels, "uint16": pixels.astype(np.uint16) * 257}
    array = whole.get(dtype, (pixels / 255).astype(dtype))
    augment = RelightAugment(p=1, seed=4)
    made = augment(planes(array), landmarks=marks)
    assert type(made) is torch.Tensor
    torch.testing.assert_close(made, planes(augment(array, landmarks=marks, number=0)), rtol=0, atol=0)


@pytest.mark.parametrize("dtype", ["float16", "bfloat16"])
def test_small_floats_are_rounded_and_no_more(image, marks, dtype):
    small = planes(image).div(255).to(getattr(torch, dtype))
    augment = RelightAugment(p=1, seed=4)
    made = augment(small, landmarks=marks)
    assert made.dtype == small.dtype
    expected = augment(small.float(), landmarks=marks, number=0).to(small.dtype)
    torch.testing.assert_close(made, expected, rtol=0, atol=0)


def test_a_tensor_may_want_a_gradient(image, marks):
    wanting = planes(image).div(255).requires_grad_()
    assert not RelightAugment(p=1, seed=4)(wanting, landmarks=marks).requires_grad


@pytest.mark.parametrize("shape", [(2, 3, 40, 40), (40, 40), (4, 40, 40), (40, 40, 3)])
def test_other_shapes_are_refused(shape):
    with pytest.raises(ImageError, match=r"^image: expected a tensor of shape \(3, H, W\) or \(1, H, W\)"):
        RelightAugment()(torch.zeros(shape))


def test_a_normalised_tensor_is_refused():
    with pytest.raises(ImageError, match=r"^image: floats must be finite and in \[0, 1\]"):
        RelightAugment()(torch.full((3, 40, 40), -1.5))


def test_it_brings_no_torch_itself():
    code = "import sys, relit; relit.RelightAugment(p=1)(relit.read_image(relit.sample('target')).pixels)"
    code += "; print('torch' in sys.modules)"
    assert subprocess.check_output([sys.executable, "-c", code], text=True).strip() == "False"


# torchvision


def test_it_goes_into_a_composition(image):
    pytest.importorskip("torchvision")
    from torchvision import tv_tensors
    from torchvision.transforms import v2

    augment = RelightAugment(p=1, seed=4, on_missing="raise")
    whole = v2.Compose([augment, v2.ToDtype(torch.float32, scale=True), v2.Normalize([0.5] * 3, [0.5] * 3)])
    relit_image = augment(planes(image), number=0)
    expected = relit_image.float() / 255 * 2 - 1
    sample = {
        "mask": tv_tensors.Mask(torch.ones(1, *image.shape[:2], dtype=torch.uint8)),
        "boxes": tv_tensors.BoundingBoxes([[1, 2, 30, 40]], format="XYXY", canvas_size=image.shape[:2]),
        "heat": torch.rand(3, *image.shape[:2]),
        "image": tv_tensors.Image(planes(image)),
        "label": 3,
    }
    made = augment(sample, number=0)
    assert type(made["image"]) is tv_tensors.Image
    torch.testing.assert_close(made["image"].as_subclass(torch.Tensor), relit_image)
    assert all(made[name] is sample[name] for name in sample if name != "image")
    torch.testing.assert_close(whole(planes(image)), expected)
    augment.set_epoch(0)
    made, label = whole(tv_tensors.Image(planes(image)), 3)
    assert (type(made), label) == (tv_tensors.Image, 3)
    torch.testing.assert_close(made.as_subclass(torch.Tensor), expected)


def test_of_a_sample_with_masks_and_a_plain_tensor_the_tensor_is_relit(image, marks):
    tv_tensors = pytest.importorskip("torchvision.tv_tensors")
    mask = tv_tensors.Mask(torch.ones(1, *image.shape[:2], dtype=torch.uint8))
    made = RelightAugment(p=1, seed=4)((mask, planes(image)), landmarks=marks)
    assert made[0] is mask
    assert not torch.equal(made[1], planes(image))


# Data loaders


class Faces(loaders.Dataset):
    """One face, over and over, each relit; the sum of its pixels is a fingerprint of the light."""

    def __init__(self, pixels, landmarks, augment):
        self.pixels, self.landmarks, self.augment = pixels, landmarks, augment

    def __len__(self):
        return 8

    def __getitem__(self, place):
        made = self.augment(planes(self.pixels), landmarks=self.landmarks)
        return int(made.sum()), loaders.get_worker_info().id


@pytest.mark.parametrize("method", ["fork", "spawn"])
@pytest.mark.filterwarnings("ignore:.*fork.*:DeprecationWarning")
def test_workers_draw_differently_and_the_same_in_every_run(image, marks, method):
    augment = RelightAugment(relit.sample("reference"), lights="random", p=1, seed=4)
    augment.prepare()
    augment(planes(image), number=0)  # what was used before a fork must work after it

    def epoch(number):
        augment.set_epoch(number)
        faces = Faces(image, marks, augment)
        found = list(loaders.DataLoader(faces, None, num_workers=2, multiprocessing_context=method))
        return [[light for light, worker in found if worker == one] for one in (0, 1)]

    first, second, again = epoch(0), epoch(1), epoch(0)
    assert first == again
    lights = [tuple(some) for some in (*first, *second)]
    assert len(set(lights)) == 4
    augment.set_epoch(1)
    for worker, sums in enumerate(second):
        for number, light in enumerate(sums):
            draw = augment.draw(number, worker=worker)
            face = relit.read_image(relit.sample("reference")) if draw.reference == 0 else None
            made = relit.transfer(image, face, target_landmarks=marks, options=draw.options)
            assert made.image.sum() == light


def test_persistent_workers_go_on_counting(image, marks):
    augment = RelightAugment(p=1, seed=4)
    loader = loaders.DataLoader(
        Faces(image, marks, augment),
        None,
        num_workers=1,
        persistent_workers=True,
        multiprocessing_context="spawn",
    )
    sums = [light for _ in range(2) for light, _ in loader]
    made = [
        relit.transfer(image, target_landmarks=marks, options=augment.draw(number, worker=0).options).image
        for number in range(16)
    ]
    assert sums == [pixels.sum() for pixels in made]
    del loader._iterator


def test_without_a_seed_every_epoch_differs(image, marks):
    faces = Faces(image, marks, RelightAugment(p=1))
    loader = loaders.DataLoader(faces, None, num_workers=2, multiprocessing_context="spawn")
    lights = [light for _ in range(2) for light, _ in loader]
    assert len(set(lights)) > 12
