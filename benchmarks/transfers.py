"""What a transfer costs in a warm process, and how that grows; and what other tools cost beside it."""

from __future__ import annotations

import shlex
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any
from unittest.mock import patch

import relit
from benchmarks.faces import crops, given, pair
from benchmarks.measure import Timing, exponent, side_by_side
from benchmarks.rows import Row
from relit.face import face_models
from relit.runtime.threads import limit

_SIDES = (256, 512, 1024, 2048, 4096, 10_000)  # px: .07 to 100 MP
_BATCHES = (2, 4, 8, 12)  # N = M
_RELIT = "from relit.cli.app import main; main()"


def transfers(runs: int) -> Iterator[Row]:
    """Relight pairs of photos in memory."""
    target, reference = pair(512)
    known = given(target, reference)
    small, other = pair(256)
    images = list(crops("target", 8, 256))
    augment = relit.RelightAugment(
        [face.pixels for face in crops("reference", 4, 256)],
        reference_landmarks=[face.landmarks for face in crops("reference", 4, 256)],
        p=1.0,
        seed=0,
    )
    augment.prepare()

    def augmented() -> None:
        with limit(1):
            for face in images:
                augment(face.pixels, landmarks=face.landmarks)

    cases: dict[str, tuple[Callable[[], Any], str]] = {
        "512², faces to be found": (lambda: relit.transfer(target.pixels, reference.pixels), "≤ 0.35 s"),
        "512², landmarks given": (
            lambda: relit.transfer(target.pixels, reference.pixels, **known),
            "≤ 0.20 s",
        ),
        "512², a light by name": (
            lambda: relit.transfer(target.pixels, light="loop", **given(target, None)),
            "≤ 0.15 s",
        ),
        "512², landmarks given, ltv": (
            lambda: relit.transfer(target.pixels, reference.pixels, method="ltv", **known),
            "",
        ),
        "256², landmarks given": (
            lambda: relit.transfer(small.pixels, other.pixels, **given(small, other)),
            "≤ 0.08 s",
        ),
        "RelightAugment, 8 of 256² relit before, landmarks given, one thread": (augmented, "≤ 0.53 s"),
    }
    for function, _ in cases.values():
        function()  # what a process does once
    timings, _ = side_by_side(max(runs, 9), {name: function for name, (function, _) in cases.items()})
    for name, timing in timings.items():
        yield Row("relit.transfer, warm", name, timing, None, cases[name][1])


def detection(runs: int) -> Iterator[Row]:
    """Find the face in a portrait of 1 MP, and count the runs of the networks."""
    photo = next(crops("reference", 1, 1024)).pixels
    relit.detect_landmarks(photo)
    with patch.object(face_models, "_run", wraps=face_models._run) as run:
        relit.detect_landmarks(photo)
    timings, _ = side_by_side(max(runs, 9), {"ours": lambda: relit.detect_landmarks(photo)})
    case = f"1 MP, {run.call_count} runs of networks"
    yield Row("relit.detect_landmarks, warm", case, timings["ours"], None, "≤ 3 runs")


def pixels(runs: int) -> Iterator[Row]:
    """Relight larger and larger photos."""
    costs = {}
    for side in _SIDES:
        target, reference = pair(side)
        work = {"ours": lambda t=target, r=reference: relit.transfer(t.pixels, r.pixels, **given(t, r))}
        work["ours"]()
        timing = side_by_side(runs, work)[0]["ours"]
        costs[side * side] = timing.median
        power = f", cost ∝ pixels^{exponent(costs):.2f}" if side == _SIDES[-1] else ""
        case = f"{side * side / 1e6:.2f} MP, landmarks given{power}"
        yield Row("growing photos", case, timing, facts={"megapixels": side * side / 1e6})


def rival(runs: int, command: str) -> Iterator[Row]:
    """Relight one pair of 512² by another tool's command, in turn with ours: whole processes."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        paths = {part: str(folder / f"{part}.png") for part in ("target", "reference", "output")}
        for face, part in zip(pair(512), ("target", "reference"), strict=True):
            relit.write_image(paths[part], face.pixels)
        theirs = [word.format(**paths) for word in shlex.split(command)]
        ours = [sys.executable, "-c", _RELIT, "transfer", paths["target"], paths["reference"]]
        ours += ["-o", str(folder / "ours.png"), "--force"]
        work = {
            side: lambda words=words: subprocess.run(words, check=True, stdout=subprocess.DEVNULL)
            for side, words in (("ours", ours), ("theirs", theirs))
        }
        timings, _ = side_by_side(runs, work)
        made = relit.read_image(paths["output"]).pixels.shape
        assert made[:2] == (512, 512), f"{command}: expected a picture of 512², got {made}"
        yield Row("whole command", f"512²; {theirs[0]}", timings["ours"], timings["theirs"])


def batches(runs: int) -> Iterator[Row]:
    """Relight N × M pairs of 512² by ``relit batch`` in two processes; starting and finding faces count."""
    costs: dict[int, float] = {}
    with tempfile.TemporaryDirectory() as name:
        for side in _BATCHES:
            folder = Path(name, str(side))
            for sample in ("target", "reference"):
                (folder / sample).mkdir(parents=True)
                for number, face in enumerate(crops(sample, side, 512)):
                    relit.write_image(folder / sample / f"{number}.png", face.pixels)
            words = [sys.executable, "-c", _RELIT, "batch", "--jobs", "2"]
            for sample in ("target", "reference"):
                words += [f"--{sample}s", f"{folder}/{sample}/*.png"]
            seconds = []
            for turn in range(max(runs // 2, 1)):
                start = time.perf_counter()
                subprocess.run([*words, "-o", f"{folder}/out-{turn}"], check=True, capture_output=True)
                seconds.append(time.perf_counter() - start)
            timing = Timing.of(seconds)
            costs[side**2] = timing.median
            case, last = (
                f"{side} × {side}, {side**2 / timing.median:.1f} pairs/s",
                side == _BATCHES[-1],
            )
            case += f", cost ∝ pairs^{exponent(costs):.2f}" if last else ""
            yield Row("relit batch, two processes, 512²", case, timing, None, "≥ 6 pairs/s" if last else "")
