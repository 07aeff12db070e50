"""The loop of a batch: every row ends once, what is done is not done again, and lost workers lose nothing."""

import dataclasses
import os
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from pathlib import Path

import pytest

from relit.batch import run as module
from relit.batch.jobs import File, Outcome, Plan, Row
from relit.batch.journal import Journal
from relit.batch.places import version_of
from relit.batch.run import Batch, Places, run
from relit.batch.work import recipe_of
from relit.errors import ClusterLostError, OptionError, WorkerLostError
from relit.runtime import engine
from relit.settings.options import TransferOptions


class Engine(engine.Engine):
    """Does what it is given, at once or in threads; by a row and how often it was tried, a worker is lost."""

    def __init__(self, threads=0, loses=lambda _job, _times: None):
        self.pool = ThreadPoolExecutor(threads) if threads else None
        self.loses, self.submitted, self.workers = loses, [], 2

    def submit(self, function, job, *others):
        self.submitted.append(job.output)
        if self.pool:
            return self.pool.submit(function, job, *others)
        future = Future()
        if error := self.loses(job, self.submitted.count(job.output)):
            future.set_exception(error)
        else:
            future.set_result(function(job, *others))
        return future

    def wait(self, futures, seconds):
        return wait(futures, seconds, FIRST_COMPLETED).done

    def result(self, future):
        return future.result()


@pytest.fixture
def rows(tmp_path):
    (tmp_path / "in").mkdir()
    for number in range(1, 8):
        (tmp_path / "in" / f"{number}.png").write_text(f"photo {number}")
    return [Row(number, f"{tmp_path}/in/{number}.png") for number in range(1, 8)]


@pytest.fixture
def done(monkeypatch, tmp_path):
    """Work that copies text, and what it was asked to do."""
    asked = []

    def copy(job, plan, recorded):
        asked.append((int(Path(job.target).stem), recorded))
        data = Path(job.target).read_text()
        if data == "bad":
            return Outcome(job.output, "bad photo")
        place = tmp_path / "out" / job.output
        place.parent.mkdir(exist_ok=True)
        place.write_text(data)
        recipe = recipe_of(job, plan.kind, [data])
        inputs, files = ((File(data, version_of(str(path))),) for path in (job.target, place))
        return Outcome(job.output, "", recipe, inputs, files)

    monkeypatch.setattr(module, "do", copy)
    return asked


@pytest.fixture
def go(tmp_path, rows):
    """Run the rows; return the counts, and how each row ended."""

    def once(engine=None, *, given=None, kind="normalize", limit=None, force=False, **options):
        plan = Plan(kind, f"{tmp_path}/out", force)
        where = Places.of(plan.folder, str(tmp_path / "journal"))
        batch = Batch(given or rows, plan, TransferOptions(**options), where, limit=limit)
        with Journal(where.journal).writing() as journal:
            counts = run(batch, journal, engine or Engine())
            reasons = {
                row.number: job if isinstance(job, str) else journal.find(job.output).reason
                for row, job in batch.rows()
            }
        return counts, reasons

    return once


def numbers(asked):
    return sorted(number for number, _ in asked)


