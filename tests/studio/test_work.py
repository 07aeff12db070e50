"""The queue of computations: fair turns, bounds, and an end for what nobody waits for."""

import asyncio
import threading
from concurrent.futures import ThreadPoolExecutor

import pytest

from relit.studio.limits import SHARE, Limits
from relit.studio.session import StudioError
from relit.studio.work import Work


def played(scene):
    """Run a scene in a thread of its own: the tests of the page have a loop running in the main one."""
    with ThreadPoolExecutor(1) as thread:
        return thread.submit(asyncio.run, asyncio.wait_for(scene, 300)).result()


class Tasks:
    """Computations that note when they run, and go on when they are told."""

    def __init__(self, **limits):
        self.work, self.ran, self.called_off, self.most = Work(Limits(**limits)), [], [], 0
        self.free = threading.Event()
        self._gates, self._running, self._lock = {}, [], threading.Lock()

    def ask(self, name, *, held=False, session=None, **named):
        """Ask for a task; a `held` one runs until it is released or called off."""
        gate = self._gates[name] = threading.Event()
        if not held:
            gate.set()

        def task(go_on):
            with self._lock:
                self.ran.append(name)
                self._running.append(name)
                self.most = max(self.most, len(self._running))
            try:
                while not gate.wait(0.005):
                    go_on()
            except StudioError as error:
                self.called_off.append((name, error.code))
                raise
            finally:
                with self._lock:
                    self._running.remove(name)
            return name

        return asyncio.ensure_future(self.work.do(task, session=session or name, **named))

    def release(self, *names):
        for name in names:
            self._gates[name].set()

    async def running(self, *names):
        """Wait until exactly these run."""
        while sorted(self._running) != sorted(names):
            await asyncio.sleep(0.002)


async def refused(asked):
    with pytest.raises(StudioError) as caught:
        await asked
    return caught.value.status, caught.value.code


async def settled():
    for _ in range(10):
        await asyncio.sleep(0)


def test_so_many_run_at_once_and_one_of_a_session():
    async def scene():
        tasks = Tasks(workers=2)
        asked = [tasks.ask(name, held=True, session=name[0]) for name in ("a1", "a2", "b1", "c1")]
        await tasks.running("a1", "b1")
        assert (tasks.work.running, tasks.work.waiting) == (2, 2)
        tasks.release("b1")
        await tasks.running("a1", "c1")
        tasks.release("a1", "a2", "c1")
        assert await asyncio.gather(*asked) == ["a1", "a2", "b1", "c1"]
        assert (tasks.most, tasks.work.running, tasks.work.waiting) == (2, 0, 0)

    played(scene())


def test_sessions_take_turns():
    async def scene():
        tasks = Tasks(workers=1)
        first = tasks.ask("first", held=True)
        asked = [tasks.ask(name, session=name[0]) for name in ("a1", "a2", "a3", "b1", "c1", "b2")]
        await tasks.running("first")
        tasks.release("first")
        await asyncio.gather(first, *asked)
        assert tasks.ran == ["first", "a1", "b1", "c1", "a2", "b2", "a3"]

    played(scene())


def test_so_do_clients_however_many_sessions_they_have():
    async def scene():
        tasks = Tasks(workers=2)
        held = [tasks.ask(name, held=True, client=name) for name in ("x", "y")]
        much = [tasks.ask(f"a{number}", client="a") for number in range(6)]
        little = [tasks.ask("b0", client="b"), tasks.ask("c0", client="c")]
        await tasks.running("x", "y")
        tasks.release("x")
        await asyncio.gather(*much, *little)
        assert tasks.ran[2:5] == ["a0", "b0", "c0"]
        tasks.release("y")
        await asyncio.gather(*held)

    played(scene())


def test_a_client_that_has_taken_all_workers_does_not_keep_another_waiting():
    async def scene():
        tasks = Tasks(workers=2)
        held = [tasks.ask(name, held=True, client="a") for name in ("a1", "a2", "a3")]
        await tasks.running("a1", "a2")
        assert await tasks.ask("b1", client="b") == "b1"
        another = tasks.ask("b2", held=True, client="b")
        await tasks.running("a1", "a2", "b2")
        more = tasks.ask("c1", client="c")
        await settled()
        assert tasks.work.waiting == 2
        tasks.release("a1", "a2", "a3", "b2")
        await asyncio.gather(*held, another, more)
        assert tasks.most == 3

    played(scene())


