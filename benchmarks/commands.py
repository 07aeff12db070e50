"""The whole command on photos as large as a camera's: wall time and peak memory of a process of its own."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from importlib.resources import files
from pathlib import Path

from PIL import Image

from benchmarks.measure import Timing
from benchmarks.rows import Row

_RELIT = "from relit.cli.app import main; main()"
_CASES = (
    (1, "", "≤ 1.2 s"),
    (1, "--method ltv", ""),
    (1, "--full-resolution", ""),
    (24, "", "≤ 2.5 s, ≤ 800 MB"),
    (24, "--light rembrandt", ""),
    (24, "--method ltv", "≤ 6 s"),
    (100, "", ""),
)


def command(runs: int) -> Iterator[Row]:
    """Run ``relit transfer`` on JPEGs."""
    # Installed, a package has its bytecode.
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for megapixels, words, target in _CASES:
            photos = [_photo(folder, "target.png", megapixels)]
            if "--light" not in words:
                photos.append(_photo(folder, "reference.jpg", megapixels))
            seconds, peaks = [], []
            for _ in range(runs):
                arguments = [
                    "transfer",
                    *map(str, photos),
                    "-o",
                    f"{folder}/out.jpg",
                    "--force",
                    *words.split(),
                ]
                start = time.perf_counter()
                process = subprocess.Popen([sys.executable, "-c", _RELIT, *arguments], env=environment)
                _, status, usage = os.wait4(process.pid, 0)
                seconds.append(time.perf_counter() - start)
                peaks.append(usage.ru_maxrss / 1024)
                assert status == 0, f"relit {' '.join(arguments)} failed"
            case = f"{megapixels} MP {words}; {max(peaks):.0f} MB at most"
            yield Row("relit transfer, 2 cores", case, Timing.of(seconds), None, target)


def _photo(folder: Path, sample: str, megapixels: int) -> Path:
    """Save a sample photo, enlarged to a portrait of so many megapixels."""
    path = folder / f"{Path(sample).stem}-{megapixels}.jpg"
    with (files("relit.photo") / "sample_photos" / sample).open("rb") as file, Image.open(file) as photo:
        width = round((megapixels * 1e6 * photo.width / photo.height) ** 0.5)
        size = width, round(megapixels * 1e6 / width)
        photo.convert("RGB").resize(size, Image.Resampling.BICUBIC).save(path, quality=92)
    return path
