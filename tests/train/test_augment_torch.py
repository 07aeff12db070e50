"""The augmentation among what it is made for: tensors, transforms and data loaders of PyTorch."""

import subprocess
import sys

import numpy as np
import pytest

import relit
from relit.errors import ImageError
from relit.train.augment import RelightAugment

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


# transfer


@pytest.mark.parametrize("dtype", ["uint8", "uint16", "float16", "float32"])
def test_transfer_takes_tensors_and_gives_them_back(image, marks, dtype):
    scale = {"uint8": 1, "uint16": 257}.get(dtype, 1 / 255)
    target = (planes(image).double() * scale).to(getattr(torch, dtype))
    faces = {"target_landmarks": marks, "reference_landmarks": marks, "method": "moments"}
    made = relit.transfer(target, planes(image).flip(2), **faces).image
    assert (type(made), made.dtype, made.shape) == (torch.Tensor, target.dtype, target.shape)
    wide = target.float() if dtype == "float16" else target
    array = wide.permute(1, 2, 0).contiguous().numpy()
    expected = relit.transfer(array, image[:, ::-1].copy(), **faces).image
    torch.testing.assert_close(made, planes(expected).to(target.dtype), rtol=0, atol=0)


def test_transfer_colours_a_grey_tensor(image, marks):
    faces = {"target_landmarks": marks, "reference_landmarks": marks, "method": "moments"}
    made = relit.transfer(planes(image[..., 1]), image, **faces).image
    assert (made.dtype, made.shape) == (torch.uint8, (3, *image.shape[:2]))


def test_transfer_keeps_images_of_torchvision(image, marks):
    tv_tensors = pytest.importorskip("torchvision.tv_tensors")
    made = relit.transfer(tv_tensors.Image(planes(image)), light="loop", target_landmarks=marks).image
    assert type(made) is tv_tensors.Image


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
        worker = loaders.get_worker_info()
        return int(made.sum()), worker and worker.id


def epochs(image, marks, augment, count, generator=None, **settings):
    """Return the fingerprints of so many epochs: of each, those that each worker made."""
    faces = Faces(image, marks, augment)
    loader = loaders.DataLoader(faces, None, generator=generator, **settings)
    found = [list(loader) for _ in range(count)]
    del loader
    workers = sorted({worker for _, worker in found[0]}, key=str)
    return [[[light for light, worker in epoch if worker == one] for one in workers] for epoch in found]


@pytest.mark.parametrize(
    "settings",
    [
        {"num_workers": 0},
        {"num_workers": 2, "multiprocessing_context": "fork"},
        {"num_workers": 1, "multiprocessing_context": "spawn"},
        {"num_workers": 2, "multiprocessing_context": "fork", "persistent_workers": True},
    ],
    ids=["alone", "fork", "spawn", "persistent"],
)
@pytest.mark.filterwarnings("ignore:.*fork.*:DeprecationWarning")
def test_epochs_differ_and_a_run_repeats(image, marks, settings):
    def run(torch_seed):
        generator = torch.Generator().manual_seed(torch_seed)
        return epochs(image, marks, RelightAugment(p=1, seed=4, detail=10), 2, generator, **settings)

    first = run(1)
    assert first == run(1)
    lights = [light for epoch in first for worker in epoch for light in worker]
    assert len(lights) == 16
    assert len(set(lights)) > 13  # now and then two lights have one fingerprint
    assert (first == run(2)) == (settings["num_workers"] == 0)


@pytest.mark.parametrize("method", ["fork", "spawn"])
@pytest.mark.filterwarnings("ignore:.*fork.*:DeprecationWarning")
def test_after_set_epoch_draws_are_those_that_draw_tells(image, marks, method):
    augment = RelightAugment(relit.sample("reference"), lights="random", p=1, seed=4)
    augment.prepare()
    augment(planes(image), number=0)  # what was used before a fork must work after it

    def epoch(number):
        augment.set_epoch(number)
        return epochs(image, marks, augment, 1, num_workers=2, multiprocessing_context=method)[0]

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
    augment.set_epoch(0)
    found = epochs(
        image, marks, augment, 2, num_workers=1, persistent_workers=True, multiprocessing_context="spawn"
    )
    made = [
        relit.transfer(image, target_landmarks=marks, options=augment.draw(number, worker=0).options).image
        for number in range(16)
    ]
    assert [light for epoch in found for light in epoch[0]] == [pixels.sum() for pixels in made]


def test_without_a_seed_every_epoch_differs(image, marks):
    found = epochs(image, marks, RelightAugment(p=1), 2, num_workers=2, multiprocessing_context="spawn")
    assert len({light for epoch in found for worker in epoch for light in worker}) > 12
