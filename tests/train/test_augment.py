"""The augmentation: what it draws, that copies and workers draw what they should, what it leaves alone."""

import copy
import multiprocessing
import pickle
import shutil
import sys
from collections import Counter, namedtuple
from types import SimpleNamespace

import imagecodecs
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image
from scipy.stats import binomtest, kstest

import relit
from relit.errors import FaceNotFoundError, ImageError, LandmarkError, OptionError, RelitError
from relit.photo.color import luma
from relit.photo.pixels import from_unit, to_unit
from relit.train import reference_pool
from relit.train.augment import RelightAugment

NO_FACE = np.full((40, 40, 3), 90, np.uint8)


def _face_of(name, side):
    """Return the face of a sample photo, on so many px."""
    pixels = relit.read_image(relit.sample(name)).pixels
    face = relit.detect_landmarks(pixels).xy
    x, y = face.mean(axis=0).astype(int)
    reach = int(1.1 * np.ptp(face[:, 0]))
    box = (max(x - reach, 0), max(y - reach, 0), x + reach, y + reach)
    return np.asarray(Image.fromarray(pixels).crop(box).resize((side, side), Image.Resampling.LANCZOS))


@pytest.fixture(scope="module")
def image():
    """A face, about 60 px wide."""
    return _face_of("target", 128)


@pytest.fixture(scope="module")
def marks(image):
    return relit.detect_landmarks(image)


@pytest.fixture(scope="module")
def reference():
    """Large enough to be reduced before it is looked at."""
    return _face_of("reference", 900)


@pytest.fixture
def folder(tmp_path):
    """Two photos, one in a folder of its own, and what is none."""
    (tmp_path / "b").mkdir()
    shutil.copy(relit.sample("reference"), tmp_path / "b" / "first.JPG")
    shutil.copy(relit.sample("target"), tmp_path / "second.png")
    (tmp_path / "notes.txt").write_text("no photo")
    return tmp_path


def draws(augment, count=12, **where):
    return [augment.draw(number, **where) for number in range(count)]


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


def test_a_skipped_image_comes_back_itself(image):
    augment = RelightAugment(p=0, seed=0)
    assert augment(image) is image
    sample = (image, 1)
    assert augment(sample) is sample
    assert not any(draw.applied for draw in draws(augment))
    assert all(draw.applied for draw in draws(RelightAugment(p=1, seed=0)))


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


# Draws


def test_draws_follow_the_documented_key():
    augment = RelightAugment(p=0.5, seed=3)
    for number, draw in enumerate(draws(augment, 30)):
        key = np.random.SeedSequence(3, spawn_key=(0, 0, number))
        assert draw.applied == (np.random.Generator(np.random.PCG64(key)).random() < 0.5)
    augment.set_epoch(4)
    for worker in (None, 0, 6):
        for number, draw in enumerate(draws(augment, 30, worker=worker)):
            place = 0 if worker is None else worker + 1
            key = np.random.SeedSequence(3, spawn_key=(4, place, number))
            assert draw.applied == (np.random.Generator(np.random.PCG64(key)).random() < 0.5)


def test_seeds_epochs_and_workers_draw_differently():
    augment = RelightAugment(seed=1)
    others = [draws(augment), draws(RelightAugment(seed=2))]
    augment.set_epoch(0)
    assert draws(augment) == others[0]
    others += [draws(augment, worker=worker) for worker in (0, 1)]
    augment.set_epoch(1)
    others.append(draws(augment))
    assert len({tuple(draw.options.light for draw in some) for some in others}) == len(others)
    augment.set_epoch(0)
    assert draws(augment) == others[0]


def test_without_a_seed_draws_differ():
    assert draws(RelightAugment()) != draws(RelightAugment())


def test_what_else_is_random_changes_no_draw():
    plain, more = RelightAugment(seed=1, p=1), RelightAugment(seed=1, p=0.1, shadows=(0, 1), tint=["keep"])
    for one, other in zip(draws(plain), draws(more), strict=True):
        assert (one.options.light, one.options.strength) == (other.options.light, other.options.strength)


