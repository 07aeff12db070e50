"""What ``relit batch`` costs a pair, and what it adds: ``python -m benchmarks.batch``.

Photos are crops of the samples, all different; every target goes with every reference, landmarks given.
The same rows are done again and again in turn, by processes that are warm: alone on one core, on two, with
nothing shared between rows, and in a loop as a short script has it. So what else the machine does falls on
all alike, and starting counts nothing.
"""

from __future__ import annotations

import os
import resource
import subprocess
import sys
import tempfile
import time
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
import numpy as np
import psutil

import relit
from benchmarks.faces import crops
from relit.batch.jobs import Plan
from relit.batch.journal import Journal
from relit.batch.manifest import Manifest
from relit.batch.run import Batch, Places, run
from relit.face.landmark_files import read_landmarks, write_landmarks
from relit.runtime.engines import engine

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from relit.runtime.engine import Engine
    from relit.settings.transfer_changes import MethodName

_RELIT = "from relit.cli.app import main; main()"
_SIZES = (256, 512, 1024)  # px
_TARGETS, _REFERENCES, _ROUNDS = 1, 8, 9


@click.command(help=__doc__)
@click.option("--rows", default=10_000, show_default=True, help="Of the long run, of small photos.")
@click.option("--rounds", default=_ROUNDS, show_default=True)
@click.option("--method", default="shading", show_default=True)
def main(rows: int, rounds: int, method: MethodName) -> None:
    """Run the benchmarks."""
    with tempfile.TemporaryDirectory() as name:
        if rounds:
            with _workers(1) as bare, _workers(1) as one, _workers(2) as two:
                for size in _SIZES:
                    _costs(Path(name, str(size)), size, rounds, method, bare, one, two)
        if rows:
            _long_run(Path(name, "long"), rows)


@contextmanager
def _workers(count: int) -> Iterator[Engine[Any]]:
    """Lend processes: one on the first core, or one on each."""
    cores = os.sched_getaffinity(0)
    os.sched_setaffinity(0, sorted(cores)[:count])
    try:
        with engine("local", count) as running:
            _call(running, time.sleep, *[(1,)] * count)
            os.sched_setaffinity(0, cores)
            yield running
    finally:
        os.sched_setaffinity(0, cores)


def _costs(
    folder: Path,
    size: int,
    rounds: int,
    method: MethodName,
    bare: Engine[Any],
    one: Engine[Any],
    two: Engine[Any],
) -> None:
    _photos(folder / "t", "target", _TARGETS, size)
    _photos(folder / "r", "reference", _REFERENCES, size)
    _manifest(folder, _TARGETS * _REFERENCES)
    lanes: dict[str, Callable[[Path], float]] = {
        "loop": lambda _: _call(bare, loop, (str(folder), method)),
        "unshared": lambda out: _done(one, folder, out, method, shared=False),
        "unshared-two": lambda out: _done(two, folder, out, method, shared=False),
        "one": lambda out: _done(one, folder, out, method),
        "two": lambda out: _done(two, folder, out, method),
    }
    taken = np.array(
        [
            [lane(folder / f"{name}-{turn}") for name, lane in lanes.items()]
            for turn in range(-1, rounds)  # the first one warms
        ]
    )[1:]
    for path in (folder / "one-0").glob("*.png"):
        for lane in ("unshared", "unshared-two", "two"):
            assert path.read_bytes() == (folder / f"{lane}-0" / path.name).read_bytes(), path
    alone, unshared, unshared_two, single, double = np.median(taken, axis=0)
    search = _call(bare, _search, (str(folder),))
    click.echo(
        f"{size}²: in a loop {alone:.3f} s a pair; finding a face {search:.3f} s; a worker held "
        f"{_call(two, _peak, ()):.0f} MB at most"
    )
    click.echo(
        f"  nothing shared: {unshared:.3f} s, {_ratio(taken, 1, 0)} of the loop; two processes "
        f"{unshared_two:.3f} s, {_ratio(taken, 1, 2)} times the throughput"
    )
    click.echo(
        f"  targets shared: {single:.3f} s, {_ratio(taken, 3, 0)} of the loop; two processes {double:.3f} s, "
        f"{_ratio(taken, 3, 4)} times the throughput; 1000 pairs {1000 * double / 60:.1f} min"
    )


