"""What is kept on disk: always what the step would have given, whatever becomes of the files."""

from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from relit.batch import cache
from relit.batch.cache import DiskCache
from relit.errors import FaceNotFoundError, ImageError, OptionError, OutputError
from relit.face import detect
from relit.ltv import decomposition as ltv
from relit.photo.reading import read_image
from relit.photo.resampling import reduced
from relit.photo.samples import sample
from relit.runtime.threads import pool
from tests.batch.caches import LARGE, counted, entries, equal, held, in_python, picture


@pytest.fixture
def calls(monkeypatch):
    """The splits and searches that are really made."""
    return counted(monkeypatch, (ltv, "_large_scale"), (detect, "_views"))


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


def test_threads_at_once_compute_each_result_once(tmp_path, calls):
    with DiskCache(tmp_path, LARGE).open(), pool(4) as run:
        splits = run(ltv.decompose, [picture(0, (60, 60))] * 4)
    assert len(calls) == 1
    for split in splits:
        equal(split, splits[0])


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
                from tests.batch.caches import picture
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
            from tests.batch.caches import picture
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