def test_draws_have_the_chances_they_should():
    pictures = [np.full((120, 120), level, np.uint8) for level in (50, 100, 150)]
    augment = RelightAugment(
        pictures,
        lights=["loop", "random"],
        p=0.3,
        azimuth=(-40, 60),
        elevation=(10, 30),
        strength=(0.5, 0.9),
        tint=["keep", "take"],
        seed=11,
    )
    some = draws(augment, 4000)
    lights = [draw.options.light for draw in some if draw.options.light]
    lamps = np.array([light.split(",") for light in lights if light != "loop"], float)
    counts = Counter(draw.reference for draw in some)
    for count, total, chance in [
        (sum(draw.applied for draw in some), 4000, 0.3),
        (counts[None], 4000, 1 / 2),
        *((counts[number], 4000, 1 / 6) for number in range(3)),
        (lights.count("loop"), len(lights), 1 / 2),
        (sum(draw.options.tint == "take" for draw in some), 4000, 1 / 2),
    ]:
        assert binomtest(count, total, chance).pvalue > 1e-3
    strengths = [draw.options.strength for draw in some]
    for values, low, high in [(strengths, 0.5, 0.9), (lamps[:, 0], -40, 60), (lamps[:, 1], 10, 30)]:
        assert low <= min(values) <= max(values) <= high
        assert kstest(values, "uniform", (low, high - low)).pvalue > 1e-3
    # Nor do they hang together: what is drawn in one call with the next one's, or with one another.
    for one, other in [(strengths[:-1], strengths[1:]), (lamps[:, 0], lamps[:, 1])]:
        assert abs(np.corrcoef(one, other)[0, 1]) < 4 / np.sqrt(len(one))


# Copies and workers


@pytest.mark.parametrize("again", [copy.deepcopy, lambda augment: pickle.loads(pickle.dumps(augment))])
def test_a_copy_goes_on_where_the_original_was(image, marks, folder, again):
    augment = RelightAugment([folder / "second.png", image], lights="random", p=0.8, seed=5)
    augment.set_epoch(2)
    for _ in range(3):
        augment(image, landmarks=marks)
    other = again(augment)
    assert repr(other) == repr(augment)
    for _ in range(4):
        np.testing.assert_array_equal(other(image, landmarks=marks), augment(image, landmarks=marks))


def test_references_are_read_late_and_their_faces_found_once(image, marks, folder, monkeypatch):
    calls = []
    for name in ("read_image", "detect_landmarks"):
        real = getattr(reference_pool, name)
        monkeypatch.setattr(
            reference_pool,
            name,
            lambda given, name_=name, real=real, **more: (calls.append(name_), real(given, **more))[1],
        )
    augment = RelightAugment(folder, p=1, seed=0)
    assert calls == []
    augment.prepare()
    assert Counter(calls) == {"read_image": 2, "detect_landmarks": 2}
    for _ in range(4):
        augment(image, landmarks=marks)
    assert len(calls) == 4
    small = pickle.dumps(augment)
    assert len(small) < 60_000  # two meshes, no pixels
    other = pickle.loads(small)
    for _ in range(4):
        other(image, landmarks=marks)
    assert Counter(calls) == {"read_image": 4, "detect_landmarks": 2}


def test_photos_that_were_read_are_forgotten_beyond_a_limit(folder, monkeypatch):
    reads = []
    real = reference_pool.read_image
    monkeypatch.setattr(reference_pool, "read_image", lambda path: (reads.append(path), real(path))[1])
    pool = reference_pool.ReferencePool(folder, most_bytes=1)
    for number in (0, 0, 1, 1, 0):
        pool.seen(number, relit.Photo(NO_FACE), relit.TransferOptions(), None)
    assert len(reads) == 3


def _work(augment, image, marks, worker, results):
    """Be a worker of a DataLoader, as far as relit can see."""
    if worker is not None:
        info = SimpleNamespace(id=worker, seed=1000 + worker, num_workers=2)
        sys.modules["torch.utils.data"] = SimpleNamespace(get_worker_info=lambda: info)
    results.put((worker, [augment(image, landmarks=marks).sum() for _ in range(3)], augment(image).sum()))


@pytest.mark.slow
@pytest.mark.parametrize("method", ["fork", "spawn"])
@pytest.mark.filterwarnings("ignore:.*fork.*:DeprecationWarning")
def test_workers_draw_differently_and_the_same_in_every_run(image, marks, folder, method):
    if method not in multiprocessing.get_all_start_methods():
        pytest.skip("this system cannot fork")
    context = multiprocessing.get_context(method)
    augment = RelightAugment(folder, lights="random", p=1, seed=5)
    augment.prepare()
    augment(image)  # what was used before a fork must work after it
    augment.set_epoch(0)
    results = context.Queue()
    workers = [
        context.Process(target=_work, args=(augment, image, marks, one, results)) for one in (0, 1, None)
    ]
    for worker in workers:
        worker.start()
    found = {worker: (sums, last) for worker, sums, last in (results.get(timeout=120) for _ in workers)}
    for worker in workers:
        worker.join(60)
        assert worker.exitcode == 0
    for worker, (sums, last) in found.items():
        expected = [augment.draw(number, worker=worker) for number in range(4)]
        # The same light by its options, given to the main process.
        made = [_relit(augment, draw, image, marks).sum() for draw in expected]
        assert [*sums, last] == made
    assert len({tuple(sums) for sums, _ in found.values()}) == 3


