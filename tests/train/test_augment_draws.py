"""What the augmentation draws, and that copies and workers draw what they should."""

import copy
import multiprocessing
import pickle
import sys
from collections import Counter
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.stats import binomtest, kstest

import relit
from relit.train import reference_pool
from relit.train.augment import RelightAugment

NO_FACE = np.full((40, 40, 3), 90, np.uint8)


def draws(augment, count=12, **where):
    return [augment.draw(number, **where) for number in range(count)]


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


def test_a_skipped_image_comes_back_itself(image):
    augment = RelightAugment(p=0, seed=0)
    assert augment(image) is image
    sample = (image, 1)
    assert augment(sample) is sample
    assert not any(draw.applied for draw in draws(augment))
    assert all(draw.applied for draw in draws(RelightAugment(p=1, seed=0)))


def test_lamps_may_be_given_by_their_angles():
    assert {draw.options.light for draw in draws(RelightAugment(lights=(-30, 20)))} == {"-30,20"}
    augment = RelightAugment(lights=[(-30, 20.5), "loop"], seed=0)
    assert {draw.options.light for draw in draws(augment, 30)} == {"-30,20.5", "loop"}


# Copies and workers


@pytest.mark.parametrize("again", [copy.deepcopy, lambda augment: pickle.loads(pickle.dumps(augment))])
@pytest.mark.rotating
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


@pytest.mark.rotating
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
    found = {worker: (sums, last) for worker, sums, last in (results.get(timeout=600) for _ in workers)}
    for worker in workers:
        worker.join(300)
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
