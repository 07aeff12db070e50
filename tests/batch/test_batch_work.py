"""One row of a batch: what it writes is what the library gives; what fails says why and leaves nothing."""

import hashlib
import os
import shutil

import numpy as np
import pytest
from PIL import Image

from relit.batch import kinds, places
from relit.batch.jobs import Job, Plan
from relit.batch.work import do, recipe_of
from relit.face.detect import detect_landmarks
from relit.face.landmark_files import read_landmarks
from relit.figures import split_pictures
from relit.ltv.decomposition import decompose, normalize
from relit.settings.options import TransferOptions
from tests.command import in_library, listing, pixels_of

KINDS = ("transfer", "normalize", "decompose", "landmarks")
MARKS = {"target_landmarks": "target.csv", "reference_landmarks": "reference.csv"}


def job(output="out.png", target="target.png", reference="reference.png", **changes):
    marks = {name: changes.pop(name, path) for name, path in MARKS.items()}
    return Job(target, reference, output, **marks, options=TransferOptions(**changes))


def alone(output, **changes):
    return job(output, reference=None, reference_landmarks=None, **changes)


@pytest.mark.usefixtures("place")
class TestWhatIsWritten:
    def test_transfer(self, studio):
        outcome = do(job(strength=0.5), Plan("transfer", "out"))
        result = in_library(studio, strength=0.5)
        assert (outcome.reason, outcome.output) == ("", "out.png")
        np.testing.assert_array_equal(pixels_of("out/out.png"), result.image)
        assert outcome.measured["folded"] == pytest.approx(result.first.alignment.folded, abs=1e-6)
        by_hand = np.average(np.abs(result.change).mean(axis=2), weights=result.mask)
        assert outcome.measured["change"] == pytest.approx(by_hand, abs=1e-5)
        assert not [name for name in outcome.measured if name.endswith("confidence")]

    def test_it_is_the_file_that_the_command_writes(self, succeed, place):
        succeed("transfer target.png reference.png -o command.png")
        photos = {"target_landmarks": None, "reference_landmarks": None}
        outcome = do(job(**photos), Plan("transfer", "out"))
        assert (place / "out/out.png").read_bytes() == (place / "command.png").read_bytes()
        assert outcome.measured["target_confidence"] > 0.5
        assert outcome.measured["reference_confidence"] > 0.5

    def test_a_light_by_name_takes_no_reference(self, studio):
        assert do(alone("out.png", light="rim"), Plan("transfer", "out")).reason == ""
        assert (pixels_of("out/out.png") != studio.target).any()

    def test_normalize(self, studio):
        assert do(alone("out.png"), Plan("normalize", "out")).reason == ""
        distance = studio.target_landmarks.interocular_distance
        v = normalize(studio.target, 0.2, interocular_distance=distance)
        np.testing.assert_array_equal(pixels_of("out/out.png"), (v * 255).round())

    def test_decompose(self, studio):
        assert do(alone("deep/out", lam=0.5), Plan("decompose", "out")).reason == ""
        distance = studio.target_landmarks.interocular_distance
        for name, picture in zip(
            "uv", split_pictures(decompose(studio.target, 0.5, interocular_distance=distance)), strict=True
        ):
            np.testing.assert_array_equal(pixels_of(f"out/deep/out/{name}.png"), picture)

    def test_landmarks(self, studio):
        outcome = do(alone("out.json", target_landmarks=None), Plan("landmarks", "out"))
        found = detect_landmarks(studio.target)
        np.testing.assert_array_equal(read_landmarks("out/out.json").points, found.points)
        assert outcome.measured["target_confidence"] == found.confidence

    def test_what_was_read_and_written_is_told_by_its_digest(self, place):
        outcome = do(job(), Plan("transfer", "out"))
        names = ["target.png", "target.csv", "reference.png", "reference.csv"]
        for file, name in zip([*outcome.inputs, *outcome.files], [*names, "out/out.png"], strict=True):
            data = (place / name).read_bytes()
            assert file.digest == hashlib.sha256(data).hexdigest()
            state = (place / name).stat()
            assert file.version == f"{len(data)} {state.st_mtime_ns} {state.st_ctime_ns}"

    def test_each_photo_is_read_once(self, monkeypatch):
        read, once = [], places.read_bytes
        monkeypatch.setattr(places, "read_bytes", lambda place: read.append(place) or once(place))
        assert do(job(), Plan("transfer", "out")).reason == ""
        assert sorted(read) == sorted(["target.png", "reference.png", *MARKS.values()])


