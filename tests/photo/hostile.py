"""Read hostile files in processes of their own, so that one that crashes or runs away fails by its name."""

from __future__ import annotations

import contextlib
import io
import multiprocessing
import os
import sys
import tempfile
import threading
import time
import warnings
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from relit.batch.manifest import Manifest
from relit.errors import RelitError
from relit.face.landmark_files import read_landmarks
from relit.photo.codecs.formats import FORMATS
from relit.photo.photo import Photo
from relit.photo.reading import read_image
from relit.photo.writing import not_kept, write_image
from relit.settings_file import read_settings

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator
    from multiprocessing.connection import Connection

    from hostile_corpus import Case

try:
    import resource
except ImportError:  # Windows
    resource = None  # type: ignore[assignment]

PHOTOS = {".jpg", ".png", ".tif", ".webp", ".ppm", ".bmp", ".exr", ".heic", ".dng"}
MANIFESTS = {".jsonl", ".parquet"}
SECONDS = 10
MEGABYTES = 2000
_LOSSLESS = {"PNG", "TIFF", "PPM", "PGM", "BMP"}
#: Far above what a case may take, so that one that takes too much is seen, and does not starve the machine.
_ADDRESS_SPACE = 5 << 30


class Verdict(NamedTuple):
    """What became of a case: what it broke, or nothing; and what it took."""

    case: Case
    fault: str
    outcome: str
    seconds: float
    megabytes: float


