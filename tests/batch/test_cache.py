"""What is kept on disk: always what the step would have given, whatever becomes of the files."""

import os
import signal
import subprocess
import sys
import textwrap
import time
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image

from relit.batch import cache
from relit.batch.cache import DiskCache
from relit.errors import FaceNotFoundError, ImageError, OptionError, OutputError
from relit.face import detect
from relit.ltv import decomposition as ltv
from relit.methods import lit_face
from relit.photo.reading import read_image
from relit.photo.resampling import reduced
from relit.photo.samples import sample
from relit.relighting import transfer
from relit.runtime.threads import pool
from relit.settings.options import TransferOptions

LARGE = 10_000_000


def picture(seed, shape=(16, 16)):
    return np.random.default_rng(seed).integers(0, 256, shape).astype(np.uint8)


def entries(folder):
    return sorted(folder.rglob("*.npz"))


def held(folder):
    return sum(path.stat().st_size for path in entries(folder))


@pytest.fixture
def calls(monkeypatch):
    """The splits and searches that are really made."""
    made = []

    def count(module, name):
        step = getattr(module, name)
        monkeypatch.setattr(module, name, lambda *given: (made.append(name), step(*given))[1])

    count(ltv, "_large_scale")
    count(detect, "_views")
    return made


def equal(one, other):
    assert type(one) is type(other)
    for name, part in vars(one).items():
        there = getattr(other, name)
        assert type(part) is type(there), name
        if isinstance(part, np.ndarray):
            assert (part.dtype, part.flags.writeable) == (there.dtype, there.flags.writeable), name
        np.testing.assert_array_equal(part, there)


@given(
    image=st.integers(0, 99).map(picture) | st.integers(0, 99).map(lambda seed: picture(seed, (9, 12, 3))),
    depth=st.sampled_from([np.uint8, np.uint16, np.float32, np.float64]),
    lam=st.sampled_from([0.2, 1, np.float32(0.7)]),
    neighborhood=st.sampled_from([4, 8, 16]),
    distance=st.floats(20, 500),
)
@settings(max_examples=40)
def test_splits_come_back_bit_by_bit(tmp_path_factory, image, depth, lam, neighborhood, distance):
    image = image / 255 if np.dtype(depth).kind == "f" else image
    given = {"lam": lam, "neighborhood": neighborhood, "interocular_distance": distance}
    kept = DiskCache(tmp_path_factory.mktemp("cache"), LARGE)
    alone = ltv.decompose(image.astype(depth), **given)
    for _ in range(2):
        with kept.open():
            equal(ltv.decompose(image.astype(depth), **given), alone)


def test_faces_come_back_bit_by_bit_and_are_found_once(tmp_path, calls):
    photo = reduced(read_image(sample("target")).pixels, 2)
    alone = detect.detect_faces(photo)
    del calls[:]
    for name in ("target", "reference"):
        with DiskCache(tmp_path, LARGE).open():
            (face,) = detect.detect_faces(photo, name=name)
        equal(face, alone[0])
    assert calls == ["_views"]


def test_a_photo_without_a_face_is_searched_once(tmp_path, calls):
    for name in ("target", "reference", "target"):
        with (
            DiskCache(tmp_path, LARGE).open(),
            pytest.raises(FaceNotFoundError, match=f"^{name}: no face found"),
        ):
            detect.detect_landmarks(np.full((32, 32), 9, np.uint8), name=name)
    assert calls == ["_views"]


def test_errors_are_raised_every_time(tmp_path):
    for _ in range(2):
        with DiskCache(tmp_path, LARGE).open(), pytest.raises(ImageError):
            ltv.decompose(np.zeros((3, 3, 3, 3), np.uint8))
    assert not entries(tmp_path)


def test_work_is_called_off_before_computing_and_not_before_reading(tmp_path, calls):
    def stop():
        raise InterruptedError

    kept = DiskCache(tmp_path, LARGE)
    with kept.open():
        ltv.decompose(picture(0))
    with kept.open(stop):
        ltv.decompose(picture(0))
        with pytest.raises(InterruptedError):
            ltv.decompose(picture(1))
    assert len(calls) == 1


@pytest.mark.parametrize(
    "change",
    [
        {"lam": 0.3},
        {"neighborhood": 8},
        {"interocular_distance": 99.0},
        {"image": picture(1)},
        {"image": picture(0).astype(np.uint16) * 257},
        {"image": picture(0).T.copy()},
        {"image": picture(0).reshape(8, 32)},
    ],
)
def test_what_differs_has_an_entry_of_its_own(tmp_path, change, calls):
    with DiskCache(tmp_path, LARGE).open():
        for given in ({"image": picture(0)}, {"image": picture(0)} | change):
            ltv.decompose(**given)
    assert len(calls) == len(entries(tmp_path)) == 2


def test_other_code_has_entries_of_its_own(tmp_path, calls, monkeypatch):
    monkeypatch.setattr(cache, "_makers", cache._makers.__wrapped__)
    with DiskCache(tmp_path, LARGE).open():
        ltv.decompose(picture(0))
        ltv.decompose(picture(0))
        monkeypatch.setattr("relit.__version__", "0.0.0")
        ltv.decompose(picture(0))
        monkeypatch.setattr(cache, "versions", lambda: {"numpy": "of tomorrow"})
        ltv.decompose(picture(0))
    assert len(calls) == 3


