"""Engines: loky and a Dask cluster do the same, whatever dies; the functions here run in their workers."""

import os
import signal
import socket
import subprocess
import sys
import threading
import time
from contextlib import ExitStack, closing
from pathlib import Path

import dask
import distributed
import psutil
import pytest
import threadpoolctl

from relit.errors import ClusterLostError, ImageError, OptionError, WorkerLostError
from relit.runtime.engine import share
from relit.runtime.engines import engine
from relit.runtime.threads import available, bands, limit, pool

pytestmark = pytest.mark.slow  # nearly every test starts processes

PROCESSES = ["local", "dask"]
#: Stays at work in two processes, whose numbers it prints; what a Ctrl-C does to it is the default.
STAY = """
import signal, sys, time
from relit.runtime.engines import engine
from tests.runtime.test_engines import identity
signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell's background jobs ignore it
if __name__ == "__main__":
    print("there", flush=True)
    with engine(sys.argv[1], 2) as lent:
        found = set()
        while len(found) < 2:
            found |= {result for ended in lent.run(identity, [()] * 4) for _, result in ended}
        for ended in lent.run(time.sleep, [(600,)] * 2):
            if found:
                print(*found, flush=True)
                found.clear()
"""


def square(number):
    return number**2


def square_the_second_time(number, marker):
    """Kill the process that works on it, once."""
    if not marker.exists():
        marker.touch()
        die()
    return number**2


def die():
    os.kill(os.getpid(), getattr(signal, "SIGKILL", signal.SIGTERM))


def complain():
    raise ImageError("face.png: is a cat")


def stay_until(marker):
    while not marker.exists():
        time.sleep(0.02)


def identity():
    time.sleep(0.05)
    return os.getpid()


def threads():
    return available(), {library["num_threads"] for library in threadpoolctl.threadpool_info()}


@pytest.fixture(scope="module", params=PROCESSES)
def two(request):
    """An engine of two workers."""
    with engine(request.param, 2) as lent:
        yield lent


@pytest.fixture(scope="module")
def of_ray():
    pytest.importorskip("ray")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("PYTHONPATH", os.pathsep.join(filter(None, sys.path)))  # for the functions here
        with engine("ray", 2) as lent:
            yield lent


def call(_number, function, *args):
    return function(*args)


def results(lent, tasks):
    """What each of the tasks, a function and its arguments, gives."""
    items = [(number, *task) for number, task in enumerate(tasks)]
    found = {item[0]: result for ended in lent.run(call, items) for item, result in ended}
    assert len(found) == len(tasks)
    return [found[number] for number in range(len(tasks))]


def result(lent, *task):
    return results(lent, [task])[0]


class TestLoss:
    def test_of_a_worker_loses_nothing(self, two, tmp_path):
        tasks = [(square, number) for number in range(20)]
        tasks[7] = (square_the_second_time, 7, tmp_path / "marker")
        assert results(two, tasks) == [number**2 for number in range(20)]

    def test_of_every_worker_that_tries_harms_no_other(self, two):
        tasks = [(square, number) for number in range(20)]
        tasks[7] = (die,)
        found = results(two, tasks)
        assert isinstance(found.pop(7), WorkerLostError)
        assert found == [number**2 for number in range(20) if number != 7]

    def test_names_its_cause(self):
        with engine("local", 1) as lent:
            lost = result(lent, die)
        assert "memory" in str(lost)
        assert "terminated" in str(lost.__cause__)

    @pytest.mark.rotating
    def test_of_one_after_the_other(self):
        with engine("local", 2) as lent:
            tasks = [(die,) if number % 4 == 1 else (square, number) for number in range(12)]
            found = results(lent, tasks)
        assert [isinstance(one, WorkerLostError) for one in found] == [n % 4 == 1 for n in range(12)]


