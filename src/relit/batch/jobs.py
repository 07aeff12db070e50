"""What a batch is made of: rows as they are given, jobs as they are done, outcomes as they are recorded."""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from functools import lru_cache
from typing import TYPE_CHECKING, Any, NamedTuple

from relit.settings.options import TransferOptions

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping
    from typing import Protocol

    class Rows(Protocol):
        """Where rows come from; they are gone through several times, and never all held at once."""

        def __iter__(self) -> Iterator[Row]:
            """Go through all rows, the same each time."""
            ...


@dataclass(frozen=True)
class Kind:
    """A kind of work.

    Attributes
    ----------
    options : tuple of str
        The fields of `TransferOptions` that count.
    suffix : str or None
        Of the file that is written, if none is chosen; None for that of the target.
    parts : tuple of str
        Names of the files in the folder that is written; none where it is one file.
    """

    options: tuple[str, ...]
    suffix: str | None = None
    parts: tuple[str, ...] = ()


KINDS = {
    "transfer": Kind(tuple(option.name for option in fields(TransferOptions))),
    "normalize": Kind(("lam", "neighborhood")),
    "decompose": Kind(("lam", "neighborhood"), suffix="", parts=("u.png", "v.png")),
    "landmarks": Kind((), suffix=".json"),
}


class Row(NamedTuple):
    """A row as it is given; its options count more than the command's.

    Attributes
    ----------
    number : int
        From 1; blank rows are not counted.
    problem : str
        Why it cannot be a job, if it cannot.
    """

    number: int
    target: str = ""
    reference: str | None = None
    output: str | None = None
    target_landmarks: str | None = None
    reference_landmarks: str | None = None
    options: tuple[tuple[str, Any], ...] = ()
    problem: str = ""


@dataclass(frozen=True, slots=True)
class Job:
    """A row that can be tried.

    Attributes
    ----------
    output : str
        Below the folder of the batch, with ``/`` between folders: a file, or for ``decompose`` a folder.
    """

    target: str
    reference: str | None
    output: str
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
    """What a place held: the SHA-256 of its bytes, and the version by which to see that they are the same.

    Attributes
    ----------
    version : str or None
        As of `places.version_of`.
    """

    digest: str
    version: str | None


@dataclass(frozen=True)
class Outcome:
    """How a job ended.

    Attributes
    ----------
    output : str
        As of the job.
    reason : str
        Why it failed; empty where it did not.
    recipe : str
        Digest of all that decides what is written: `work.recipe_of`.
    inputs, files : tuple of File
        What was read, and what was written.
    measured : mapping of str to float
        Seconds by stage, confidence of the landmarks that were found, and more, by column of the table.
    """

    output: str
    reason: str = ""
    recipe: str = ""
    inputs: tuple[File, ...] = ()
    files: tuple[File, ...] = ()
    measured: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class Plan:
    """What all rows of a batch share.

    Attributes
    ----------
    kind : str
        Of `KINDS`.
    folder : str
        Where outputs go: a local folder, or a URL.
    force : bool
        Whether files may be replaced that no earlier run of the batch wrote.
    cache : str or None
        Local folder for what rows have in common.
    cache_bytes : int
        How much it may hold.
    """

    kind: str
    folder: str
    force: bool = False
    cache: str | None = None
    cache_bytes: int = 0


@lru_cache(maxsize=1024)
def options_with(options: TransferOptions, changes: tuple[tuple[str, Any], ...]) -> TransferOptions:
    """Return options with a row's own; the same object for the same ones, since rows are many.

    Raises
    ------
    OptionError
        If one is out of range.
    """
    return options.changed(**dict(changes))