SPLIT = 16 + 2 * (16 * 16 * 4)  # bytes of the arrays of an entry, at least


@given(
    wanted=st.lists(
        st.tuples(st.integers(0, 5), st.sampled_from([8, 16]), st.booleans()), min_size=10, max_size=40
    ),
    most=st.sampled_from([0, 1000, 5000]) | st.integers(5_000, 25_000),
)
@settings(max_examples=40)
def test_they_hold_no_more_than_they_may_and_what_was_asked_for_last_stays(tmp_path_factory, wanted, most):
    """Against a list: an entry stays if it was asked for later than one that stays."""
    folder = tmp_path_factory.mktemp("cache")
    names, recent = {}, []  # what was asked for → its entry; entries, the one asked for last at the end
    for seed, side, again in wanted:
        before = set(entries(folder))
        with DiskCache(folder, most).open():  # again and again, as by other processes
            for _ in range(1 + again):
                ltv.decompose(picture(seed, (side, side)))
        after = set(entries(folder))
        assert held(folder) <= most
        for path in after - before:
            names[seed, side] = path
        asked = names.get((seed, side))
        assert asked in after or asked is None
        recent = [path for path in recent if path != asked] + [asked] * (asked is not None)
        stays = [path in after for path in recent]
        assert stays == sorted(stays), "an entry went before an older one"
        recent = [path for path in recent if path in after]
        assert set(recent) == after


def test_the_next_largest_share_is_used(tmp_path):
    """A cap that cuts everything down to nothing would hold as well."""
    with DiskCache(tmp_path, 100_000).open():
        for seed in range(100):
            ltv.decompose(picture(seed, (20, 20)))
            if seed > 30:
                assert 80_000 < held(tmp_path) <= 100_000


def test_what_is_too_large_is_given_but_not_kept(tmp_path, calls):
    with DiskCache(tmp_path, SPLIT).open():
        ltv.decompose(picture(0))
        ltv.decompose(picture(0))
    assert len(calls) == 2
    assert not entries(tmp_path)


@given(data=st.data())
@settings(max_examples=60)
def test_a_damaged_entry_is_computed_again(tmp_path_factory, data):
    folder = tmp_path_factory.mktemp("cache")
    alone = ltv.decompose(picture(0))
    with DiskCache(folder, LARGE).open():
        ltv.decompose(picture(0))
    (path,) = entries(folder)
    whole = path.read_bytes()
    match data.draw(st.sampled_from(["cut", "flip", "other", "longer", "zeros"])):
        case "cut":
            path.write_bytes(whole[: data.draw(st.integers(0, len(whole) - 1))])
        case "flip":
            at = data.draw(st.integers(0, len(whole) - 1))
            bit = 1 << data.draw(st.integers(0, 7))
            path.write_bytes(whole[:at] + bytes([whole[at] ^ bit]) + whole[at + 1 :])
        case "other":
            path.write_bytes(data.draw(st.binary(max_size=100)))
        case "longer":
            path.write_bytes(whole + data.draw(st.binary(min_size=1, max_size=9)))
        case "zeros":
            path.write_bytes(bytes(len(whole)))
    with DiskCache(folder, LARGE).open():
        equal(ltv.decompose(picture(0)), alone)
    assert path.read_bytes() == whole, "it was put right"


@pytest.mark.parametrize("ledger", ["", "12", "x" * 20, "٣" * 20, "9" * 20])
def test_a_damaged_ledger_is_written_anew(tmp_path, ledger):
    kept = DiskCache(tmp_path, 20_000)
    with kept.open():
        for seed in range(20):
            (tmp_path / "relit-cache" / "ledger").write_text(ledger, "utf-8")
            ltv.decompose(picture(seed))
            assert SPLIT < held(tmp_path) <= 20_000
            assert int((tmp_path / "relit-cache" / "ledger").read_text()) == held(tmp_path)


def test_nothing_else_in_the_folder_is_touched(tmp_path):
    mine = [tmp_path / name for name in ("face.npz", ".relit-0123.tmp", "ledger")]
    for path in mine:
        path.write_text("mine")
    with DiskCache(tmp_path, 8000).open():
        for seed in range(9):
            ltv.decompose(picture(seed))
    assert [path.read_text() for path in mine] == ["mine"] * 3


@pytest.mark.parametrize("most", [-1, 1.5, True, "1 GB", None])
def test_a_size_that_is_none_is_refused(tmp_path, most):
    with pytest.raises(OptionError, match="most_bytes: expected an integer of 0 or more, got"):
        DiskCache(tmp_path, most)


def test_a_file_in_its_place_is_refused(tmp_path):
    (tmp_path / "photo").write_text("mine")
    for place in (tmp_path / "photo", tmp_path / "photo" / "cache"):
        with pytest.raises(
            OutputError, match=r"photo.*: is no folder, and cannot hold a cache; name another"
        ):
            DiskCache(place, LARGE)
    assert (tmp_path / "photo").read_text() == "mine"