def _relit(augment, draw, image, marks):
    light = None if draw.reference is None else relit.read_image(augment.references[draw.reference])
    return relit.transfer(image, light, target_landmarks=marks, options=draw.options).image


@pytest.mark.parametrize("seed", [None, 5])
def test_workers_follow_the_seed_that_torch_gives_them_until_an_epoch_is_set(image, marks, monkeypatch, seed):
    augment = RelightAugment(p=1, seed=seed, detail=10)

    def lights_with(**info):
        told = SimpleNamespace(get_worker_info=lambda: SimpleNamespace(**info, num_workers=2))
        monkeypatch.setitem(sys.modules, "torch.utils.data", told)
        again = copy.deepcopy(augment)
        return [again(image, landmarks=marks).sum() for _ in range(3)]

    same, epoch, worker = lights_with(id=0, seed=9), lights_with(id=0, seed=10), lights_with(id=1, seed=9)
    assert same == lights_with(id=0, seed=9)
    assert same != epoch != worker != same
    augment.set_epoch(0)
    assert (lights_with(id=0, seed=9) == lights_with(id=0, seed=10)) == (seed is not None)


# Kinds of images


@settings(max_examples=25)
@given(
    dtype=st.sampled_from([np.uint8, np.uint16, np.float32, np.float64]),
    colour=st.booleans(),
    scale=st.floats(0.3, 1.5),
    margins=st.tuples(st.integers(0, 30), st.integers(0, 30)),
    number=st.integers(0, 99),
    level=st.floats(0, 1),
)
def test_shape_dtype_and_range_are_kept(dtype, colour, scale, margins, number, level):
    rng = np.random.default_rng(number)
    shape = (int(120 * scale) + margins[0], int(120 * scale) + margins[1])
    target = from_unit(level * rng.random((*shape, 3) if colour else shape), dtype)
    light = rng.integers(0, 256, (130, 120, 3), np.uint8)
    face = [[35, 50], [45, 50], [75, 50], [85, 50], [60, 70], [48, 90], [72, 90], [60, 110]]
    augment = RelightAugment([light], reference_landmarks=[face], lights="random", p=1, seed=0)
    before = target.copy()
    made = augment(target, landmarks=np.multiply(face, scale), number=number)
    assert made.shape == target.shape
    assert made.dtype == dtype
    np.testing.assert_array_equal(target, before)
    if np.dtype(dtype).kind == "f":
        assert made.min() >= 0
        assert made.max() <= 1


@pytest.mark.parametrize("mode", ["L", "RGB", "LA", "RGBA", "I;16"])
def test_pil_images_come_back_as_they_went_in(image, marks, mode):
    if mode == "I;16":
        picture = Image.fromarray((image[..., 1].astype(np.uint16) << 8) + 9)
    else:
        picture = Image.fromarray(image).convert(mode)
    if "A" in mode:
        picture.putalpha(Image.linear_gradient("L").resize(picture.size))
    picture.info["comment"] = "kept"
    augment = RelightAugment(p=1, seed=0, strength=1)
    made = augment(picture, landmarks=marks)
    assert (made.mode, made.size, made.info) == (picture.mode, picture.size, picture.info)
    if "A" in mode:
        np.testing.assert_array_equal(made.getchannel("A"), picture.getchannel("A"))
        made, picture = (one.convert(mode.removesuffix("A")) for one in (made, picture))
    expected = augment(np.asarray(picture), landmarks=marks, number=0)
    np.testing.assert_array_equal(np.asarray(made), expected)


