"""What is done of a film, in a folder beside it, so that who starts again goes on there."""

from __future__ import annotations

import hashlib
import json
import shutil
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from relit.errors import ImageError, LandmarkError, OptionError, OutputError, RelitError
from relit.face.landmarks import Landmarks
from relit.photo.alone import alone_at

if TYPE_CHECKING:
    from collections.abc import Iterator


@contextmanager
def kept_state(output: Path, given: Any) -> Iterator[Path]:
    """Lend the folder in which what is done of a film is kept, for this process alone.

    What is there of other settings than `given`, or of a clip that was changed since, is thrown away. The
    folder goes when the film is whole, and stays when something stops the work.

    Raises
    ------
    OutputError
        If another process is at work on the film, or the folder cannot be made.
    """
    folder = output.with_name(f".{output.name}.relit-video")
    with ExitStack() as held:
        with suppress(NotImplementedError):  # the disk knows no locks
            lock = folder.with_name(f"{folder.name}.lock")
            held.enter_context(alone_at(output, lock, leaves_lock=False))
        try:
            _begin(folder, json.dumps(given, default=str, sort_keys=True))
        except OSError as error:
            reason = error.strerror or error
            raise OutputError(f"{folder}: cannot be written ({reason}); choose another place") from error
        try:
            yield folder
        except BaseException as error:
            # What was done is worth keeping, unless the same would go wrong again.
            again = isinstance(error, ImageError | LandmarkError | OptionError)
            if again or not (folder / "track.npz").exists():
                shutil.rmtree(folder, ignore_errors=True)
            if isinstance(error, OSError) and not isinstance(error, RelitError):
                raise OutputError(
                    f"{output}: cannot be written ({error.strerror or error}); make room, and give the same "
                    "command again"
                ) from error
            raise
        shutil.rmtree(folder, ignore_errors=True)  # the film is whole, whatever stays here


def _begin(folder: Path, told: str) -> None:
    """Make the folder, without what is in it of other settings."""
    note = folder / "given.json"
    if folder.exists() and (not note.exists() or note.read_text("utf-8", "replace") != told):
        shutil.rmtree(folder)
    folder.mkdir(exist_ok=True)
    note.write_text(told, "utf-8")


def stamp_of(path: str) -> list[Any]:
    """Return what changes when a file does."""
    told = Path(path).stat()
    return [str(Path(path).resolve()), told.st_size, told.st_mtime_ns]


def print_of(given: Any) -> str:
    """Return what only the same photo or landmarks have."""
    if isinstance(given, Landmarks):
        given = given.points
    profile = getattr(given, "profile", None)
    pixels = np.ascontiguousarray(getattr(given, "pixels", given))
    told = f"{pixels.dtype.str} {pixels.shape} {hashlib.sha256(profile or b'').hexdigest()} "
    return hashlib.sha256(told.encode() + pixels.tobytes()).hexdigest()
