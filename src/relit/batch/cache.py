"""Results of expensive steps on disk, for all processes of a machine and for the next run.

An entry is a file of arrays (npz, never pickles, so that reading one runs nothing) with a checksum: what is
torn or damaged is computed again. Its name is the hash of what the step was given and of the code that
would compute it. Two locks, which the system frees when their process dies, keep the processes apart: under
the first, one of them computes what all of them want; under the second, entries come and go, and a ledger
says how large they are together.
"""

from __future__ import annotations

import os
import time
import warnings
from contextlib import contextmanager, suppress
from functools import cache
from hashlib import blake2b
from importlib.metadata import PackageNotFoundError, version
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

import joblib
import numpy as np
from filelock import FileLock

import relit
from relit.batch.forms import FORMS, OF_TARGETS
from relit.errors import OptionError, OutputError
from relit.photo.atomic_files import save_atomically
from relit.runtime.memo import Keeper, Made, Memo

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from numpy.typing import NDArray

    from relit.batch.forms import Arrays

_TARGETS = 150_000_000  # bytes in memory: the largest faces that are looked at, in all their steps
_PATIENCE = 120.0  # s to wait for what another process computes; then it is computed here as well
_LIBRARIES = (
    *("numpy", "numba", "pillow", "opencv-python-headless"),
    *("imagecodecs", "tifffile", "ai-edge-litert", "joblib"),
)
_DIGEST = 16  # bytes of a checksum
_LEDGER = 20  # digits; a torn ledger is shorter


class DiskCache(Keeper):
    """Splits, faces and fetched files on disk, and the steps on the last targets in memory.

    Processes that use one folder share what it holds, and where several want the same at once, one computes
    it. Entries hold no more than `most_bytes`; those least recently used go first. Where nothing can be
    written, all goes on without, with a warning. Results are those of computing, bit by bit.
    """

    def __init__(self, folder: Path, most_bytes: int) -> None:
        if not isinstance(most_bytes, int) or isinstance(most_bytes, bool) or most_bytes < 0:
            raise OptionError(f"most_bytes: expected an integer of 0 or more, got {most_bytes!r}")
        # Entries are deleted by age, so that they live apart from what else may be in the folder.
        self._folder, self._most_bytes = Path(folder, "relit-cache"), most_bytes
        self._targets, self._warned = Memo(_TARGETS), False
        try:
            self._folder.mkdir(parents=True, exist_ok=True)
        except (FileExistsError, NotADirectoryError) as error:
            raise OutputError(f"{folder}: is no folder, and cannot hold a cache; name another") from error
        except OSError as error:
            self._go_on_without(error)

    def recall(self, step: Callable[..., Made], given: dict[str, Any], go_on: Callable[[], None]) -> Made:
        """Return what a step gives, without doing it if that is kept."""
        if step in OF_TARGETS:
            return self._targets.recall(step, given, go_on)
        if step not in FORMS:
            go_on()
            return step(**given)
        apart, together = FORMS[step]
        name = joblib.hash((_makers(), step.__name__, given))
        path = self._folder / f"{step.__name__}-{name}.npz"
        arrays = _read(path)
        if arrays is None:
            with self._alone(name[:3]):
                arrays = _read(path)  # by whom this one waited for
                if arrays is None:
                    go_on()
                    made = step(**given)
                    self._keep(path, apart(made))
                    return made
        return together(arrays)  # type: ignore[no-any-return]

    @contextmanager
    def _alone(self, what: str) -> Iterator[bool]:
        """Keep the others out, and say whether that worked."""
        lock = FileLock(self._folder / f"{what}.lock")
        try:
            lock.acquire(_PATIENCE, poll_interval=0.01)
        except (OSError, NotImplementedError) as error:
            self._go_on_without(error)
        try:
            yield lock.is_locked
        finally:
            lock.release()

    def _keep(self, path: Path, arrays: Arrays) -> None:
        stream = BytesIO()
        np.savez(stream, allow_pickle=False, **arrays)
        stream.write(_digest(stream.getvalue()))
        content = stream.getvalue()
        if len(content) > self._most_bytes:
            return
        with self._alone("ledger") as alone:
            if not alone:
                return
            try:
                self._make_room(len(content))
                save_atomically(path, content, overwrite=True)
                _touch(path)
            except OSError as error:
                self._go_on_without(error)

    def _make_room(self, size: int) -> None:
        """Enter in the ledger what comes, before it does, and let go what it displaces."""
        ledger = self._folder / "ledger"
        try:
            text = ledger.read_text("ascii")
            held = int(text) if len(text) == _LEDGER else self._most_bytes
        except (OSError, ValueError):
            held = self._most_bytes
        if held + size > self._most_bytes:
            # An eighth more than need be: all entries have to be looked at, and so seldom.
            held = self._shrink(min(self._most_bytes - size, self._most_bytes * 7 // 8))
        ledger.write_text(f"{held + size:0{_LEDGER}}", "ascii")

    def _shrink(self, most_bytes: int) -> int:
        """Delete what killed processes left, and the entries not asked for longest; return what remains."""
        for left in self._folder.glob(".relit-*.tmp"):
            left.unlink(missing_ok=True)
        entries = [(path.stat(), path) for path in self._folder.glob("*.npz")]
        now, held = time.time_ns(), 0
        for state, path in sorted(entries, key=lambda entry: _asked_for(entry[0], now), reverse=True):
            if held + state.st_size > most_bytes:
                path.unlink(missing_ok=True)
                most_bytes = held  # whatever is older goes as well
            else:
                held += state.st_size
        return held

    def _go_on_without(self, error: OSError | NotImplementedError) -> None:
        if not self._warned:
            self._warned = True
            cause = error.__cause__ or error
            reason = getattr(cause, "strerror", None) or cause
            warnings.warn(
                f"{self._folder}: cannot keep results ({reason}), and goes on without; free some space, or "
                "choose another folder",
                RuntimeWarning,
                stacklevel=2,
            )


def _read(path: Path) -> dict[str, NDArray[Any]] | None:
    """Return the arrays of an entry, None if there is none or it is damaged."""
    try:
        whole = memoryview(path.read_bytes())
    except OSError:
        return None
    content, digest = whole[:-_DIGEST], whole[-_DIGEST:]
    if digest != _digest(content):
        return None
    with suppress(OSError):  # of a folder that can only be read
        _touch(path)
    with np.load(BytesIO(content), allow_pickle=False) as arrays:
        return dict(arrays)


def _asked_for(state: os.stat_result, now: int) -> int:
    """Return when an entry was asked for; one from the future is from before a clock was set back."""
    return state.st_mtime_ns if state.st_mtime_ns <= now else 0


def _touch(path: Path) -> None:
    """Say that an entry was asked for, more finely than the file system's clock would."""
    now = time.time_ns()
    os.utime(path, ns=(now, now))


def _digest(content: bytes | memoryview) -> bytes:
    return blake2b(content, digest_size=_DIGEST).digest()


def versions() -> dict[str, str]:
    """Return the versions of the libraries that results depend on, down to their last bits."""
    found = dict.fromkeys(_LIBRARIES, "unknown")
    for name in _LIBRARIES:
        with suppress(PackageNotFoundError):  # installed in another way than by pip
            found[name] = version(name)
    return found


@cache
def _makers() -> str:
    """Return the hash of what results depend on, besides what a step is given."""
    sources = sorted(Path(relit.__file__).parent.rglob("*.py"))
    return str(joblib.hash([relit.__version__, versions(), *(source.read_bytes() for source in sources)]))
