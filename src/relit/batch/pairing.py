"""Rows from photos: which target is relit by which reference."""

from __future__ import annotations

from dataclasses import dataclass
from hashlib import blake2b, sha256
from typing import TYPE_CHECKING

from relit.batch.jobs import Row
from relit.errors import OptionError

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

PAIRINGS = ("all", "random", "zip")


@dataclass(frozen=True)
class Pairs:
    """Targets, each with one reference, with all, or with none.

    With ``all``, every target goes with every reference; with ``random``, with one that the seed and its name
    decide, whatever the other targets are, and which is not itself; with ``zip``, the first with the first.
    """

    targets: Sequence[str]
    references: Sequence[str] = ()
    pairing: str = "all"
    seed: int = 0

    def __post_init__(self) -> None:
        """Check that they can be paired."""
        if not self.targets:
            raise OptionError("targets: expected photos, got none")
        if self.pairing not in PAIRINGS:
            raise OptionError(f"pairing: expected one of {', '.join(PAIRINGS)}, got {self.pairing!r}")
        if self.pairing == "zip" and len(self.targets) != len(self.references) > 0:
            raise OptionError(
                f"pairing: zip expected as many references as targets, got {len(self.references)} for "
                f"{len(self.targets)}; choose all or random"
            )

    def __iter__(self) -> Iterator[Row]:
        """Go through the pairs, target by target."""
        for number, (target, reference) in enumerate(self._pairs(), 1):
            yield Row(number, target, reference)

    def digest(self) -> str:
        """Return the SHA-256 of the names of all photos, in their order."""
        names = "\0".join([*self.targets, "", *self.references])
        return sha256(names.encode("utf-8", "surrogatepass")).hexdigest()

    def _pairs(self) -> Iterator[tuple[str, str | None]]:
        if not self.references:
            yield from ((target, None) for target in self.targets)
        elif self.pairing == "zip":
            yield from zip(self.targets, self.references, strict=True)
        elif self.pairing == "random":
            yield from ((target, self._drawn(target)) for target in self.targets)
        else:
            yield from ((target, reference) for target in self.targets for reference in self.references)

    def _drawn(self, target: str) -> str:
        """Return a reference by chance: as a digest, which every version of every library gives alike."""
        count = len(self.references)
        digest = blake2b(f"{self.seed}/{target}".encode("utf-8", "surrogatepass"), digest_size=16).digest()
        drawn = int.from_bytes(digest) % count
        if self.references[drawn] == target:
            drawn = (drawn + 1) % count
        return self.references[drawn]