@pytest.mark.usefixtures("done")
class TestRun:
    def test_every_row_ends_once(self, go, done):
        counts, reasons = go()
        assert dataclasses.astuple(counts) == (7, 0, 7, 0, 0)
        assert numbers(done) == list(range(1, 8))
        assert reasons == dict.fromkeys(range(1, 8), "")

    def test_what_is_done_is_not_done_again(self, go, done):
        go(limit=3)
        assert numbers(done) == [1, 2, 3]
        counts, _ = go()
        assert dataclasses.astuple(counts) == (7, 3, 4, 0, 0)
        assert numbers(done) == list(range(1, 8))

    @pytest.mark.parametrize("touch", ["input", "output", "no output", "same bytes", "options"])
    def test_what_has_changed_is_done_again(self, go, done, tmp_path, rows, touch):
        go()
        done.clear()
        photo, result = tmp_path / "in" / "4.png", tmp_path / "out" / "4.png"
        if touch == "input":
            photo.write_text("another photo")
        elif touch == "same bytes":
            os.utime(photo, ns=(1, 1))
        elif touch == "output":
            result.write_text("phot")
        elif touch == "no output":
            result.unlink()
        else:
            rows[3] = rows[3]._replace(options=(("lam", 0.7),))
        counts, _ = go(given=rows)
        assert dataclasses.astuple(counts) == (7, 6, 1, 0, 0)
        ((number, recorded),) = done
        assert (number, recorded.output, recorded.reason) == (4, "4.png", "")

    def test_failed_rows_are_tried_again(self, go, done, tmp_path, rows):
        (tmp_path / "in" / "2.png").write_text("bad")
        given = [*rows, Row(8, problem="no target")]
        counts, reasons = go(given=given)
        assert dataclasses.astuple(counts) == (8, 0, 6, 2, 0)
        assert [reasons[n] for n in (2, 8)] == ["bad photo", "no target"]
        assert dataclasses.astuple(go(given=given)[0]) == (8, 6, 0, 2, 0)
        (tmp_path / "in" / "2.png").write_text("good")
        done.clear()
        counts, _ = go(given=given)
        assert dataclasses.astuple(counts) == (8, 6, 1, 1, 0)
        assert numbers(done) == [2]

    def test_rows_are_known_by_what_they_write(self, go, done, rows):
        go()
        done.clear()
        moved = [row._replace(number=number) for number, row in enumerate(reversed(rows), 1)]
        assert dataclasses.astuple(go(given=moved)[0]) == (7, 7, 0, 0, 0)

    def test_other_settings_are_refused_unless_forced(self, go, done):
        go(limit=2)
        with pytest.raises(OptionError, match=r"other settings \(lam 0.2 is now 0.7\); .* --force to make"):
            go(lam=0.7)
        with pytest.raises(
            OptionError, match="holds results of normalize; choose another folder for those of transfer"
        ):
            go(kind="transfer", force=True)
        assert numbers(done) == [1, 2]
        assert dataclasses.astuple(go(lam=0.7, force=True)[0]) == (7, 0, 7, 0, 0)
        assert dataclasses.astuple(go(lam=0.7, force=True)[0]) == (7, 7, 0, 0, 0)
        assert dataclasses.astuple(go(lam=0.7, strength=2.0)[0]) == (7, 7, 0, 0, 0)  # of no use to this kind

    def test_threads_do_as_well(self, go, done):
        assert go(Engine(threads=8))[0].ok == len(done) == 7

    def test_what_killed_workers_left_is_taken_away(self, go, tmp_path, rows):
        for name in (
            "out/.relit-01.tmp",
            "out/deep/.relit-02.tmp",
            "out/deep/mine.tmp",
            "out/else/.relit-03.tmp",
        ):
            (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
            (tmp_path / name).touch()
        go(given=[row._replace(output=f"deep/{row.number}.png") for row in rows])
        left = {str(path.relative_to(tmp_path)) for path in tmp_path.rglob("*.tmp")}
        assert left == {"out/deep/mine.tmp", "out/else/.relit-03.tmp"}  # of another run, it may be


class TestLostWorkers:
    def test_a_row_that_is_lost_once_is_not_lost(self, go, done):
        lost = {"2.png", "3.png"}
        counts, reasons = go(
            Engine(loses=lambda job, times: job.output in lost and times == 1 and WorkerLostError("gone"))
        )
        assert dataclasses.astuple(counts) == (7, 0, 7, 0, 0)
        assert numbers(done) == list(range(1, 8))
        assert set(reasons.values()) == {""}

    def test_a_row_that_kills_its_worker_fails_alone(self, go, done):
        counts, reasons = go(_Fragile({"3.png", "6.png"}))
        assert dataclasses.astuple(counts) == (7, 0, 5, 2, 0)
        assert {number for number, reason in reasons.items() if reason} == {3, 6}
        assert "the worker died (out of memory, or a crash)" in reasons[3]
        assert numbers(done) == [1, 2, 4, 5, 7]

    def test_without_a_cluster_the_run_ends_and_what_was_done_stays(self, go, done):
        gone = Engine(loses=lambda job, _: job.output == "5.png" and ClusterLostError("the cluster is gone"))
        with pytest.raises(ClusterLostError, match="the cluster is gone"):
            go(gone)
        done.clear()
        counts, _ = go()
        assert counts.kept >= 4
        assert (counts.done, counts.failed) == (7, 0)


class _Fragile(Engine):
    """As loky does: when a worker dies, all that is under way is lost."""

    def __init__(self, doomed):
        super().__init__()
        self.doomed, self.under_way = doomed, {}

    def submit(self, function, job, *others):
        future = Future()
        self.under_way[future] = function, job, *others
        return future

    def wait(self, futures, seconds):
        broken = any(job.output in self.doomed for _, job, *_ in self.under_way.values())
        for future, (function, *given) in self.under_way.items():
            if broken:
                future.set_exception(WorkerLostError("gone"))
            else:
                future.set_result(function(*given))
        self.under_way.clear()
        return super().wait(futures, seconds)
