"""One row, in a worker: read, relit, written; or why not."""

from __future__ import annotations

import json
from contextlib import AbstractContextManager, nullcontext
from dataclasses import replace
from functools import lru_cache
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING, Any

from relit._version import VERSION
from relit.batch import places
from relit.batch.cache import DiskCache
from relit.batch.jobs import KINDS, File, Outcome
from relit.batch.kinds import WORK
from relit.batch.reading import SHELF, Content
from relit.batch.stamps import stamp_of
from relit.errors import OutputError, RelitError
from relit.runtime.timing import Stopwatch

if TYPE_CHECKING:
    from collections.abc import Sequence

    from relit.batch.jobs import Job, Plan
    from relit.settings.options import TransferOptions


def do(job: Job, plan: Plan, recorded: Outcome | None = None) -> Outcome:
    """Do a row, whatever becomes of it.

    Where files of its names are there, they are replaced if an earlier run is recorded to have written
    them, or if the plan forces it. Others stay, and the row fails, unless they are just what it gives, as
    after a run that was killed before it could record them.

    Parameters
    ----------
    job : Job
    plan : Plan
    recorded : Outcome, optional
        How the row ended the last time. If all that decides the result is as it was then, and the result is
        there unharmed, it stays.

    Returns
    -------
    Outcome
        Failed rows tell the reason; only what ends the process itself is raised.
    """
    watch = Stopwatch()
    earlier = recorded.files if recorded else ()
    failed = Outcome(job.number, job.output, "failed", files=earlier)
    inputs: tuple[File, ...] = ()
    try:
        if recorded and is_settled(job, plan, recorded):
            return replace(recorded, number=job.number)
        with _reuse(plan.cache, plan.cache_bytes):
            with watch("read"):
                held = SHELF.read(job.inputs)
                inputs = tuple(held[place].file for place in job.inputs)
            made = recipe(job, plan.kind, [file.digest for file in inputs])
            if recorded and recorded.made == made and (files := _unharmed(job, plan, earlier)):
                return replace(recorded, number=job.number, inputs=inputs, files=files)
            done = WORK[plan.kind](job, held, watch)
        with watch("write"):
            files = tuple(
                _write(places.join(plan.folder, name), data, replaceable=plan.force or bool(earlier))
                for name, data in zip(job.files(plan.kind), done.files, strict=True)
            )
    except RelitError as error:
        return replace(failed, reason=str(error), inputs=inputs, seconds=watch.seconds)
    except MemoryError:
        return replace(failed, reason="not enough memory for photos of this size; use fewer workers")
    except Exception as error:  # the run goes on, whatever is wrong with one row
        return replace(failed, reason=f"{type(error).__name__}: {error}; this is a bug, please report it")
    confidence = {
        role: marks.confidence for role, marks in done.landmarks.items() if marks.confidence is not None
    }
    seconds = {stage: round(taken, 4) for stage, taken in watch.seconds.items()}
    return Outcome(job.number, job.output, "ok", "", made, inputs, files, seconds, confidence, done.metrics)


def is_settled(job: Job, plan: Plan, recorded: Outcome) -> bool:
    """Return whether a row is done: of the same photos and settings, and its files still there.

    Files count as the same where neither their size nor the time of their last change differs; where one
    does, `do` looks at what they hold.
    """
    if recorded.status != "ok":
        return False
    known = [(place, file.stamp) for place, file in zip(job.inputs, recorded.inputs, strict=False)]
    files = job.files(plan.kind)
    known += [
        (places.join(plan.folder, name), file.stamp)
        for name, file in zip(files, recorded.files, strict=False)
    ]
    return (
        len(known) == len(job.inputs) + len(files)
        and recipe(job, plan.kind, [file.digest for file in recorded.inputs]) == recorded.made
        and all(stamp is not None and stamp_of(place) == stamp for place, stamp in known)
    )


def recipe(job: Job, kind: str, digests: Sequence[str]) -> str:
    """Return a digest of all that decides what a row writes.

    Parameters
    ----------
    job : Job
    kind : str
    digests : sequence of str
        Of `Job.inputs`.
    """
    roles = [job.target_landmarks is not None, job.reference_landmarks is not None]
    # Landmark files may hold the name of the photo.
    named = Path(job.target).name if kind == "landmarks" else ""
    given = [*_recipe_of(job.options, kind), Path(job.output).suffix.lower(), named, roles, list(digests)]
    return sha256(json.dumps(given).encode()).hexdigest()


@lru_cache(maxsize=1024)
def _recipe_of(options: TransferOptions, kind: str) -> tuple[Any, ...]:
    return VERSION, kind, [(name, getattr(options, name)) for name in KINDS[kind].options]


def _unharmed(job: Job, plan: Plan, files: Sequence[File]) -> tuple[File, ...]:
    """Return the files of a row as they are, if they hold what they did; else none."""
    wheres = [places.join(plan.folder, name) for name in job.files(plan.kind)]
    if len(wheres) != len(files) or not all(map(places.exists, wheres)):
        return ()
    found = tuple(Content(where, stamp_of(where), places.read_bytes(where)).file for where in wheres)
    return found if [file.digest for file in found] == [file.digest for file in files] else ()


def _write(place: str, data: bytes, *, replaceable: bool) -> File:
    if not replaceable and places.exists(place):
        found = places.read_bytes(place)
        # An empty file is what a kill leaves behind on a file system without hard links.
        if found not in (b"", data):
            raise OutputError(
                f"{place}: exists already, and this batch did not write it; move it away, or use --force"
            )
        replaceable = True
    places.write_atomically(place, data, overwrite=replaceable)
    return File(sha256(data).hexdigest(), stamp_of(place))


@lru_cache(maxsize=1)
def _cache(folder: str, most_bytes: int) -> DiskCache:
    return DiskCache(Path(folder), most_bytes)


def _reuse(folder: str | None, most_bytes: int) -> AbstractContextManager[None]:
    return _cache(folder, most_bytes).open() if folder else nullcontext()
