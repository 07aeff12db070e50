"""The loop of a batch: every row ends once, what is done is not done again, and lost workers lose nothing."""

import dataclasses
import os
import threading
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path

import pytest

from relit.batch import run as module
from relit.batch.jobs import File, Outcome, Plan, Row
from relit.batch.journal import Journal
from relit.batch.run import Batch, run
from relit.batch.stamps import stamp_of
from relit.batch.work import recipe
from relit.errors import ClusterLostError, OptionError, WorkerLostError
from relit.settings.options import TransferOptions


class Engine:
    """Does what it is given at once, or in threads; workers can be lost."""

    def __init__(self, threads=0, loses=lambda _job, _alone: False):
        self.pool = ThreadPoolExecutor(threads) if threads else None
        self.loses, self.under_way, self.most, self.submitted = loses, set(), 0, []

    def submit(self, function, job, *others):
        self.submitted.append(job.number)
        if self.pool:
            return self.pool.submit(function, job, *others)
        future = Future()
        if self.loses(job, job.number):
            future.set_exception(WorkerLostError("gone"))
        else:
            future.set_result(function(job, *others))
        return future


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
        asked.append((job.number, recorded))
        data = Path(job.target).read_text()
        if data == "bad":
            return Outcome(job.number, job.output, "failed", "bad photo")
        place = tmp_path / "out" / job.output
        place.parent.mkdir(exist_ok=True)
        place.write_text(data)
        made = recipe(job, plan.kind, [data])
        files = [File(data, stamp_of(job.target))], [File(data, stamp_of(str(place)))]
        return Outcome(job.number, job.output, "ok", made=made, inputs=files[0], files=files[1])

    monkeypatch.setattr(module, "do", copy)
    return asked


@pytest.fixture
def go(tmp_path, rows):
    """Run the rows; return the counts, and how each row ended."""

    def once(engine=None, *, given=None, kind="normalize", window=3, limit=None, force=False, **options):
        plan = Plan(kind, f"{tmp_path}/out", force)
        batch = Batch(given or rows, plan, TransferOptions(**options), limit=limit)
        with Journal(tmp_path / "journal").writing() as journal:
            counts = run(batch, journal, engine or Engine(), window=window)
            journal.refresh()
            ended = {
                row.number: journal.find(job.key if isinstance(job, Outcome) else job.output)
                for row, job in batch.rows()
            }
        return counts, ended

    return once


def numbers(asked):
    return sorted(number for number, _ in asked)