class TestWork:
    def test_exceptions_arrive_as_they_are(self, two):
        with pytest.raises(ImageError, match=r"^face\.png: is a cat$") as caught:
            result(two, complain)
        assert type(caught.value) is ImageError

    def test_is_done_by_processes_that_stay(self, two):
        found = set(results(two, [(identity,)] * 20))
        assert 1 <= len(found) <= 2
        assert os.getpid() not in found

    def test_takes_its_part_of_the_cores(self, two):
        assert two.workers == 2
        assert result(two, threads) == (max(1, available() // 2), {1})

    def test_is_asked_for_when_there_is_room(self, two):
        """Two at work in each of the workers' places, and what waits at their doors."""
        asked, ended = 0, 0

        def items():
            nonlocal asked
            for number in range(20):
                asked += 1
                assert asked - ended <= 4
                yield (number,)

        for some in two.run(square, items()):
            ended += len(some)
        assert asked == ended == 20

    def test_lets_others_have_a_turn(self, two, tmp_path):
        """They have it while the work goes on, or it would never end."""
        marker, turns = tmp_path / "marker", []
        for ended in two.run(stay_until, [(marker,)]):
            turns.append(ended)
            marker.touch()
        assert turns[0] == []
        assert turns[-1] == [((marker,), None)]

    @pytest.mark.parametrize("name", PROCESSES)
    @pytest.mark.rotating
    def test_is_given_up_where_the_block_fails(self, name):
        start = time.monotonic()

        def interrupted():
            nonlocal worker
            with engine(name, 2) as lent:
                worker = psutil.Process(result(lent, identity))
                for _ in lent.run(time.sleep, [(600,)] * 20):
                    raise KeyboardInterrupt

        worker = None
        with pytest.raises(KeyboardInterrupt):
            interrupted()
        wait_for_the_end_of(worker.pid)
        assert time.monotonic() - start < 300

    def test_that_leaves_much_memory_behind_disturbs_nobody(self):
        """loky replaces such a worker, and warns; that warning would end its thread here."""
        with engine("local", 1) as lent:
            one = result(lent, identity)
            time.sleep(1.1)  # loky looks once a second
            assert result(lent, hoard, 400_000_000) == one
            assert [result(lent, square, number) for number in range(5)] == [0, 1, 4, 9, 16]


HOARD = []


def hoard(size):
    HOARD.append(bytearray(os.urandom(1)) * size)
    return os.getpid()


def wait_for_the_end_of(*numbers):
    """Wait until these processes have ended, for a while that is less than what they are at would take."""
    end = time.monotonic() + 120
    while any(map(is_alive, numbers)) and time.monotonic() < end:
        time.sleep(0.1)
    assert not any(map(is_alive, numbers))


def is_alive(number):
    try:
        return psutil.Process(number).status() != psutil.STATUS_ZOMBIE
    except psutil.NoSuchProcess:
        return False


@pytest.mark.skipif(os.name != "posix", reason="needs the signals of POSIX")
@pytest.mark.parametrize("name", PROCESSES)
class TestSignals:
    @pytest.fixture
    def child(self, name, tmp_path):
        (tmp_path / "stay.py").write_text(STAY)
        environment = {
            **os.environ,
            "PYTHONPATH": os.pathsep.join(filter(None, [str(Path.cwd()), *sys.path])),
        }
        words = [sys.executable, tmp_path / "stay.py", name]
        pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
        with subprocess.Popen(words, env=environment, start_new_session=True, **pipes) as child:
            assert child.stdout.readline() == "there\n"
            yield child
            child.kill()

    @pytest.mark.parametrize("delay", [0.3, 0.8, None])
    @pytest.mark.rotating
    def test_ctrl_c_is_heard_by_this_process_alone(self, child, delay):
        """While the workers start, or at work: as in a terminal, all of them get it."""
        if delay is None:
            child.stdout.readline()
        else:
            time.sleep(delay)
        os.killpg(child.pid, signal.SIGINT)
        _, err = child.communicate(timeout=300)
        assert err.count("Traceback (most recent call last)") == 1
        # After that, joblib's tracker may tell of a folder that was gone before it looked.
        told, _, after = err.partition("KeyboardInterrupt\n")
        assert told != err
        assert not after or "resource_tracker" in after

    def test_no_worker_outlives_a_process_that_is_killed(self, child):
        workers = [int(word) for word in child.stdout.readline().split()]
        assert len(workers) == 2
        assert all(map(is_alive, workers))
        child.kill()
        wait_for_the_end_of(*workers)


class TestRefusals:
    @pytest.mark.parametrize(
        ("name", "workers", "address", "message"),
        [
            ("slurm", 2, None, "engine: expected one of local, dask, ray, got 'slurm'"),
            ("local", 0, None, "workers: expected an integer above 0, got 0"),
            ("local", True, None, "workers: expected an integer above 0, got True"),
            ("local", 2.0, None, r"workers: expected an integer above 0, got 2\.0"),
            ("local", 2, "tcp://a:1", "address: goes with the engines dask and ray"),
            ("dask", 2, "nonsense", "no Dask scheduler answers at 'nonsense'; check it"),
            ("dask", 2, "", "no Dask scheduler answers at ''; check it"),
        ],
    )
    def test_of_an_argument(self, name, workers, address, message):
        with pytest.raises(OptionError, match=message), engine(name, workers, address=address):
            pass

    @pytest.mark.parametrize(("name", "module", "extra"), [("dask", "distributed", "cluster"), ("ray",) * 3])
    def test_of_an_engine_that_is_not_installed(self, monkeypatch, name, module, extra):
        monkeypatch.setitem(sys.modules, module, None)
        with pytest.raises(OptionError, match=rf"pip install 'relit\[{extra}\]'$"), engine(name, 2):
            pass

    def test_of_an_address_where_no_ray_is(self):
        pytest.importorskip("ray")
        with socket.create_server(("127.0.0.1", 0)) as server:
            address = f"127.0.0.1:{server.getsockname()[1]}"
        with pytest.raises(OptionError, match=f"no Ray cluster answers at '{address}'"):
            engine("ray", 2, address=address).__enter__()

    @pytest.mark.parametrize("answer", [None, b"", b"HTTP/1.1 400 Bad Request\r\n\r\n" * 9])
    def test_of_an_address_where_something_else_is(self, monkeypatch, answer):
        """It is silent, hangs up, or talks of other things."""
        monkeypatch.setattr("relit.runtime.clusters._PATIENCE", 2)
        server = socket.create_server(("127.0.0.1", 0))

        def serve():
            with ExitStack() as callers:
                while True:
                    try:
                        caller, _ = server.accept()
                    except OSError:
                        return
                    callers.enter_context(closing(caller))
                    if answer is not None:
                        caller.sendall(answer)
                        caller.close()

        thread = threading.Thread(target=serve)
        thread.start()
        address = f"tcp://127.0.0.1:{server.getsockname()[1]}"
        start = time.monotonic()
        with pytest.raises(OptionError, match=f"no Dask scheduler answers at '{address}'"):
            engine("dask", 2, address=address).__enter__()
        server.shutdown(socket.SHUT_RDWR)
        server.close()
        thread.join()
        assert time.monotonic() - start < 120


class TestCluster:
    """A Dask that runs already."""

    @pytest.fixture
    def cluster(self):
        with distributed.LocalCluster(
            n_workers=3, threads_per_worker=1, dashboard_address="127.0.0.1:0", silence_logs=50
        ) as cluster:
            yield cluster

    def test_lends_its_workers(self, cluster):
        with engine("dask", 1, address=cluster.scheduler_address) as lent:
            assert lent.workers == 3
            assert result(lent, threads) == (1, {1})
        with engine("dask", 8, address=cluster.scheduler_address) as lent:
            assert lent.workers == 8
            assert results(lent, [(square, 3)]) == [9]

    def test_that_goes_away_takes_all_along(self, cluster):
        with (
            dask.config.set({"distributed.comm.timeouts.connect": "3s"}),  # how long it is waited for
            engine("dask", 1, address=cluster.scheduler_address) as lent,
        ):
            work = lent.run(time.sleep, [(600,)] * 5)
            assert next(work) == []
            cluster.close()
            for _ in range(2):
                with pytest.raises(ClusterLostError, match="the cluster is gone"):
                    list(work)
                work = lent.run(square, [(1,)])

    def test_with_another_relit_is_refused(self, cluster, monkeypatch):
        monkeypatch.setattr("relit.__version__", "99")
        with pytest.raises(OptionError, match=r"has relit .*; install relit 99 there, as here"):
            engine("dask", 1, address=cluster.scheduler_address).__enter__()


class TestRay:
    """Where it is installed."""

    def test_loses_nothing(self, of_ray, tmp_path):
        tasks = [(square, number) for number in range(20)]
        tasks[7] = (square_the_second_time, 7, tmp_path / "marker")
        tasks[8] = (die,)
        found = results(of_ray, tasks)
        assert isinstance(found.pop(8), WorkerLostError)
        assert found == [number**2 for number in range(20) if number != 8]

    def test_exceptions_arrive_as_they_are(self, of_ray):
        with pytest.raises(ImageError, match=r"^face\.png: is a cat$") as caught:
            result(of_ray, complain)
        assert type(caught.value) is ImageError

    def test_takes_its_part_of_the_cores(self, of_ray):
        assert of_ray.workers == 2
        assert result(of_ray, threads) == (max(1, available() // 2), {1})


class TestLimit:
    def test_holds_in_the_threads_that_are_lent(self):
        with limit(1):
            assert available() == 1
            assert bands((4096, 4096), None) == [(0, 4096)]
            with pool(2) as run:
                assert run(lambda _: available(), range(4)) == [1] * 4
        assert available() == len(os.sched_getaffinity(0))

    def test_is_no_more_than_the_cores(self):
        with limit(1000):
            assert available() == len(os.sched_getaffinity(0))

    @pytest.mark.parametrize("threads", [0, -1, 1.5, True])
    def test_out_of_range(self, threads):
        with pytest.raises(OptionError, match="threads: expected"), limit(threads):
            pass


def test_a_worker_holds_no_more_than_it_was_given():
    assert share(1000, None) == 1
    assert share(1, None) == available()
    assert share(1, "tcp://a:1") == 1