@pytest.mark.parametrize("planes", [1, 2, 4])
def test_arrays_keep_their_alpha_and_their_only_channel(image, marks, planes):
    alpha = np.arange(image[..., 0].size).reshape(image.shape[:2]) % 256
    array = {1: image[..., 1:2], 2: np.dstack([image[..., 1], alpha]), 4: np.dstack([image, alpha])}[planes]
    array = array.astype(np.uint8)
    augment = RelightAugment(p=1, seed=0)
    made = augment(array, landmarks=marks)
    assert (made.shape, made.dtype) == (array.shape, array.dtype)
    if planes > 1:
        np.testing.assert_array_equal(made[..., -1], alpha)
    plain = augment(array[..., :3] if planes == 4 else array[..., 0], landmarks=marks, number=0)
    np.testing.assert_array_equal(made[..., :3] if planes == 4 else made[..., 0], plain)


@pytest.mark.parametrize("grey", [False, True])
def test_light_comes_in_the_colours_of_the_photo(image, marks, grey):
    profile = bytes(
        imagecodecs.cms_profile("gray", gamma=1.0) if grey else imagecodecs.cms_profile("adobergb")
    )
    photo = relit.Photo(image[..., 1] if grey else image, profile=profile)
    reference = relit.read_image(relit.sample("reference"))
    assert reference.profile
    augment = RelightAugment(reference, p=1, seed=0)
    made = augment(photo, landmarks=marks)
    assert made.profile == profile
    faces = {"target_landmarks": marks, "reference_landmarks": relit.detect_landmarks(reference.pixels)}
    if grey:
        reference = relit.Photo(from_unit(luma(to_unit(reference.to_profile(None).pixels)), np.uint8))
    expected = relit.transfer(photo, reference, **faces, options=augment.draw(0).options)
    np.testing.assert_array_equal(made.pixels, expected.image)
    picture = Image.fromarray(photo.pixels)
    picture.info["icc_profile"] = profile
    np.testing.assert_array_equal(augment(picture, landmarks=marks, number=0), expected.image)


def test_a_photo_keeps_what_travels_with_it(image, marks):
    photo = relit.Photo(image, alpha=np.full(image.shape[:2], 7, np.uint8), format="PNG")
    made = RelightAugment(p=1, seed=0)(photo, landmarks=marks)
    assert (made.alpha is photo.alpha, made.format) == (True, "PNG")
    np.testing.assert_array_equal(made.pixels, RelightAugment(p=1, seed=0)(image, landmarks=marks))


# Samples

Pair = namedtuple("Pair", "image label")
BOXES = np.array([[10.0, 20, 60, 90]])


@pytest.mark.parametrize(
    ("sample_of", "place"),
    [
        (lambda image: (image, 3), (0,)),
        (lambda image: [{"id": "a"}, BOXES, {"image": image, "mask": image[..., 0] > 9}], (2, "image")),
        (lambda image: Pair(image, 3), (0,)),
        (lambda image: {"mask": image[..., 0], "image": Image.fromarray(image)}, ("image",)),
        (lambda image: {"boxes": BOXES, "views": [image, image.copy()]}, ("views", 0)),
        (lambda image: {"mask": image[..., :1], "image": image}, ("image",)),
    ],
)
def test_the_image_in_a_sample_is_relit_and_all_else_passed_through(image, marks, sample_of, place):
    sample = sample_of(image)
    before = copy.deepcopy(sample)
    augment = RelightAugment(p=1, seed=0)
    made = augment(sample, landmarks=marks)
    assert type(made) is type(sample)
    old, new = dict(_leaves(sample)), dict(_leaves(made))
    assert list(old) == list(new)
    assert {where for where in old if old[where] is not new[where]} == {place}
    expected = augment(image, landmarks=marks, number=0)
    np.testing.assert_array_equal(np.asarray(new[place]), expected)
    for where, leaf in _leaves(before):
        np.testing.assert_array_equal(old[where], leaf)


def _leaves(sample, place=()):
    if isinstance(sample, dict | list | tuple):
        for key, part in sample.items() if isinstance(sample, dict) else enumerate(sample):
            yield from _leaves(part, (*place, key))
    else:
        yield place, sample


def test_several_arguments_come_back_as_a_tuple(image, marks):
    augment = RelightAugment(p=1, seed=0)
    made, label = augment(image, "smile", landmarks=marks)
    assert label == "smile"
    np.testing.assert_array_equal(made, augment(image, landmarks=marks, number=0))
    assert RelightAugment(p=0)(image, 1) == (image, 1)


def test_lamps_may_be_given_by_their_angles():
    assert {draw.options.light for draw in draws(RelightAugment(lights=(-30, 20)))} == {"-30,20"}
    augment = RelightAugment(lights=[(-30, 20.5), "loop"], seed=0)
    assert {draw.options.light for draw in draws(augment, 30)} == {"-30,20.5", "loop"}


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