class TestRecipe:
    def test_all_that_counts_counts(self):
        base = job()
        digests = ["a", "b", "c", "d"]
        others = [
            recipe_of(job(strength=0.5), "transfer", digests),
            recipe_of(job("out.tif"), "transfer", digests),
            recipe_of(base, "transfer", ["a", "b", "d", "c"]),
            recipe_of(base, "normalize", digests),
            recipe_of(job(target_landmarks=None), "transfer", digests[:3]),
            recipe_of(job(reference_landmarks=None), "transfer", digests[:3]),
            recipe_of(base, "transfer", digests),
        ]
        assert len(set(others)) == len(others)

    def test_what_does_not_count_does_not(self):
        digests = ["a", "b"]
        one = recipe_of(alone("x/out.png"), "normalize", digests)
        assert one == recipe_of(alone("out.PNG", target="elsewhere.png"), "normalize", digests)
        assert one == recipe_of(alone("out.png", strength=0.5), "normalize", digests)
        assert one != recipe_of(alone("out.png", lam=0.5), "normalize", digests)


@pytest.mark.usefixtures("place")
class TestAgain:
    def test_what_was_done_stays_even_where_its_photos_were_copied(self, place, monkeypatch):
        first = do(job(), Plan("transfer", "out"))
        for name in ("target.png", "out/out.png"):
            os.utime(place / name, ns=(1, 1))
        monkeypatch.setitem(kinds.WORK, "transfer", None)
        again = do(job(), Plan("transfer", "out"), first)
        assert (again.reason, again.measured) == ("", first.measured)
        assert [file.digest for file in again.files] == [file.digest for file in first.files]
        assert " 1 " in again.files[0].version
        assert " 1 " in again.inputs[0].version

    @pytest.mark.parametrize("harm", ["torn", "other bytes", "gone", "other settings"])
    def test_what_was_harmed_is_made_anew(self, place, harm):
        first = do(job(), Plan("transfer", "out"))
        whole = (place / "out/out.png").read_bytes()
        if harm == "gone":
            (place / "out/out.png").unlink()
        elif harm != "other settings":
            (place / "out/out.png").write_bytes(whole[:100] if harm == "torn" else b"x" * len(whole))
        changes = {"strength": 0.0} if harm == "other settings" else {}
        again = do(job(**changes), Plan("transfer", "out"), first)
        assert again.reason == ""
        assert ((place / "out/out.png").read_bytes() == whole) == (not changes)

    def test_a_file_that_nobody_recorded_stays(self, place):
        (place / "out").mkdir()
        (place / "out/out.png").write_bytes(b"precious")
        outcome = do(job(), Plan("transfer", "out"))
        assert outcome.reason.startswith("out/out.png: exists already, and this batch did not write it; move")
        assert (place / "out/out.png").read_bytes() == b"precious"
        assert do(job(), Plan("transfer", "out", force=True)).reason == ""
        Image.open(place / "out/out.png").verify()

    @pytest.mark.parametrize("kind", KINDS)
    def test_a_file_that_a_killed_run_wrote_is_taken_for_its_own(self, place, kind):
        output = {"decompose": "out", "landmarks": "out.json"}.get(kind, "out.png")
        row = job(output) if kind == "transfer" else alone(output)
        first = do(row, Plan(kind, "out"))
        before = listing(place)
        again = do(row, Plan(kind, "out"))
        assert (again.reason, listing(place)) == ("", before)
        assert [file.digest for file in again.files] == [file.digest for file in first.files]

    def test_after_a_failure_it_is_still_its_own(self):
        first = do(job(), Plan("transfer", "out"))
        shutil.move("target.png", "away.png")
        failed = do(job(strength=0.5), Plan("transfer", "out"), first)
        assert failed.reason
        shutil.move("away.png", "target.png")
        assert do(job(strength=0.5), Plan("transfer", "out"), failed).reason == ""


