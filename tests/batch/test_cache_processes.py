"""What is kept on disk, shared: processes that meet there or are killed, pairs of the same photos."""

import signal
import time

import numpy as np
import pytest
from PIL import Image

from relit.batch import cache
from relit.batch.cache import DiskCache
from relit.ltv import decomposition as ltv
from relit.methods import lit_face
from relit.photo.reading import read_image
from relit.photo.resampling import reduced
from relit.photo.samples import sample
from relit.relighting import transfer
from relit.settings.options import TransferOptions
from tests.batch.caches import LARGE, entries, equal, held, picture, python

COUNTING = """
    import os, sys
    from pathlib import Path
    from relit.face import detect
    from relit.ltv import decomposition as ltv
    from relit.batch.cache import DiskCache

    def counted(module, name):
        step = getattr(module, name)
        def one_more(*given):
            with open({folder!r} + "/calls", "a") as calls:
                calls.write(name + "\\n")
            return step(*given)
        setattr(module, name, one_more)

    counted(ltv, "_large_scale")
    counted(detect, "_views")
"""


@pytest.mark.slow
def test_processes_at_once_compute_each_result_once(tmp_path):
    """Each asks for the same splits, in the same order, so that they always meet."""
    code = (
        COUNTING
        + """
    from tests.batch.caches import picture
    with DiskCache(Path({folder!r}), 10_000_000).open():
        for seed in range(12):
            print(ltv.decompose(picture(seed, (60, 60))).u.tobytes().hex())
    """
    )
    several = [python(code.format(folder=str(tmp_path))) for _ in range(3)]
    told = [process.communicate(timeout=600) for process in several]
    alone = [ltv.decompose(picture(seed, (60, 60))).u.tobytes().hex() for seed in range(12)]
    for process, (said, errors) in zip(several, told, strict=True):
        assert process.returncode == 0, errors
        assert said.split() == alone
    assert (tmp_path / "calls").read_text().split() == ["_large_scale"] * 12


@pytest.mark.slow
def test_processes_at_once_keep_the_size(tmp_path):
    code = """
    import sys
    from pathlib import Path
    from relit.ltv import decomposition as ltv
    from relit.batch.cache import DiskCache
    from tests.batch.caches import picture
    with DiskCache(Path({folder!r}), 60_000).open():
        for seed in range({first}, {first} + 150):
            ltv.decompose(picture(seed))
    """
    several = [python(code.format(folder=str(tmp_path), first=100 * k)) for k in range(3)]
    most = 0
    while any(process.poll() is None for process in several):
        sizes = []
        for path in entries(tmp_path):
            try:
                sizes.append(path.stat().st_size)
            except FileNotFoundError:
                continue
        most = max(most, sum(sizes))
        time.sleep(0.002)
    most = max(most, held(tmp_path))  # where this process did not have its turn meanwhile
    for process in several:
        assert process.wait() == 0, process.communicate()[1]
        process.communicate()
    assert 40_000 < most <= 60_000 + 3000  # a listing is not of one moment
    assert 40_000 < held(tmp_path) <= 60_000


@pytest.mark.slow
@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="there is no kill -9")
@pytest.mark.parametrize("moment", ["computing", "writing", "shrinking"])
def test_a_process_killed_at_any_point_leaves_the_cache_usable(tmp_path, moment):
    code = """
    import os, signal
    from pathlib import Path
    from relit.photo import atomic_files as files
    from relit.ltv import decomposition as ltv
    from relit.batch import cache
    from tests.batch.caches import picture

    kept = cache.DiskCache(Path({folder!r}), 20_000)
    with kept.open():
        for seed in range(8):
            ltv.decompose(picture(seed))
        def die(*given):
            os.kill(os.getpid(), signal.SIGKILL)
        if {moment!r} == "computing":
            ltv._large_scale = die
        elif {moment!r} == "writing":
            files.os.fsync = die  # the file is written, and has not got its name
        else:
            cache.DiskCache._shrink = die
        for seed in range(8, 20):
            ltv.decompose(picture(seed))
    """
    process = python(code.format(folder=str(tmp_path), moment=moment))
    _, errors = process.communicate(timeout=600)
    assert process.returncode == -signal.SIGKILL, errors
    before = time.monotonic()
    with DiskCache(tmp_path, 20_000).open():
        for seed in range(20):
            equal(ltv.decompose(picture(seed)), ltv.decompose.__wrapped__(picture(seed)))
            assert held(tmp_path) <= 20_000
    assert time.monotonic() - before < cache._PATIENCE / 2, "it waited for the dead"
    assert not list(tmp_path.rglob("*.tmp"))


