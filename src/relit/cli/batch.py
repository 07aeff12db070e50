"""The command ``relit batch``: many photos, in processes that may die."""

from __future__ import annotations

import signal
import sys
import threading
from contextlib import contextmanager
from dataclasses import asdict, fields
from typing import TYPE_CHECKING, Any

import click
from click.core import ParameterSource

from relit.cli.options import force_option, json_option, settings_of, transfer_options
from relit.cli.progress import rows_done
from relit.cli.terminal import printable, report
from relit.errors import OptionError
from relit.settings.options import TransferOptions

if TYPE_CHECKING:
    from collections.abc import Iterator

    from relit.batch.jobs import Rows
    from relit.batch.run import Batch

_KINDS = ("transfer", "normalize", "decompose", "landmarks")
_SHOWN = 10  # rows that a dry run lists


@click.command()
@click.argument("manifest", required=False)
@click.option(
    "--do", "kind", type=click.Choice(_KINDS), default="transfer", show_default=True, help="What to do."
)
@click.option(
    "-o",
    "--output",
    required=True,
    metavar="DIR",
    help="Folder for the results, or its URL. Targets below it are passed over.",
)
@click.option("--targets", metavar="GLOB", help="Photos, in quotes; ** is any number of folders.")
@click.option("--references", metavar="GLOB", help="Photos that give the light, in quotes.")
@click.option(
    "--pairing",
    type=click.Choice(["all", "random", "zip"]),
    default="all",
    show_default=True,
    help="Every target with every reference, with one by chance, or the first with the first and so on.",
)
@click.option("--seed", type=int, default=0, show_default=True, help="Of --pairing random.")
@click.option(
    "--format",
    "suffix",
    metavar="EXT",
    help="Of the files to write. [default: as the target, or png or json]",
)
@transfer_options()
@click.option(
    "--engine",
    type=click.Choice(["local", "dask", "ray"]),
    default="local",
    show_default=True,
    help="Who does the work: processes here, or a cluster.",
)
@click.option(
    "--jobs",
    "--workers",
    "workers",
    type=click.IntRange(min=1),
    metavar="N",
    help="Processes to work in. [default: all cores]",
)
@click.option("--address", help="Of the cluster. [default: one is started here]")
@click.option("--limit", type=click.IntRange(min=1), metavar="N", help="Only the first N rows.")
@click.option("--dry-run", is_flag=True, help="Tell what would be done, and do nothing.")
@click.option(
    "--results", metavar="FILE", help="Table of all rows, .csv or .parquet. [default: DIR/results.csv]"
)
@click.option(
    "--journal",
    metavar="FILE",
    help="Local file that a run goes on from. [default: DIR/.relit/journal.sqlite; needed with a URL as DIR]",
)
@click.option(
    "--cache-size",
    type=click.IntRange(min=0),
    default=1000,
    show_default=True,
    metavar="MB",
    help="Disk space beside the journal for what rows have in common; 0 for none.",
)
@force_option
@json_option
def batch(
    manifest: str | None,
    kind: str,
    output: str,
    targets: str | None,
    references: str | None,
    pairing: str,
    seed: int,
    suffix: str | None,
    engine: str,
    workers: int | None,
    address: str | None,
    limit: int | None,
    dry_run: bool,
    results: str | None,
    journal: str | None,
    cache_size: int,
    force: bool,
    as_json: bool,
    **given: Any,
) -> None:
    """Relight many photos, or take their light out, split them, or find their landmarks.

    MANIFEST is a table, .csv, .jsonl or .parquet, a row for each result: target, reference,
    target_landmarks, reference_landmarks, output, and any option of transfer by its name in Python (lam,
    strength, light, ...); what is empty is as the command says. Paths count from its own folder. Or give
    --targets and --references.

    A run that was interrupted, or killed, goes on when the same command is given again. A row that fails
    does not stop the others.
    """
    settings = settings_of(given)

    from relit.batch.jobs import KINDS, Plan
    from relit.batch.run import Batch, Places, carry_out
    from relit.runtime.engines import engine as engine_of
    from relit.runtime.threads import available

    _check_options(kind, KINDS[kind].options, references, pairing)
    rows, source = _rows(manifest, output, targets, references, pairing, seed)
    if kind == "transfer" and manifest is None and (references is None) == (settings.light is None):
        raise click.UsageError("Give --references, or --light, and not both.")
    where = Places.of(output, journal, results)
    cache = str(where.journal.parent / "cache") if cache_size else None
    todo = Batch(
        rows,
        Plan(kind, output, force, cache, cache_size * 1_000_000),
        settings,
        where,
        suffix=_suffix(kind, suffix),
        limit=limit,
    )
    if dry_run:
        _foresee(todo, as_json)
        return
    workers = workers or available()
    facts = source | {"output": output, "format": suffix, "limit": limit, "cache_size": cache_size}
    facts |= {"engine": engine, "workers": workers, "address": address}
    processes = engine_of(engine, workers, address=address)  # type: ignore[arg-type]
    with _stopped_like_control_c(), rows_done(todo.total) as tell:
        try:
            counts = carry_out(todo, processes, facts, tell)
        except KeyboardInterrupt:
            click.echo("relit: the same command goes on from here", err=True)
            raise
    report(as_json, output=output, results=where.results, journal=str(where.journal), **asdict(counts))
    if sys.stderr.isatty() and not as_json:
        click.echo(f"{counts.ok} rows done, {counts.kept} done before, {counts.failed} failed", err=True)
    if counts.failed:
        click.echo(
            f"relit: {counts.failed} of {counts.total} rows failed; {printable(where.results)} says why",
            err=True,
        )
        click.get_current_context().exit(1)