def check(path: Path) -> str:
    """Read a file; return what it held or "refused", and assert what must hold of either."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            if path.suffix == ".settings":
                read_settings(path)
                return "read"
            if path.suffix in MANIFESTS:
                for row in Manifest(str(path)):
                    assert_one_line(f"{path}: {row.problem}", path)
                return "read"
            if path.suffix not in PHOTOS:
                found = read_landmarks(path)
                assert found.points.shape[1] in (2, 3)
                assert np.isfinite(found.points).all()
                return "read"
            photo = read_image(path)
        except RelitError as error:
            assert_one_line(str(error), path)
            return "refused"
        assert_valid(photo)
        assert_writable(photo)
        return "read"


def assert_one_line(message: str, path: Path) -> None:
    """Hold a message to naming the file and being short."""
    assert message.startswith(f"{path}: "), f"does not name the file: {message}"
    message = message.removeprefix(f"{path}: ")
    assert message.isprintable(), f"is not one line: {message!r}"
    assert len(message) < 500, f"goes on and on: {message[:500]}"


def assert_valid(photo: Photo) -> None:
    """Hold a photo to what its class promises."""
    pixels, alpha = photo.pixels, photo.alpha
    assert pixels.dtype in (np.uint8, np.uint16, np.float32), pixels.dtype
    assert pixels.ndim == 2 or (pixels.ndim == 3 and pixels.shape[2] == 3), pixels.shape
    assert pixels.size
    assert alpha is None or (alpha.shape == pixels.shape[:2] and alpha.dtype == pixels.dtype)
    for plane in (pixels, alpha):
        if plane is not None and plane.dtype.kind == "f":
            assert plane.min() >= 0
            assert plane.max() <= 1


def assert_writable(photo: Photo) -> None:
    """Write a photo that is not too large to its own format, and read it again."""
    if photo.pixels.size > 1 << 20 or photo.format not in FORMATS:  # HEIC and camera raw are only read
        return
    own = FORMATS[photo.format]
    if own.longest and max(photo.pixels.shape[:2]) > own.longest:  # what others write, and libjpeg does not
        return
    if photo.alpha is not None and not own.alpha:
        photo = replace(photo, alpha=None)
    file = io.BytesIO()
    write_image(file, photo, format=photo.format)
    again = read_image(io.BytesIO(file.getvalue()))
    assert again.pixels.shape == photo.pixels.shape
    if photo.format in _LOSSLESS:
        np.testing.assert_array_equal(again.pixels, photo.pixels)
    told = photo.metadata
    if told.iptc or told.photoshop or told.text or told.comments or told.geo:
        for kind in ("PNG", "TIFF", *(["JPEG"] if photo.alpha is None else [])):
            file = io.BytesIO()
            write_image(file, photo, format=kind)
            again = read_image(io.BytesIO(file.getvalue()))
            assert (again.metadata.iptc, again.metadata.photoshop) == (told.iptc, told.photoshop), kind
            assert all(map(str.isprintable, not_kept("photo", photo, format=kind))), kind


def run(
    cases: Iterable[Case],
    examine: Callable[[Path], str] = check,
    *,
    seconds: float = SECONDS,
    patience: float = 60 * SECONDS,
    workers: int = 2,
) -> list[Verdict]:
    """Examine every case in one of several processes, which are replaced when they die or run away.

    The limit of `seconds` is on those that a process works; on a busy machine they take longer, but no
    longer than `patience`.
    """
    source = iter(cases)
    lock = threading.Lock()

    def take() -> Case | None:
        with lock:
            return next(source, None)

    with ThreadPoolExecutor(workers) as pool:
        return [
            verdict
            for part in pool.map(lambda _: list(_supervise(take, examine, seconds, patience)), range(workers))
            for verdict in part
        ]


def _supervise(
    take: Callable[[], Case | None], examine: Callable[[Path], str], seconds: float, patience: float
) -> Iterator[Verdict]:
    with contextlib.ExitStack() as stack:
        worker: _Worker | None = None
        while (case := take()) is not None:
            worker = worker or stack.enter_context(contextlib.closing(_Worker(examine, seconds, patience)))
            verdict = worker.check(case)
            # All cases together are gigabytes; kept is what has to be looked at.
            yield verdict if verdict.fault else verdict._replace(case=case._replace(data=b""))
            if verdict.fault:
                worker.close()
                worker = None


class _Worker:
    def __init__(self, examine: Callable[[Path], str], seconds: float, patience: float) -> None:
        self._patience = patience
        spawn = multiprocessing.get_context("spawn")
        self._pipe, theirs = spawn.Pipe()
        self._process = spawn.Process(target=_work, args=(theirs, examine, seconds), daemon=True)
        self._process.start()
        theirs.close()
        self._pipe.recv()  # once it has imported what it needs

    def check(self, case: Case) -> Verdict:
        start = time.perf_counter()
        try:
            self._pipe.send((case.extension, case.data))
            if self._pipe.poll(self._patience):
                fault, outcome, seconds, megabytes = self._pipe.recv()
                return Verdict(case, fault, outcome, seconds, megabytes)
            fault = f"runs for more than {self._patience} s"
        except (EOFError, OSError):
            self._process.join(60)
            fault = f"kills the process (exit code {self._process.exitcode})"
        return Verdict(case, fault, "", time.perf_counter() - start, 0)

    def close(self) -> None:
        self._process.kill()
        self._process.join()
        self._pipe.close()


def _work(pipe: Connection, examine: Callable[[Path], str], limit: float) -> None:
    """Answer the parent, case by case: what it broke, what became of it, seconds, peak memory so far."""
    _limit_memory()
    with tempfile.TemporaryDirectory() as folder:
        noise = os.open(Path(folder, "noise"), os.O_RDWR | os.O_CREAT)
        os.dup2(noise, 1)
        os.dup2(noise, 2)
        pipe.send("ready")
        while True:
            extension, data = pipe.recv()
            path = Path(folder, f"case{extension}")
            path.write_bytes(data)
            del data
            _forget_peak()
            start, spent = time.perf_counter(), time.process_time()
            outcome = fault = ""
            try:
                outcome = examine(path)
            except BaseException as error:
                fault = f"{type(error).__name__}: {str(error)[:2000]}"
            # Of a busy machine's seconds, only ours count.
            seconds = min(time.perf_counter() - start, time.process_time() - spent)
            peak = _peak_megabytes()
            sys.stdout.flush()
            sys.stderr.flush()
            faults = [fault] if fault else []
            if seconds > limit:
                faults.append(f"takes {seconds:.1f} s")
            if peak > MEGABYTES:
                faults.append(f"takes {peak:.0f} MB")
            if os.fstat(noise).st_size:
                faults.append(f"prints {os.pread(noise, 300, 0)!r}")
            pipe.send(("; ".join(faults), outcome, seconds, peak))


def _limit_memory() -> None:
    if resource is not None:
        with contextlib.suppress(ValueError, OSError):  # macOS knows the limit, but does not take it
            resource.setrlimit(resource.RLIMIT_AS, (_ADDRESS_SPACE, _ADDRESS_SPACE))


def _forget_peak() -> None:
    """Let the kernel measure the peak anew; where it cannot, the peak is that of all cases so far."""
    with contextlib.suppress(OSError):
        Path("/proc/self/clear_refs").write_text("5")


def _peak_megabytes() -> float:
    with contextlib.suppress(OSError):
        status = Path("/proc/self/status").read_text()
        return int(status.partition("VmHWM:")[2].split()[0]) / 1024
    if resource is None:
        return 0
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak / (1 << 20 if sys.platform == "darwin" else 1 << 10)
