"""The rows of the table: what is measured, on what, and against what."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import tracemalloc
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks import images, peers
from benchmarks.measure import Timing, exponent, side_by_side
from relit.runtime.threads import pool
from relit.solver.certificate import certify
from relit.solver.exact import solve, tv_l1
from relit.solver.isotropic import tv_l1_isotropic

LAMS = (0.1, 0.2, 0.4, 0.8)


@dataclass(frozen=True)
class Row:
    """A line of the table."""

    group: str
    case: str
    ours: Timing
    peer: Timing | None = None
    target: str = ""
    facts: dict[str, Any] = field(default_factory=dict)

    @property
    def ratio(self) -> float | None:
        """How many times as fast as the peer."""
        return self.peer.median / self.ours.median if self.peer else None


def proven(f: NDArray[Any], lam: float, neighborhood: Any, u: NDArray[Any]) -> dict[str, Any]:
    """Certify a result, and count the events that lead to it."""
    solution = solve(f, lam, neighborhood, threads=1)
    certificate = certify(f, u, lam, neighborhood, solution.flow)
    assert certificate.optimal, f"not a minimiser: {f.shape}, λ {lam}, {neighborhood} neighbours"
    per_pixel = {f"{name} a pixel": count / f.size for name, count in solution.events._asdict().items()}
    return {"energy": certificate.primal, **per_pixel}


def exact(runs: int) -> Iterator[Row]:
    """Compare the exact solver with PyMaxflow."""
    cases = [
        ("192×168", images.face(), 4, 1, "≥ 4"),
        ("512²", images.portrait(), 4, 1, "≥ 7"),
        ("1024²", images.large_portrait(), 4, 2, "≥ 15"),
        ("192×168", images.face(), 8, 1, ""),
        ("192×168", images.face(), 16, 1, ""),
        ("512²", images.portrait(), 8, 1, ""),
        ("512²", images.portrait(), 16, 1, ""),
    ]
    for name, f, neighborhood, threads, target in cases:
        for lam in LAMS if neighborhood == 4 else LAMS[1::2]:
            solvers: dict[str, Callable[[], Any]] = {
                "ours": partial(tv_l1, f, lam, neighborhood, threads=threads)  # type: ignore[arg-type]
            }
            if peers.installed("maxflow"):
                solvers["peer"] = peers.PyMaxflowDyadic(f, lam, neighborhood)
            timings, results = side_by_side(runs, solvers)
            facts = proven(f, lam, neighborhood, results["ours"])
            if "peer" in results:
                assert peers.energy(results["peer"], f, lam, neighborhood) == facts["energy"]
            group = f"exact, {neighborhood} neighbours, {threads} thread{'s'[: threads - 1]}; PyMaxflow"
            yield Row(group, f"{name}, λ {lam}", timings["ours"], timings.get("peer"), target, facts)


def throughput(runs: int) -> Iterator[Row]:
    """Solve many small images, two at a time and one by one."""
    batch = [np.roll(images.face(), shift, axis=1) for shift in range(0, 168, 4)]
    for lam in LAMS[1::2]:

        def in_threads(threads: int, lam: float = lam) -> list[NDArray[Any]]:
            with pool(threads) as run:
                return run(partial(tv_l1, lam=lam, threads=1), batch)

        timings, results = side_by_side(runs, {"two": partial(in_threads, 2), "one": partial(in_threads, 1)})
        assert all(map(np.array_equal, results["two"], results["one"]))
        for f, u in zip(batch, results["two"], strict=True):
            proven(f, lam, 4, u)
        case = f"{len(batch)} of 192×168, λ {lam}"
        yield Row("many images, 2 threads; 1 thread", case, timings["two"], timings["one"], "≥ 1.8")


def isotropic(runs: int) -> Iterator[Row]:
    """Compare the isotropic solver with OpenCV's."""
    f = images.portrait()
    for lam in LAMS:
        for iterations, target in ((1000, "≥ 10"), (30, "")):
            solvers: dict[str, Callable[[], Any]] = {"ours": partial(tv_l1_isotropic, f, lam, threads=2)}
            if peers.installed("cv2"):
                solvers["peer"] = partial(peers.opencv, f, lam, iterations)
            timings, results = side_by_side(runs, solvers)
            ours = results["ours"]
            facts = {"gap": ours.gap, "iterations": ours.iterations}
            case = f"512², λ {lam}"
            if "peer" in results:
                above = peers.isotropic_energy(results["peer"], f, lam) / ours.energy - 1
                facts["peer above ours"] = above
                case += f"; {iterations} iterations, energy {above:.1%} above ours"
            group = "isotropic to a gap of 0.1 %, 2 threads; OpenCV"
            yield Row(group, case, timings["ours"], timings.get("peer"), target, facts)


