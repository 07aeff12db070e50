"""What ``relit batch`` costs a pair, and what it adds: ``python -m benchmarks.batch``.

Photos are crops of the samples, all different; every target goes with every reference. Costs are marginal:
those of a long run less those of a short one, by the pairs between, so that starting counts nothing.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import threading
import time
from importlib.resources import files
from pathlib import Path

import click
import numpy as np
from PIL import Image

import relit
from relit.landmark_files import read_landmarks, write_landmarks

_RELIT = "from relit.cli import main; main()"
_SHORT = 4  # rows
_SIZES = {256: (10, 10), 512: (8, 8), 1024: (6, 6)}  # px → targets and references


@click.command(help=__doc__)
@click.option("--rows", default=10_000, show_default=True, help="Of the long run, of small photos.")
@click.option("--method", default="shading", show_default=True)
def main(rows: int, method: str) -> None:
    """Run the benchmarks."""
    with tempfile.TemporaryDirectory() as name:
        for size, (targets, references) in _SIZES.items():
            _costs(Path(name, str(size)), size, targets, references, method)
        if rows:
            _long_run(Path(name, "long"), rows)


def _costs(folder: Path, size: int, targets: int, references: int, method: str) -> None:
    _photos(folder / "t", "target.png", targets, size)
    _photos(folder / "r", "reference.jpg", references, size)
    _manifest(folder, targets * references)
    given = ["batch", str(folder / "pairs.csv"), "--method", method, "--cache-size", "0"]
    one = _marginal([*given, "--jobs", "1"], folder / "one", targets * references, alone=True)
    two = _marginal([*given, "--jobs", "2"], folder / "two", targets * references)
    bare = _bare(folder, method)
    for path in sorted((folder / "one").glob("*.png")):
        assert path.read_bytes() == (folder / "two" / path.name).read_bytes(), path
    found = ["batch", "--targets", str(folder / "t/*.png"), "--references", str(folder / "r/*.png")]
    all_in = _marginal([*found, "--method", method, "--jobs", "2"], folder / "all", targets * references)
    click.echo(
        f"{size}²: a pair {one:.3f} s on one core, {two:.3f} s on two ({one / two:.2f}×); read, transfer and "
        f"write in a loop {bare:.3f} s ({one / bare - 1:+.1%}); 1000 pairs {1000 * two / 60:.1f} min, and "
        f"{1000 * all_in / 60:.1f} min where {targets + references} faces are to be found as well"
    )


def _marginal(command: list[str], output: Path, rows: int, *, alone: bool = False) -> float:
    """Return the seconds a row takes once the run is under way, on one core or on all."""
    walls = []
    for limit, place in ((_SHORT, f"{output}-short"), (rows, f"{output}")):
        start = time.perf_counter()
        arguments = [*command, "-o", place, "--limit", str(limit)]
        core = ["taskset", "-c", "0"] if alone else []
        subprocess.run([*core, sys.executable, "-c", _RELIT, *arguments], check=True)
        walls.append(time.perf_counter() - start)
    return (walls[1] - walls[0]) / (rows - _SHORT)


def _bare(folder: Path, method: str) -> float:
    """Return the seconds that a pair takes in a loop on one core."""
    script = "import sys, time; from benchmarks.batch import loop; print(loop(sys.argv[1], sys.argv[2]))"
    command = ["taskset", "-c", "0", sys.executable, "-c", script, str(folder), method]
    return float(subprocess.run(command, check=True, capture_output=True, text=True).stdout)


def loop(folder: str, method: str) -> float:
    """Relight pairs as a short script would; return the seconds of one."""
    pairs = [
        (target, reference)
        for target in sorted(Path(folder, "t").glob("*.png"))
        for reference in sorted(Path(folder, "r").glob("*.png"))
    ]
    seconds = []
    for target, reference in pairs:
        start = time.perf_counter()
        photo, light = relit.read_image(target), relit.read_image(reference)
        here, there = (read_landmarks(path.with_suffix(".json")) for path in (target, reference))
        result = relit.transfer(photo, light, target_landmarks=here, reference_landmarks=there, method=method)
        relit.write_image(Path(folder, "bare.png"), result.image, like=photo, overwrite=True)
        seconds.append(time.perf_counter() - start)
    return float(np.mean(seconds[_SHORT:]))


def _long_run(folder: Path, rows: int) -> None:
    """Watch the memory of the workers over many rows."""
    _photos(folder / "t", "target.png", 100, 96)
    _photos(folder / "r", "reference.jpg", rows // 100, 96)
    _manifest(folder, rows)
    start = time.perf_counter()
    command = ["batch", str(folder / "pairs.csv"), "-o", str(folder / "out"), "--jobs", "2"]
    process = subprocess.Popen([sys.executable, "-c", _RELIT, *command])
    peaks: list[float] = []
    done = threading.Event()

    def watch() -> None:
        while not done.wait(2):
            peaks.append(max((_resident(pid) for pid in _children(process.pid)), default=0.0))

    watcher = threading.Thread(target=watch)
    watcher.start()
    process.wait()
    done.set()
    watcher.join()
    assert process.returncode == 0
    wall = time.perf_counter() - start
    tenth = max(len(peaks) // 10, 1)
    click.echo(
        f"{rows} rows of 96² in {wall:.0f} s ({wall / rows:.3f} s a row); the largest worker held "
        f"{max(peaks[: 2 * tenth]):.0f} MB in the first fifth, {max(peaks[-2 * tenth :]):.0f} MB in the "
        f"last, {max(peaks):.0f} MB at most; the command itself {_peak_of_self():.0f} MB"
    )


def _peak_of_self() -> float:
    import resource

    return resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1024


def _children(pid: int) -> list[int]:
    found = []
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit():
            try:
                parent = int((entry / "stat").read_text().rsplit(")", 1)[1].split()[1])
            except (OSError, ValueError):
                continue
            if parent == pid:
                found.append(int(entry.name))
    return found


def _resident(pid: int) -> float:
    try:
        pages = int(Path(f"/proc/{pid}/statm").read_text().split()[1])
    except (OSError, ValueError):
        return 0.0
    return pages * os.sysconf("SC_PAGESIZE") / 2**20


def _photos(folder: Path, sample: str, count: int, size: int) -> None:
    """Save crops of a sample photo, each a little elsewhere, with their landmarks."""
    folder.mkdir(parents=True)
    draw = np.random.default_rng(0)
    with (files("relit") / "sample_photos" / sample).open("rb") as file, Image.open(file) as opened:
        photo = opened.convert("RGB")
    found = relit.detect_landmarks(np.asarray(photo))
    left, top = found.xy.min(axis=0)
    right, bottom = found.xy.max(axis=0)
    side = 1.5 * max(right - left, bottom - top)
    for k in range(count):
        x, y = (np.array([left + right, top + bottom]) - side) / 2 + draw.uniform(-0.06, 0.06, 2) * side
        x, y = max(x, 0.0), max(y, 0.0)
        box = (x, y, min(x + side, photo.width), min(y + side, photo.height))
        crop = photo.resize((size, size), Image.Resampling.BICUBIC, box=box)
        crop.save(folder / f"{k:04}.png")
        scale = np.array([size / (box[2] - box[0]), size / (box[3] - box[1])])
        points = found.points.copy()
        points[:, :2] = (points[:, :2] + 0.5 - box[:2]) * scale - 0.5
        points[:, 2] *= scale.mean()
        write_landmarks(folder / f"{k:04}.json", relit.Landmarks(points, found.scheme))


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