@pytest.mark.slow
@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="there is no kill -9")
def test_processes_killed_at_random_leave_only_what_is_right(tmp_path):
    code = """
    from pathlib import Path
    from relit.ltv import decomposition as ltv
    from relit.batch.cache import DiskCache
    from tests.batch.caches import picture
    print("ready", flush=True)
    with DiskCache(Path({folder!r}), 60_000).open():
        while True:
            for seed in range(60):
                ltv.decompose(picture(seed))
    """
    rng = np.random.default_rng(6)
    for _ in range(6):
        process = python(code.format(folder=str(tmp_path)))
        assert process.stdout.readline() == "ready\n"
        time.sleep(rng.uniform(0, 0.5))
        process.kill()
        process.communicate()
        assert held(tmp_path) <= 60_000
    with DiskCache(tmp_path, 60_000).open():
        for seed in range(60):
            equal(ltv.decompose(picture(seed)), ltv.decompose.__wrapped__(picture(seed)))


@pytest.fixture(scope="module")
def faces(tmp_path_factory):
    """Seven photos of a face, all different."""
    folder = tmp_path_factory.mktemp("faces")
    for k in range(7):
        photo = reduced(read_image(sample("target" if k % 2 else "reference")).pixels, 4)
        photo = (photo // 257).astype(np.uint8) if photo.dtype == np.uint16 else photo
        Image.fromarray(np.roll(photo, 3 * k, axis=1)).save(folder / f"{k}.png")
    return folder


@pytest.mark.slow
def test_pairs_cost_a_split_and_a_search_for_each_photo(tmp_path, faces):
    """3 targets by 4 references by two processes: 7, not 24; and the results are those without."""
    code = (
        COUNTING
        + """
    from relit.photo.reading import read_image
    from relit.relighting import transfer
    turn = int({turn})
    with DiskCache(Path({folder!r}), 1_000_000_000).open():
        for target in range(3):
            for reference in range(3 + turn, 7, 2):
                pair = (read_image(Path({faces!r}, f"{{k}}.png")) for k in (target, reference))
                image = transfer(*pair, method="ltv", split_first=True).image
                Path({folder!r}, f"{{target}}-{{reference}}").write_bytes(image.tobytes())
    """
    )
    several = [python(code.format(folder=str(tmp_path), faces=str(faces), turn=turn)) for turn in range(2)]
    for process in several:
        _, errors = process.communicate(timeout=600)
        assert process.returncode == 0, errors
    calls = (tmp_path / "calls").read_text().split()
    assert calls.count("_views") == 7
    assert calls.count("_large_scale") == 7 * 3  # three planes each
    for target, reference in ((0, 3), (2, 6)):
        pair = [read_image(faces / f"{k}.png") for k in (target, reference)]
        alone = transfer(*pair, options=TransferOptions(method="ltv", split_first=True))
        assert (tmp_path / f"{target}-{reference}").read_bytes() == alone.image.tobytes()


def test_what_is_said_of_a_target_is_said_once_for_all_its_references(tmp_path, faces, monkeypatch):
    made, colored = [], lit_face._colored
    monkeypatch.setattr(lit_face, "_colored", lambda *given: (made.append(given), colored(*given))[1])
    target, *others = (read_image(faces / f"{k}.png") for k in (0, 1, 3, 4))
    found = []
    with DiskCache(tmp_path, LARGE).open():
        found += [transfer(target, reference).image for reference in others]
    # Every photo is explained once.
    assert len(made) == 1 + 3
    for image, reference in zip(found, others, strict=True):
        np.testing.assert_array_equal(image, transfer(target, reference).image)
    assert len(made) == 1 + 3 + 3 * 2