class TestWithoutAPlace:
    """Nothing can be written: computing goes on, and says so once."""

    WARNING = r"cannot keep results \(.*\), and goes on without; free some space, or choose another folder"

    def test_a_folder_that_cannot_be_made(self, calls):
        if not Path("/proc/self").exists():
            pytest.skip("there is no /proc")
        with (
            pytest.warns(RuntimeWarning, match=self.WARNING) as warned,
            DiskCache(Path("/proc/no-such-place"), LARGE).open(),
        ):
            [ltv.decompose(picture(0)) for _ in range(2)]
        assert len(calls) == 2
        assert len(warned) == 1

    def test_a_folder_that_can_only_be_read(self):
        """What is in it is used; where root runs the tests, by nobody, whom permissions concern."""
        with TemporaryDirectory() as temporary:
            folder = Path(temporary, "cache")
            with DiskCache(folder, LARGE).open():
                alone = ltv.decompose(picture(0))
            code = f"""
                import os, warnings
                from pathlib import Path
                from relit.ltv import decomposition as ltv
                from relit.batch.cache import DiskCache
                from tests.batch.test_cache import picture
                warnings.simplefilter("always")
                with DiskCache(Path({temporary!r}, "other"), {LARGE}).open():
                    for _ in range(2):  # so that all is imported that nobody may read
                        ltv.decompose(picture(3))
                if os.getuid() == 0:
                    os.setuid(65534)
                done = []
                solve, ltv._large_scale = ltv._large_scale, lambda *given: (done.append(1), solve(*given))[1]
                with DiskCache(Path({str(folder)!r}), {LARGE}).open():
                    print(ltv.decompose(picture(0)).u.tobytes().hex(), len(done))
                    ltv.decompose(picture(1))
                    print(len(done))
            """
            before = entries(folder)
            for path in (folder / "relit-cache", folder, Path(temporary)):
                path.chmod(0o755 if path == Path(temporary) else 0o555)
            told, errors = in_python(code)
            for path in (folder, folder / "relit-cache"):
                path.chmod(0o755)
            assert told.split() == [alone.u.tobytes().hex(), "0", "1"]
            assert errors.count("cannot keep results (Permission denied)") == 1
            assert entries(folder) == before

    def test_a_full_disk(self, tmp_path):
        """Files may not grow beyond some size, as if there were no more room."""
        pytest.importorskip("resource")
        code = f"""
            import resource, warnings
            from pathlib import Path
            from relit.ltv import decomposition as ltv
            from relit.batch.cache import DiskCache
            from tests.batch.test_cache import picture
            warnings.simplefilter("always")
            with DiskCache(Path({str(tmp_path)!r}), {LARGE}).open():
                ltv.decompose(picture(0))
                resource.setrlimit(resource.RLIMIT_FSIZE, (1000, 1000))
                for _ in range(2):
                    print(ltv.decompose(picture(1)).u.tobytes().hex())
        """
        told, errors = in_python(code)
        assert told.split() == [ltv.decompose(picture(1)).u.tobytes().hex()] * 2
        assert errors.count("cannot keep results (File too large)") == 1
        assert len(entries(tmp_path)) == 1
        assert not list(tmp_path.rglob("*.tmp"))


def python(code):
    here = Path(__file__).parents[2]
    paths = os.pathsep.join([str(here), str(here / "src"), os.environ.get("PYTHONPATH", "")])
    return subprocess.Popen(
        [sys.executable, "-c", textwrap.dedent(code)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, "PYTHONPATH": paths},
    )


def in_python(code):
    process = python(code)
    told, errors = process.communicate(timeout=300)
    assert process.returncode == 0, errors
    return told, errors


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
    from tests.batch.test_cache import picture
    with DiskCache(Path({folder!r}), 10_000_000).open():
        for seed in range(12):
            print(ltv.decompose(picture(seed, (60, 60))).u.tobytes().hex())
    """
    )
    several = [python(code.format(folder=str(tmp_path))) for _ in range(3)]
    told = [process.communicate(timeout=300) for process in several]
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
    from tests.batch.test_cache import picture
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
    for process in several:
        assert process.wait() == 0, process.communicate()[1]
        process.communicate()
    assert 40_000 < most <= 60_000 + 3000  # a listing is not of one moment
    assert 40_000 < held(tmp_path) <= 60_000


def test_threads_at_once_compute_each_result_once(tmp_path, calls):
    with DiskCache(tmp_path, LARGE).open(), pool(4) as run:
        splits = run(ltv.decompose, [picture(0, (60, 60))] * 4)
    assert len(calls) == 1
    for split in splits:
        equal(split, splits[0])


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
    from tests.batch.test_cache import picture

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
    _, errors = process.communicate(timeout=300)
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
    from tests.batch.test_cache import picture
    print("ready", flush=True)
    with DiskCache(Path({folder!r}), 60_000).open():
        while True:
            for seed in range(60):
                ltv.decompose(picture(seed))
    """
    rng = np.random.default_rng()
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
