"""The command ``relit batch``: many photos, in processes that may die."""

from __future__ import annotations

import signal
import threading
from contextlib import contextmanager
from dataclasses import asdict, fields
from typing import TYPE_CHECKING, Any

import click
from click.core import ParameterSource

from relit.cli.destinations import check_apart
from relit.cli.groups import GroupedCommand, Option
from relit.cli.kinds import FILE, FOLDER, Count
from relit.cli.options import check_heeded, force_option, json_option, settings_of, transfer_options
from relit.cli.progress import rows_done
from relit.cli.rows import foresee, rows_of, suffix_of
from relit.cli.telling import (
    is_quiet,
    is_verbose,
    is_watched,
    loudness_options,
    printable,
    report,
    warn_of_lossy_rows,
)
from relit.plain_words import in_plain_words
from relit.settings.options import TransferOptions

if TYPE_CHECKING:
    from collections.abc import Iterator

    from relit.batch.run import Batch, Counts


_KINDS = ("transfer", "normalize", "decompose", "landmarks")


@click.command(
    cls=GroupedCommand,
    examples=(
        "relit batch --targets 'faces/*.jpg' --light loop -o lit",
        "relit batch --targets faces --references lights --pairing random -o lit",
        "relit batch pairs.csv --strength 80% -o lit --dry-run",
        "relit batch --do normalize --targets faces -o normal",
    ),
)
@click.argument("manifest", required=False, type=FILE)
@click.option(
    "--do", "kind", type=click.Choice(_KINDS), default="transfer", show_default=True, help="What to do."
)
@click.option(
    "-o",
    "--output",
    required=True,
    type=FOLDER,
    metavar="DIR",
    help="Folder for the results, or its URL. Targets below it are passed over.",
)
@click.option(
    "--targets",
    type=FILE,
    metavar="GLOB",
    multiple=True,
    help="Photos, in quotes; ** is any number of folders. May be given several times.",
)
@click.option("--references", type=FILE, metavar="GLOB", help="Photos that give the light, in quotes.")
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
    cls=Option,
    group="expert",
    title="Who does the work",
    type=click.Choice(["local", "dask", "ray"]),
    default="local",
    show_default=True,
    help="Who does the work: processes here, or a cluster.",
)
@click.option(
    "--jobs",
    "--workers",
    "workers",
    type=Count(1),
    metavar="N",
    help="Processes to work in. [default: all cores]",
)
@click.option(
    "--address",
    cls=Option,
    group="expert",
    title="Address of the cluster",
    metavar="URL",
    help="Of the cluster. [default: one is started here]",
)
@click.option("--limit", type=Count(1), metavar="N", help="Only the first N rows.")
@click.option("--dry-run", is_flag=True, help="Tell what would be done, and do nothing.")
@click.option(
    "--results",
    type=FILE,
    metavar="FILE",
    help="Table of all rows, .csv or .parquet. [default: DIR/results.csv]",
)
@click.option(
    "--journal",
    cls=Option,
    group="expert",
    title="Local file that a run goes on from",
    type=FILE,
    metavar="FILE",
    help="Local file that a run goes on from. [default: DIR/.relit/journal.sqlite; needed with a URL as DIR]",
)
@click.option(
    "--cache-size",
    cls=Option,
    group="expert",
    title="MB of disk for what rows have in common",
    type=Count(0),
    default=1000,
    show_default=True,
    metavar="MB",
    help="Disk space beside the journal for what rows have in common; 0 for none.",
)
@force_option
@loudness_options
@json_option
def batch(
    manifest: str | None,
    kind: str,
    output: str,
    targets: tuple[str, ...],
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
    target_landmarks, reference_landmarks, output, and any option of transfer (light, strength, color_space,
    lam for --lambda, ...); what is empty is as the command says. Paths count from its own folder. Or give
    --targets and --references.

    A run that was interrupted, or killed, goes on when the same command is given again. A row that fails
    does not stop the others.
    """
    settings = settings_of(given)

    from relit.batch.jobs import KINDS, Plan
    from relit.batch.run import Batch, Places, carry_out
    from relit.runtime.engines import engine as engine_of
    from relit.runtime.threads import available

    _check_options(kind, KINDS[kind].options, references, pairing, engine)
    if kind == "transfer" and manifest is None:  # rows of a table may have methods and lights of their own
        check_heeded(settings)
    rows, source = rows_of(manifest, output, targets, references, pairing, seed)
    if kind == "transfer" and manifest is None and (references is None) == (settings.light is None):
        raise click.UsageError("Give --references, or --light, and not both.")
    where = Places.of(output, journal, results)
    check_apart(None, {"--results": [where.results], "--journal": [str(where.journal)]}, [manifest])
    cache = str(where.journal.parent / "cache") if cache_size else None
    todo = Batch(
        rows,
        Plan(kind, output, force, cache, cache_size * 1_000_000),
        settings,
        where,
        suffix=suffix_of(kind, suffix),
        limit=limit,
    )
    if dry_run:
        foresee(todo, as_json)
        return
    workers = workers or available()
    facts = source | {"output": output, "format": suffix, "limit": limit, "cache_size": cache_size}
    facts |= {"engine": engine, "workers": workers, "address": address}
    processes = engine_of(engine, workers, address=address)  # type: ignore[arg-type]
    with _stopped_like_control_c(), rows_done(todo.total) as tell:
        try:
            counts = carry_out(todo, processes, facts, tell, in_plain_words)
        except KeyboardInterrupt:
            click.echo("relit: the same command goes on from here", err=True)
            raise
    _tell(todo, counts, as_json)
    if counts.failed:
        click.get_current_context().exit(1)


def _tell(todo: Batch, counts: Counts, as_json: bool) -> None:
    """Say what was done, what is not as it was asked for, and what failed."""
    folder, table = todo.plan.folder, todo.where.results
    if as_json:
        places = {"output": folder, "results": table, "journal": str(todo.where.journal)}
        report(True, **places, renamed=todo.renamed, **asdict(counts))
    if (is_watched() or is_verbose()) and not as_json:
        told = f"{counts.ok} rows done, {counts.kept} done before, {counts.failed} failed"
        click.echo(printable(f"wrote into {folder}, with a table in {table}: {told}"), err=True)
    warn_of_lossy_rows(counts.lossy, table)
    table = printable(table)
    if todo.renamed and not is_quiet():
        several = "results have other names than their targets, whose names"
        told = several if todo.renamed > 1 else "result has another name than its target, whose name"
        click.echo(
            f"relit: {todo.renamed} {told} some system cannot hold or tell apart; {table} has both", err=True
        )
    if counts.failed:
        click.echo(f"relit: {counts.failed} of {counts.total} rows failed; {table} says why", err=True)


def _check_options(
    kind: str, used: tuple[str, ...], references: str | None, pairing: str, engine: str
) -> None:
    """Refuse options that would do nothing."""
    source = click.get_current_context().get_parameter_source
    for option in fields(TransferOptions):
        if option.name not in used and source(option.name) == ParameterSource.COMMANDLINE:
            raise click.UsageError(f"{option.metadata['flag']} does not go with --do {kind}.")
    if kind != "transfer" and references is not None:
        raise click.UsageError(f"--references does not go with --do {kind}.")
    if pairing != "random" and source("seed") == ParameterSource.COMMANDLINE:
        raise click.UsageError("--seed goes with --pairing random.")
    if engine == "local" and source("address") == ParameterSource.COMMANDLINE:
        raise click.UsageError("--address goes with --engine dask or ray.")


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