def test_past_a_sessions_queue_it_is_busy():
    async def scene():
        tasks = Tasks(workers=2, queue_per_session=3)
        asked = [tasks.ask(f"a{number}", held=not number, session="a") for number in range(45)]
        assert {await refused(one) for one in asked[4:]} == {(503, "busy")}
        assert await tasks.ask("b") == "b"
        tasks.release("a0")
        assert await asyncio.gather(*asked[:4]) == ["a0", "a1", "a2", "a3"]

    played(scene())


def test_where_all_queues_are_full_the_longest_gives_way():
    async def scene():
        tasks = Tasks(workers=1, queue=4)
        held = [tasks.ask(name, held=True, client=name) for name in ("a", "x")]
        await tasks.running("a", "x")
        much = [tasks.ask(f"a{number}", client="a") for number in range(4)]
        await settled()
        assert await refused(tasks.ask("a4", client="a")) == (503, "busy")
        little = [tasks.ask("b1", client="b")]
        assert await refused(much.pop()) == (503, "busy")
        little.append(tasks.ask("c1", client="c"))
        assert await refused(much.pop()) == (503, "busy")
        assert await refused(tasks.ask("c2", client="c")) == (503, "busy")  # no longer than the others'
        tasks.release("a", "x")
        assert await asyncio.gather(*held, *much, *little) == ["a", "x", "a0", "a1", "b1", "c1"]

    played(scene())


def test_what_is_overtaken_is_answered_while_it_waits():
    async def scene():
        tasks, newest = Tasks(workers=1), 1

        def wanted():
            if newest > 1:
                raise StudioError(409, "stale", "A newer one.")

        held = tasks.ask("held", held=True)
        old = [tasks.ask(f"old{number}", session="a", wanted=wanted) for number in range(2)]
        await tasks.running("held")
        newest = 2
        new = tasks.ask("new", session="a")
        assert [await refused(one) for one in old] == [(409, "stale")] * 2
        assert not new.done()
        tasks.release("held")
        await asyncio.gather(held, new)
        assert tasks.ran == ["held", "new"]

    played(scene())


def test_whoever_hangs_up_is_computed_nothing_for():
    async def scene():
        tasks, hung_up = Tasks(workers=1), asyncio.Event()
        running = tasks.ask("running", held=True, gone=hung_up.wait())
        waiting = tasks.ask("waiting", gone=hung_up.wait())
        other = tasks.ask("other")
        await tasks.running("running")
        hung_up.set()
        assert [await refused(one) for one in (running, waiting)] == [(499, "gone")] * 2
        assert await other == "other"
        assert tasks.ran == ["running", "other"]
        assert tasks.called_off == [("running", "gone")]
        cancelled = tasks.ask("cancelled", held=True)
        await tasks.running("cancelled")
        cancelled.cancel()
        await tasks.running()
        assert tasks.called_off[1:] == [("cancelled", "gone")]

    played(scene())


def test_neither_waiting_nor_running_lasts_for_ever():
    async def scene():
        tasks, step = Tasks(workers=1, compute_seconds=0.2), threading.Event()
        deaf = tasks.ask("deaf", held=True)
        tasks._gates["deaf"].wait = lambda _: step.wait()  # between two steps for long
        waiting = tasks.ask("waiting", held=True)
        with pytest.raises(StudioError) as caught:
            await deaf
        assert (caught.value.status, caught.value.code, caught.value.again) == (503, "too_long", 0.2)
        assert await refused(waiting) == (503, "busy")
        assert tasks.work.running == 1  # until its step is done, which has been waited for by nobody
        step.set()
        while tasks.work.running:
            await asyncio.sleep(0.01)
        assert await tasks.ask("next") == "next"

    played(scene())


def test_memory_is_counted_before_it_is_taken():
    async def scene():
        tasks = Tasks(workers=4, working_memory=1000)
        assert SHARE == 0.75
        assert await refused(tasks.ask("large", memory=751)) == (413, "too_large")
        first = tasks.ask("a1", held=True, client="a", memory=700)
        second = tasks.ask("a2", client="a", memory=100)  # more than a client's share
        third = tasks.ask("b1", held=True, client="b", memory=200)
        fourth = tasks.ask("c1", client="c", memory=200)  # more than there is
        await tasks.running("a1", "b1")
        assert tasks.work.waiting == 2
        assert await tasks.ask("d1", client="d", memory=100) == "d1"
        tasks.release("b1")
        assert await asyncio.gather(third, fourth) == ["b1", "c1"]
        tasks.release("a1")
        assert await asyncio.gather(first, second) == ["a1", "a2"]

    played(scene())


def test_what_goes_wrong_is_told():
    async def scene():
        work = Work(Limits())

        def fail(_):
            raise ValueError("no such thing")

        with pytest.raises(ValueError, match="no such thing"):
            await work.do(fail, session="a")
        assert work.running == 0

    played(scene())