def _check_options(kind: str, used: tuple[str, ...], references: str | None, pairing: str) -> None:
    """Refuse options that would do nothing."""
    source = click.get_current_context().get_parameter_source
    for option in fields(TransferOptions):
        if option.name not in used and source(option.name) == ParameterSource.COMMANDLINE:
            raise click.UsageError(f"{option.metadata['flag']} does not go with --do {kind}.")
    if kind != "transfer" and references is not None:
        raise click.UsageError(f"--references does not go with --do {kind}.")
    if pairing != "random" and source("seed") == ParameterSource.COMMANDLINE:
        raise click.UsageError("--seed goes with --pairing random.")


def _rows(
    manifest: str | None,
    output: str,
    targets: str | None,
    references: str | None,
    pairing: str,
    seed: int,
) -> tuple[Rows, dict[str, Any]]:
    """Return the rows, and what a record says of where they are from."""
    from relit.batch.manifest import Manifest
    from relit.batch.pairing import Pairs

    if (manifest is None) == (targets is None):
        raise click.UsageError("Give a MANIFEST, or --targets GLOB (in quotes), and not both.")
    if manifest is not None:
        if references is not None:
            raise click.UsageError("--references goes with --targets; a MANIFEST has its own.")
        table = Manifest(manifest)
        return table, {"manifest": manifest, "manifest_sha256": table.digest()}
    pairs = Pairs(
        _photos("--targets", targets or "", output),
        _photos("--references", references, output) if references is not None else (),
        pairing,
        seed,
    )
    return pairs, {
        "targets": targets,
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


def _suffix(kind: str, given: str | None) -> str | None:
    """Return the suffix of the files to write, if one is chosen."""
    if given is None:
        return None
    from relit.batch.naming import suffixes_of

    suffix, known = f".{given.removeprefix('.')}", suffixes_of(kind)
    if suffix.lower() not in known:
        told = f"expected one of {', '.join(known)}" if known else f"expected none with {kind}"
        raise OptionError(f"--format: {told}, got {suffix!r}")
    return suffix


def _foresee(batch: Batch, as_json: bool) -> None:
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
                problems += [(row.number, job)] if len(problems) < _SHOWN else []
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


@contextmanager
def _stopped_like_control_c() -> Iterator[None]:
    """Take SIGTERM for Ctrl-C: how queues of clusters stop a job."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)
