"""One row, in a worker: read, relit, written; or why not."""

from __future__ import annotations

import json
from contextlib import nullcontext
from functools import lru_cache
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING, Any

from relit._version import VERSION
from relit.batch import places
from relit.batch.cache import DiskCache
from relit.batch.jobs import KINDS, File, Outcome
from relit.batch.kinds import WORK, Doing
from relit.batch.reading import SHELF
from relit.errors import OutputError, RelitError
from relit.runtime.timing import Stopwatch

if TYPE_CHECKING:
    from collections.abc import Sequence

    from relit.batch.jobs import Job, Plan
    from relit.settings.options import TransferOptions


def do(job: Job, plan: Plan, recorded: Outcome | None = None) -> Outcome:
    """Do a row, whatever becomes of it; only what ends the process itself is raised.

    Where files of its names are there, they are replaced if an earlier run is recorded to have written
    them, or if the plan forces it. Others stay, and the row fails, unless they are just what it gives, as
    after a run that was killed before it could record them.

    Where it is recorded how the row ended the last time, all that decides the result is as it was then, and
    the result is there unharmed, it stays.
    """
    watch, inputs = Stopwatch(), tuple[File, ...]()
    earlier = recorded.files if recorded else ()
    try:
        if recorded and is_settled(job, plan, recorded):
            return recorded
        with _cache(plan.cache, plan.cache_bytes).open() if plan.cache else nullcontext():
            with watch("read"):
                held = SHELF.read(job.inputs)
                inputs = tuple(held[place].file for place in job.inputs)
            recipe = recipe_of(job, plan.kind, [file.digest for file in inputs])
            if recorded and recorded.recipe == recipe and (files := _unharmed(job, plan, earlier)):
                return Outcome(job.output, "", recipe, inputs, files, recorded.measured, recorded.not_kept)
            row = Doing(job, held, watch)
            made = WORK[plan.kind](row)
        with watch("write"):
            files = tuple(
                _write(places.join(plan.folder, name), data, replaceable=plan.force or bool(earlier))
                for name, data in zip(job.files(plan.kind), made, strict=True)
            )
    except RelitError as error:
        reason = str(error)
    except MemoryError:
        reason = "not enough memory for photos of this size; use fewer workers"
    except Exception as error:  # the run goes on, whatever is wrong with one row
        reason = f"{type(error).__name__}: {error}; this is a bug, please report it"
    else:
        return Outcome(job.output, "", recipe, inputs, files, _seconds(watch) | row.measured, row.not_kept)
    return Outcome(job.output, reason, "", inputs, earlier, _seconds(watch))


def is_settled(job: Job, plan: Plan, recorded: Outcome) -> bool:
    """Return whether a row is done: of the same photos and settings, and its files still there.

    Files count as the same where their `places.version_of` is; where that differs, `do` looks at what they
    hold.
    """
    now = [*job.inputs, *(places.join(plan.folder, name) for name in job.files(plan.kind))]
    then = [file.version for file in (*recorded.inputs, *recorded.files)]
    return (
        not recorded.reason
        and len(now) == len(then)
        and recipe_of(job, plan.kind, [file.digest for file in recorded.inputs]) == recorded.recipe
        and None not in then
        and all(places.version_of(place) == version for place, version in zip(now, then, strict=True))
    )


def recipe_of(job: Job, kind: str, digests: Sequence[str]) -> str:
    """Return a digest of all that decides what a row writes; `digests` are those of `Job.inputs`."""
    roles = [job.target_landmarks is not None, job.reference_landmarks is not None]
    # Landmark files may hold the name of the photo.
    named = Path(job.target).name if kind == "landmarks" else ""
    given = [*_settings_of(job.options, kind), Path(job.output).suffix.lower(), named, roles, list(digests)]
    return sha256(json.dumps(given).encode()).hexdigest()


@lru_cache(maxsize=1024)
def _settings_of(options: TransferOptions, kind: str) -> tuple[Any, ...]:
    return VERSION, kind, [(name, getattr(options, name)) for name in KINDS[kind].options]


def _seconds(watch: Stopwatch) -> dict[str, float]:
    return {f"seconds_{stage.replace(' ', '_')}": round(taken, 4) for stage, taken in watch.seconds.items()}


def _unharmed(job: Job, plan: Plan, files: Sequence[File]) -> tuple[File, ...]:
    """Return the files of a row as they are, if they hold what they did; else none."""
    wheres = [places.join(plan.folder, name) for name in job.files(plan.kind)]
    if len(wheres) != len(files) or not all(map(places.exists, wheres)):
        return ()
    versions = [places.version_of(where) for where in wheres]
    digests = [sha256(places.read_bytes(where)).hexdigest() for where in wheres]
    return tuple(map(File, digests, versions)) if digests == [file.digest for file in files] else ()


def _write(place: str, data: bytes, *, replaceable: bool) -> File:
    try:
        places.write_atomically(place, data, overwrite=replaceable)
    except OutputError:
        if replaceable or not places.exists(place):
            raise
        # There before, or put there this moment, as by a worker of a run that was killed.
        found = places.read_bytes(place)
        if found == b"":  # what a kill leaves behind on a file system without hard links
            places.write_atomically(place, data, overwrite=True)
        elif found != data:
            raise OutputError(
                f"{place}: exists already, and this batch did not write it; move it away, or use --force"
            ) from None
    return File(sha256(data).hexdigest(), places.version_of(place))


@lru_cache(maxsize=1)
def _cache(folder: str, most_bytes: int) -> DiskCache:
    return DiskCache(Path(folder), most_bytes)