def _ratio(taken: Any, over: int, under: int) -> str:
    """Return how two lanes compare within a round, in the median and at most and least."""
    found = np.sort(taken[:, over] / taken[:, under])
    return f"{np.median(found):.2f} ({found[0]:.2f} to {found[-1]:.2f})"


def _done(engine: Engine[Any], folder: Path, out: Path, method: MethodName, *, shared: bool = True) -> float:
    """Return the seconds of a row of a batch."""
    start = time.perf_counter()
    plan = Plan("transfer", str(out), False, f"{out}-cache" if shared else None, 10**9)
    where = Places.of(str(out), f"{out}-journal")
    batch = Batch(Manifest(str(folder / "pairs.csv")), plan, relit.TransferOptions(method=method), where)
    with Journal(where.journal).writing() as journal:
        counts = run(batch, journal, engine)
    assert counts.ok == counts.total
    return (time.perf_counter() - start) / counts.total


def _call(engine: Engine[Any], function: Callable[..., Any], *items: tuple[Any, ...]) -> Any:
    """Return what a function gives in a worker, the last time if it is called several times."""
    return [result for ended in engine.run(function, items) for _, result in ended][-1]


def loop(folder: str, method: MethodName) -> float:
    """Relight pairs as a short script would; return the seconds of one."""
    start, done = time.perf_counter(), 0
    for target in sorted(Path(folder, "t").glob("*.png")):
        for reference in sorted(Path(folder, "r").glob("*.png")):
            photo, light = relit.read_image(target), relit.read_image(reference)
            here, there = (read_landmarks(path.with_suffix(".json")) for path in (target, reference))
            result = relit.transfer(
                photo, light, target_landmarks=here, reference_landmarks=there, method=method
            )
            relit.write_image(Path(folder, "bare.png"), result.image, like=photo, overwrite=True)
            done += 1
    return (time.perf_counter() - start) / done


def _search(folder: str) -> float:
    """Return the seconds that it takes to find a face."""
    photos = [relit.read_image(path).pixels for path in sorted(Path(folder, "r").glob("*.png"))]
    seconds = []
    for photo in photos:
        start = time.perf_counter()
        relit.detect_landmarks(photo)
        seconds.append(time.perf_counter() - start)
    return float(np.median(seconds))


def _peak() -> float:
    """Return the MB that this process held at most."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024 / 1e6


def _long_run(folder: Path, rows: int) -> None:
    """Watch the memory of the workers over many rows."""
    _photos(folder / "t", "target", 100, 96)
    _photos(folder / "r", "reference", rows // 100, 96)
    _manifest(folder, rows)
    start = time.perf_counter()
    command = ["batch", str(folder / "pairs.csv"), "-o", str(folder / "out"), "--jobs", "2"]
    process = subprocess.Popen([sys.executable, "-c", _RELIT, *command])
    started = psutil.Process(process.pid)
    seen: list[list[int]] = []  # bytes of each worker, every 2 s
    while process.poll() is None:
        time.sleep(2)
        with suppress(psutil.Error):
            seen.append([worker.memory_info().rss for worker in started.children(recursive=True)])
    assert process.returncode == 0
    wall = time.perf_counter() - start
    peaks = np.array([max(held, default=0) for held in seen]) / 1e6
    fifths = " ".join(f"{part.max():.0f}" for part in np.array_split(peaks, 5))
    click.echo(
        f"{rows} rows of 96² in {wall:.0f} s ({wall / rows:.3f} s a row); the largest worker held {fifths} "
        "MB at most in each fifth of the time"
    )


def _photos(folder: Path, sample: str, count: int, size: int) -> None:
    """Save crops of a sample photo, with their landmarks."""
    folder.mkdir(parents=True)
    for number, face in enumerate(crops(sample, count, size)):
        relit.write_image(folder / f"{number:04}.png", face.pixels)
        write_landmarks(folder / f"{number:04}.json", face.landmarks)


def _manifest(folder: Path, rows: int) -> None:
    lines = ["target,target_landmarks,reference,reference_landmarks,output"]
    for target in sorted((folder / "t").glob("*.png")):
        for reference in sorted((folder / "r").glob("*.png")):
            one, other = f"t/{target.stem}", f"r/{reference.stem}"
            output = f"{target.stem}-{reference.stem}.png"
            lines.append(f"{one}.png,{one}.json,{other}.png,{other}.json,{output}")
    (folder / "pairs.csv").write_text("\n".join(lines[: rows + 1]) + "\n")


if __name__ == "__main__":
    main()
