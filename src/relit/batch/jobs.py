"""What a batch is made of: rows as they are given, jobs as they are done, outcomes as they are recorded."""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from functools import lru_cache
from typing import TYPE_CHECKING, Any, NamedTuple

from relit.settings.options import TransferOptions

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    Rows = Iterable["Row"]  # gone through several times, the same each time, and never all held at once


@dataclass(frozen=True)
class Kind:
    """A kind of work."""

    options: tuple[str, ...]  # the fields of `TransferOptions` that count
    suffix: str | None = None  # of the file that is written, if none is chosen; None for that of the target
    parts: tuple[str, ...] = ()  # names of the files in the folder that is written; none where it is one file


KINDS = {
    "transfer": Kind(tuple(option.name for option in fields(TransferOptions))),
    "normalize": Kind(("lam", "neighborhood")),
    "decompose": Kind(("lam", "neighborhood"), suffix="", parts=("u.png", "v.png")),
    "landmarks": Kind((), suffix=".json"),
}


class Row(NamedTuple):
    """A row as it is given; its options count more than the command's."""

    number: int  # from 1; blank rows are not counted
    target: str = ""
    reference: str | None = None
    output: str | None = None
    target_landmarks: str | None = None
    reference_landmarks: str | None = None
    options: tuple[tuple[str, Any], ...] = ()
    problem: str = ""  # why it cannot be a job, if it cannot


@dataclass(frozen=True, slots=True)
class Job:
    """A row that can be tried."""

    target: str
    reference: str | None
    output: str  # below the folder of the batch, ``/`` between folders: a file, or for decompose a folder
    target_landmarks: str | None
    reference_landmarks: str | None
    options: TransferOptions

    @property
    def inputs(self) -> tuple[str, ...]:
        """The places that are read."""
        places = (self.target, self.target_landmarks, self.reference, self.reference_landmarks)
        return tuple(place for place in places if place is not None)

    def files(self, kind: str) -> tuple[str, ...]:
        """Return the files that are written, below the folder of the batch."""
        return tuple(f"{self.output}/{part}" for part in KINDS[kind].parts) or (self.output,)


class File(NamedTuple):
    """What a place held, and by what to see that it holds it still."""

    digest: str  # SHA-256
    version: str | None  # `places.version_of`


@dataclass(frozen=True)
class Outcome:
    """How a job ended."""

    output: str
    reason: str = ""  # why it failed; empty where it did not
    recipe: str = ""  # digest of all that decides what is written: `work.recipe_of`
    inputs: tuple[File, ...] = ()  # what was read
    files: tuple[File, ...] = ()  # what was written
    measured: Mapping[str, float] = field(default_factory=dict)  # by column of the table
    not_kept: tuple[str, ...] = ()  # what the target holds beside its pixels and the file cannot, in words


@dataclass(frozen=True)
class Plan:
    """What all rows of a batch share."""

    kind: str  # of `KINDS`
    folder: str  # where outputs go: a local one, or a URL
    force: bool = False  # whether files may be replaced that no earlier run of the batch wrote
    cache: str | None = None  # local folder for what rows have in common
    cache_bytes: int = 0  # how much that may hold


@lru_cache(maxsize=1024)
def options_with(options: TransferOptions, changes: tuple[tuple[str, Any], ...]) -> TransferOptions:
    """Return options with a row's own, or raise an `OptionError`; the same object for the same ones."""
    return options.changed(**dict(changes))