def scaling(runs: int) -> Iterator[Row]:
    """Solve the same content at growing sizes."""
    shapes = [(192, 168), (512, 256), (512, 512), (1024, 1024), (2048, 2048), (4096, 4096)]
    for lam in LAMS[1::2]:
        costs = {}
        for height, width in shapes:
            f = images.mosaic(height, width)
            few = runs if f.size < 2**22 else min(runs, 3)
            timings, results = side_by_side(few, {"ours": partial(tv_l1, f, lam, threads=1)})
            costs[f.size] = timings["ours"].median
            power = exponent(costs) if len(costs) > 1 else 1.0
            facts = {
                "pixels": f.size,
                "lam": lam,
                "exponent so far": power,
            }
            assert certify(f, results["ours"], lam).optimal
            last = (height, width) == shapes[-1]
            told = f", cost ∝ pixels^{power:.2f}" if last else ""
            case = f"{f.size / 1e6:.2f} MP, λ {lam}{told}"
            yield Row("growing sizes, 1 thread", case, timings["ours"], None, "≤ 1.08" if last else "", facts)


def depth_and_memory(runs: int) -> Iterator[Row]:
    """Compare 16 bits with 8, and weigh both."""
    f = images.portrait()
    deep = images.sixteen_bit(f)
    for lam in LAMS[1::2]:
        timings, results = side_by_side(
            runs, {"deep": partial(tv_l1, deep, lam, threads=1), "plain": partial(tv_l1, f, lam, threads=1)}
        )
        facts = proven(deep, lam, 4, results["deep"])
        case = f"512², λ {lam}, {timings['deep'].median / timings['plain'].median:.1f}× the time of 8 bits"
        yield Row("16 bits", case, timings["deep"], None, "≤ 3×", facts)
    large = images.mosaic(2048, 2048)
    tracemalloc.start()
    timings, _ = side_by_side(1, {"ours": partial(tv_l1, large, 0.8, threads=1)})
    peak = tracemalloc.get_traced_memory()[1] / large.size
    tracemalloc.stop()
    yield Row(
        "memory", f"4.2 MP, {peak:.1f} bytes a pixel", timings["ours"], None, "≤ 48", {"bytes a pixel": peak}
    )


def worst_cases(runs: int) -> Iterator[Row]:
    """Solve what might blow up, at two sizes: four times the pixels should cost about four times as much."""
    cases: dict[str, list[tuple[NDArray[Any], float]]] = {
        "photo, λ 0.02": [(images.mosaic(size, size), 0.02) for size in (512, 1024)]
    }
    small, large = images.hard(512), images.hard(1024)
    for name in small:
        for lam in (0.02, 0.2, 0.8):
            cases[f"{name}, λ {lam}"] = [(small[name], lam), (large[name], lam)]
    for case, sizes in cases.items():
        timings = []
        for f, lam in sizes:
            timing, results = side_by_side(runs, {"ours": partial(tv_l1, f, lam, threads=1)})
            assert certify(f, results["ours"], lam).optimal
            timings.append(timing["ours"])
        growth = timings[1].median / timings[0].median
        yield Row(
            "hard images, 512²",
            f"{case}; 1024² takes {growth:.1f}×",
            timings[0],
            None,
            "",
            {"growth": growth},
        )


# What a process prints: seconds to import, and of the first call.
_START = """
import time
start = time.perf_counter(); import relit; imported = time.perf_counter() - start
import numpy
start = time.perf_counter(); relit.tv_l1(numpy.eye(9), 0.2); first = time.perf_counter() - start
print(imported, first)
"""
_NUMBA = """
import time, numpy
start = time.perf_counter()
from numba import njit
@njit(cache=True)
def first(a):
    return a
first(numpy.eye(9)); print(0, time.perf_counter() - start)
"""


def start_up(runs: int) -> Iterator[Row]:
    """Time the import and the first calls, each in a process of its own."""
    with tempfile.TemporaryDirectory() as folder:
        for name, code in (("ours", _START), ("numba", _NUMBA)):
            script = Path(folder, f"start_{name}.py")  # numba caches what is in a file
            script.write_text(code)
            environment = {**os.environ, "NUMBA_CACHE_DIR": f"{folder}/{name}"}
            seconds = []
            for _ in range(runs + 1):
                done = subprocess.run(
                    [sys.executable, script], env=environment, capture_output=True, text=True, check=True
                )
                seconds.append([float(word) for word in done.stdout.split()])
            imports, calls = (Timing.of(list(times)) for times in zip(*seconds[1:], strict=True))
            if name == "ours":
                yield Row("start", "import relit", imports, None, "≤ 0.35 s")
                yield Row("start", "first call, compiling", Timing.of([seconds[0][1]]), None, "≤ 5 s")
                yield Row("start", "first call, cached", calls, None, "≤ 0.3 s")
            else:
                yield Row("start", "numba's own first call, cached, of a function that does nothing", calls)


GROUPS = (start_up, exact, throughput, isotropic, depth_and_memory, worst_cases, scaling)
