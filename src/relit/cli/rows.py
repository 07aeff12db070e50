"""What a batch is to do: its rows, and what a run of them would come to."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from relit.cli.telling import printable, report
from relit.errors import OptionError
from relit.plain_words import in_plain_words

if TYPE_CHECKING:
    from relit.batch.jobs import Rows
    from relit.batch.run import Batch

_SHOWN = 10  # rows that a dry run lists


def rows_of(
    manifest: str | None,
    output: str,
    targets: tuple[str, ...],
    references: str | None,
    pairing: str,
    seed: int,
) -> tuple[Rows, dict[str, Any]]:
    """Return the rows, and what a record says of where they are from."""
    from relit.batch.manifest import Manifest
    from relit.batch.pairing import Pairs

    if (manifest is None) == (not targets):
        raise click.UsageError("Give a MANIFEST, or --targets GLOB (in quotes), and not both.")
    if manifest is not None:
        if references is not None:
            raise click.UsageError("--references goes with --targets; a MANIFEST has its own.")
        table = Manifest(manifest)
        return table, {"manifest": manifest, "manifest_sha256": table.digest()}
    pairs = Pairs(
        list(dict.fromkeys(photo for pattern in targets for photo in _photos("--targets", pattern, output))),
        _photos("--references", references, output) if references is not None else (),
        pairing,
        seed,
    )
    return pairs, {
        "targets": targets[0] if len(targets) == 1 else targets,
        "references": references,
        "pairing": pairing,
        "seed": seed,
        "pairs_sha256": pairs.digest(),
    }


def _photos(flag: str, pattern: str, output: str) -> list[str]:
    """Return the photos that a pattern stands for, but not those that are results."""
    from relit.batch.clashes import is_below
    from relit.batch.places import expand

    found = [place for place in expand(pattern) if not is_below(place, output)]
    if not found:
        raise OptionError(f"{flag}: expected photos, got none for {pattern!r}; check it, and its quotes")
    return found


def suffix_of(kind: str, given: str | None) -> str | None:
    """Return the suffix of the files to write, if one is chosen."""
    if given is None:
        return None
    from relit.batch.naming import suffixes_of

    suffix, known = f".{given.removeprefix('.')}", suffixes_of(kind)
    if suffix.lower() not in known:
        told = f"expected one of {', '.join(known)}" if known else f"expected none with {kind}"
        raise OptionError(f"--format: {told}, got {suffix!r}")
    return suffix


def foresee(batch: Batch, as_json: bool) -> None:
    """Tell what a run would do; nothing is written."""
    from relit.batch.journal import Journal
    from relit.batch.run import Counts

    counts = Counts(batch.total)
    first: list[tuple[str, str | None, str]] = []
    problems: list[tuple[int, str]] = []
    with Journal(batch.where.journal).reading() as journal:
        batch.check_journal(journal)
        for row, job, _ in batch.to_do(journal, counts):
            if isinstance(job, str):
                counts.failed += 1
                problems += [(row.number, in_plain_words(job))] if len(problems) < _SHOWN else []
            else:
                counts.ok += 1
                first += [(job.target, job.reference, job.output)] if len(first) < _SHOWN else []
    if as_json:
        report(
            True,
            rows=counts.total,
            kept=counts.kept,
            to_do=counts.ok,
            failing=counts.failed,
            first=first,
            problems=problems,
        )
        return
    for target, reference, output in first:
        given = " + ".join(filter(None, (target, reference)))
        click.echo(f"{batch.plan.kind} {printable(given)} -> {printable(output)}")
    if counts.ok > len(first):
        click.echo(f"... and {counts.ok - len(first)} more")
    for number, reason in problems:
        click.echo(f"row {number} would fail: {printable(reason)}")
    click.echo(f"{counts.total} rows: {counts.ok} to do, {counts.kept} done, {counts.failed} that would fail")