class TestRun:
    def test_every_row_ends_once(self, go, done):
        counts, ended = go()
        assert dataclasses.astuple(counts) == (7, 0, 7, 0)
        assert numbers(done) == list(range(1, 8))
        assert all(outcome.status == "ok" for outcome in ended.values())

    def test_what_is_done_is_not_done_again(self, go, done):
        go(limit=3)
        assert numbers(done) == [1, 2, 3]
        counts, _ = go()
        assert dataclasses.astuple(counts) == (7, 3, 4, 0)
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
        assert dataclasses.astuple(counts) == (7, 6, 1, 0)
        ((number, recorded),) = done
        assert (number, recorded.output, recorded.status) == (4, "4.png", "ok")

    def test_failed_rows_are_tried_again(self, go, done, tmp_path, rows):
        (tmp_path / "in" / "2.png").write_text("bad")
        given = [*rows, Row(8, problem="no target")]
        counts, ended = go(given=given)
        assert dataclasses.astuple(counts) == (8, 0, 6, 2)
        assert [ended[n].reason for n in (2, 8)] == ["bad photo", "no target"]
        assert dataclasses.astuple(go(given=given)[0]) == (8, 6, 0, 2)
        (tmp_path / "in" / "2.png").write_text("good")
        done.clear()
        counts, ended = go(given=given)
        assert dataclasses.astuple(counts) == (8, 6, 1, 1)
        assert numbers(done) == [2]

    def test_rows_are_known_by_what_they_write(self, go, done, rows):
        go()
        done.clear()
        moved = [row._replace(number=number) for number, row in enumerate(reversed(rows), 1)]
        assert dataclasses.astuple(go(given=moved)[0]) == (7, 7, 0, 0)

    def test_other_settings_are_refused_unless_forced(self, go, done):
        go(limit=2)
        with pytest.raises(OptionError, match=r"other settings \(lam 0.2 is now 0.7\); .* --force to make"):
            go(lam=0.7)
        with pytest.raises(
            OptionError, match="holds results of normalize; choose another folder for those of transfer"
        ):
            go(kind="transfer", force=True)
        assert numbers(done) == [1, 2]
        assert dataclasses.astuple(go(lam=0.7, force=True)[0]) == (7, 0, 7, 0)
        assert dataclasses.astuple(go(lam=0.7, force=True)[0]) == (7, 7, 0, 0)
        assert dataclasses.astuple(go(lam=0.7, strength=2.0)[0]) == (7, 7, 0, 0)  # of no use to this kind

    def test_no_more_are_under_way_than_the_window_holds(self, go, done, monkeypatch):
        copy, lock, most = module.do, threading.Lock(), []
        here = threading.Semaphore(3)

        def slow(*given):
            with lock:
                assert here.acquire(blocking=False)
                most.append(1)
            outcome = copy(*given)
            here.release()
            return outcome

        monkeypatch.setattr(module, "do", slow)
        assert go(Engine(threads=8))[0].ok == 7
        assert len(most) == len(done) == 7


class TestLostWorkers:
    def test_a_row_that_is_lost_once_is_not_lost(self, go, done):
        seen = []

        def once(job, _):
            seen.append(job.number)
            return job.number in (2, 3) and seen.count(job.number) == 1

        counts, ended = go(Engine(loses=once))
        assert dataclasses.astuple(counts) == (7, 0, 7, 0)
        assert numbers(done) == list(range(1, 8))
        assert {outcome.status for outcome in ended.values()} == {"ok"}

    def test_a_row_that_kills_its_worker_fails_alone(self, go, done):
        # As loky does: when a worker dies, all that are under way are lost.
        doomed = {3, 6}
        engine = Engine()
        counts, ended = go(_Fragile(engine, doomed))
        assert dataclasses.astuple(counts) == (7, 0, 5, 2)
        assert {number for number, outcome in ended.items() if outcome.status == "failed"} == doomed
        assert "the worker died (out of memory, or a crash)" in ended[3].reason
        assert numbers(done) == [1, 2, 4, 5, 7]

    def test_without_a_cluster_the_run_ends_and_what_was_done_stays(self, go, done):
        class Gone(Engine):
            def submit(self, function, job, *others):
                future = super().submit(function, job, *others)
                if job.number == 5:
                    future = Future()
                    future.set_exception(ClusterLostError("the cluster is gone"))
                return future

        with pytest.raises(ClusterLostError, match="the cluster is gone"):
            go(Gone())
        done.clear()
        counts, _ = go()
        assert counts.kept == 5  # row 6 was done when 5 was lost
        assert (counts.done, counts.failed) == (7, 0)


class _Fragile:
    """Breaks as a whole when a doomed row is tried, as soon as somebody waits for a result."""

    def __init__(self, engine, doomed):
        self.engine, self.doomed, self.waiting = engine, doomed, []

    def submit(self, function, job, *others):
        future = Future()
        self.waiting.append((future, function, job, *others))
        if len(self.waiting) == 3 or job.number in (7, *self.doomed) or job.number in self.tried():
            self.settle()
        return future

    def tried(self):
        return self.engine.submitted

    def settle(self):
        lost = any(job.number in self.doomed for _, _, job, *_ in self.waiting)
        for future, function, job, *others in self.waiting:
            self.engine.submitted.append(job.number)
            if lost:
                future.set_exception(WorkerLostError("gone"))
            else:
                future.set_result(function(job, *others))
        self.waiting.clear()
