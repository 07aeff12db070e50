"""What is done of a film, in a folder beside it, so that who starts again goes on there."""

from __future__ import annotations

import json
import shutil
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from filelock import FileLock, Timeout

from relit.errors import ImageError, LandmarkError, OptionError, OutputError

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
    note, told = folder / "given.json", json.dumps(given, default=str, sort_keys=True)
    lock = FileLock(folder.with_name(f"{folder.name}.lock"))
    try:
        lock.acquire(timeout=0)
    except Timeout:
        raise OutputError(
            f"{output}: another run is at work on this film; wait for it, or choose another name"
        ) from None
    except OSError as error:
        raise OutputError(f"{output}: cannot be written ({error.strerror}); choose another place") from error
    try:
        if folder.exists() and (not note.exists() or note.read_text("utf-8") != told):
            shutil.rmtree(folder)
        folder.mkdir(exist_ok=True)
        note.write_text(told, "utf-8")
        yield folder
        shutil.rmtree(folder)
    except BaseException as error:
        # What was done is worth keeping, unless the same would go wrong again.
        again = isinstance(error, ImageError | LandmarkError | OptionError)
        if again or not (folder / "track.npz").exists():
            shutil.rmtree(folder, ignore_errors=True)
        raise
    finally:
        lock.release()
        Path(lock.lock_file).unlink(missing_ok=True)