@pytest.mark.usefixtures("place")
class TestFailures:
    @pytest.fixture(autouse=True)
    def photos(self, place):
        (place / "text.png").write_text("no photo")
        (place / "torn.png").write_bytes((place / "target.png").read_bytes()[:2000])
        (place / "text.csv").write_text("no landmarks")
        (place / "far.csv").write_text("x,y\n1,1\n9000,1\n5,5\n")
        Image.new("RGB", (64, 64)).save(place / "dark.png")
        Image.new("RGB", (4, 4)).save(place / "tiny.png")
        Image.new("RGBA", (64, 64)).save(place / "clear.png")
        (place / "file").write_text("")

    @pytest.mark.parametrize(
        ("changes", "message"),
        [
            ({"target": "no.png"}, "no.png: there is no such file"),
            ({"target": "file"}, "file: "),
            ({"target": "."}, ".: is a folder"),
            ({"reference": "text.png"}, "text.png: "),
            ({"reference": "torn.png"}, "torn.png: "),
            ({"target": "tiny.png"}, "tiny.png: "),
            ({"target": "dark.png", "target_landmarks": None}, "dark.png: no face found; "),
            ({"target_landmarks": "no.csv"}, "no.csv: "),
            ({"target_landmarks": "text.csv"}, "text.csv: "),
            ({"reference_landmarks": "far.csv"}, "far.csv: "),
            ({"light": "rim"}, "reference: expected none with a light by name"),
            ({"reference": None, "reference_landmarks": None}, "reference: expected a photo"),
            ({"output": "out.gif"}, "out.gif: no format to write goes by '.gif'"),
            ({"output": "a.jpg", "target": "clear.png", "target_landmarks": None}, "a.jpg: JPEG cannot hold"),
            ({"method": "quotient"}, "second_reference: expected"),
        ],
    )
    def test_the_reason_is_told_and_nothing_written(self, place, changes, message):
        before = listing(place)
        outcome = do(job(**changes), Plan("transfer", "out"))
        assert outcome.reason.startswith(message)
        assert "bug" not in outcome.reason
        assert listing(place) == before

    @pytest.mark.parametrize("kind", KINDS)
    def test_a_place_that_cannot_be_written(self, place, kind):
        output = {"decompose": "x", "landmarks": "x.json"}.get(kind, "x.png")
        outcome = do(job(output) if kind == "transfer" else alone(output), Plan(kind, "file"))
        assert outcome.reason.startswith("file/x")
        assert "bug" not in outcome.reason
        assert (place / "file").read_text() == ""

    def test_too_little_memory(self, monkeypatch):
        def starve(*_given, **_named):
            raise MemoryError

        monkeypatch.setattr(kinds, "transfer", starve)
        assert do(job(), Plan("transfer", "out")).reason.startswith("not enough memory")

    def test_even_a_bug_does_not_end_the_run(self, monkeypatch):
        def stumble(*_given, **_named):
            raise ZeroDivisionError("oops")

        monkeypatch.setattr(kinds, "transfer", stumble)
        outcome = do(job(), Plan("transfer", "out"))
        assert outcome.reason == "ZeroDivisionError: oops; this is a bug, please report it"

    def test_control_c_is_no_failure(self, place, monkeypatch):
        def press_control_c(*_given, **_named):
            raise KeyboardInterrupt

        monkeypatch.setattr(kinds, "write_results", press_control_c)
        before = listing(place)
        with pytest.raises(KeyboardInterrupt):
            do(job(), Plan("transfer", "out"))
        assert listing(place) == before
