"""The command ``relit evaluate``: scores on photos whose true result is known."""

from __future__ import annotations

import csv
import io
import json
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
from click.core import ParameterSource

from relit.cli.destinations import check_apart
from relit.cli.kinds import FILE, Count, Number
from relit.cli.options import (
    ALIGNMENT,
    check_heeded,
    force_option,
    json_option,
    settings_of,
    transfer_options,
)
from relit.cli.telling import is_watched, loudness_options, report
from relit.errors import OptionError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from relit.evaluate.cases import Case
    from relit.evaluate.evaluation import Outcome
    from relit.evaluate.summaries import Summary
    from relit.settings.options import TransferOptions

_EVALUATED = ("method", "exposure", "tint", "neighborhood", "split_first", "mask", *ALIGNMENT)
_PROTOCOL = "protocol.csv"  # in the folder, where none is named


@click.command()
@click.argument("source", metavar="FOLDER|TABLE", type=click.Path(exists=True, path_type=Path))
@click.option(
    "--protocol", metavar="FILE", type=click.Path(path_type=Path), help="[default: FOLDER/protocol.csv]"
)
@click.option(
    "--set", "chosen", metavar="NAME", help="Which set of the protocol. [default: quick; of heads similar]"
)
@click.option(
    "--lambda",
    "lams",
    type=Number(("auto",), wanted="a number, or 'auto'"),
    metavar="N|auto",
    multiple=True,
    default=(0.2,),
    show_default=True,
    help="As in transfer; may be given several times.",
)
@transfer_options(*_EVALUATED)
@click.option("--jobs", type=Count(1), metavar="N", help="Processes to work in. [default: all cores]")
@click.option("--limit", type=Count(1), metavar="N", help="Evaluate N cases only, spread evenly.")
@click.option(
    "-o",
    "--output",
    type=FILE,
    metavar="STEM",
    help="Write STEM.json, and STEM.csv with a line per transfer.",
)
@click.option(
    "--figure", type=FILE, metavar="PICTURE", help="Draw a case, and the same with the roles swapped."
)
@click.option(
    "--case", "number", type=Count(0), metavar="N", default=0, show_default=True, help="Which case to draw."
)
@force_option
@loudness_options
@json_option
def evaluate(
    source: Path,
    protocol: Path | None,
    chosen: str | None,
    lams: Sequence[float | str],
    jobs: int | None,
    limit: int | None,
    output: str | None,
    figure: str | None,
    number: int,
    force: bool,
    as_json: bool,
    **given: Any,
) -> None:
    """Measure how near relit comes to the true result.

    FOLDER holds Yale B faces in the layout of CroppedYale, or rendered heads, and a protocol of what to
    relight with what. TABLE is a CSV file with the columns target, reference and truth, paths of photos, and
    optionally group and second_reference. Of heads the face is relit, or with --no-mask the whole image; of
    all else the whole image.

    \b
    raw   mean absolute error, % of 255
    gain  the same after the best exposure
    ssim  structural similarity after it: is it still this person?
    identity  how much more its features are like the truth's than the reference's

    Of heads, over the face but where it is said, each after the best exposure but the first:

    \b
    raw, lum  mean absolute error of luma, % of 255
    ssim  structural similarity of it
    de    mean CIEDE2000
    ab    mean distance in a* and b*
    cast  length of the mean difference in a* and b*
    blotch  how far that difference spreads over the face
    around_lum, around_de  the same on ears, neck and hair
    background, background_max  mean and greatest CIEDE2000 of the background to the target's
    halo  the mean beside the head
    """  # noqa: D301 (click reads the backspace as «do not wrap»)
    from rich.console import Console
    from rich.progress import track

    from relit.cli.score_tables import table_of_figures, table_of_groups
    from relit.evaluate.evaluation import evaluate as run
    from relit.evaluate.heads import is_of_heads
    from relit.evaluate.summaries import summaries
    from relit.photo.atomic_files import check_free, save_atomically
    from relit.photo.writing import check_destination
    from relit.runtime.threads import available

    options = [settings_of({**given, "lam": lam}) for lam in lams]
    check_heeded(next((one for one in options if one.lam == "auto"), options[0]))
    methods = {one.method if len(lams) == 1 else f"{one.method} {one.lam}": one for one in options}
    folder = source if source.is_dir() else None
    heads = folder is not None and is_of_heads(folder)
    asked = click.get_current_context().get_parameter_source("mask") == ParameterSource.COMMANDLINE
    if asked and given["mask"] and not heads:
        raise OptionError("--mask: expected a folder of heads, all else is relit as a whole; leave it out")
    cases = _cases(source, protocol, chosen, heads)
    if not 0 <= number < len(cases):
        raise OptionError(f"--case: expected a number from 0 to {len(cases) - 1}, got {number}")
    tables = [f"{output}{suffix}" for suffix in (".json", ".csv")] if output else []
    read = (str(source), str(protocol or source / _PROTOCOL))
    check_apart(None, {"-o": tables, "--figure": [figure]}, read)
    for table in tables:
        check_free(Path(table), overwrite=force)
    if figure:
        check_destination(figure, overwrite=force)
    drawn = cases[number]
    if limit is not None and limit < len(cases):
        cases = [cases[len(cases) * i // limit] for i in range(limit)]

    done = track(
        run(cases, methods, folder=folder, jobs=jobs or available()),
        "Evaluating",
        len(cases),
        console=Console(stderr=True),
        transient=True,
        disable=not is_watched(),
    )
    outcomes = [outcome for of_case in done for outcome in of_case]
    sums = summaries(outcomes, overall=not heads)
    for suffix, data in _tables(methods, outcomes, sums).items() if output else ():
        save_atomically(Path(f"{output}{suffix}"), data, overwrite=force)
    if figure:
        _draw(drawn, methods, folder, figure, force)
    if as_json:
        report(True, output=output, figure=figure, summaries=[asdict(line) for line in sums])
    else:
        click.echo(table_of_figures(sums) if heads else table_of_groups(sums))


def _cases(source: Path, protocol: Path | None, chosen: str | None, heads: bool) -> list[Case]:
    """Return what is to be evaluated, of a folder of heads or of Yale B, or of a table."""
    from relit.evaluate.cases import head_cases, protocol_cases, triple_cases

    if not source.is_dir():
        return triple_cases(source)
    table = protocol or source / _PROTOCOL
    return head_cases(table, chosen or "similar") if heads else protocol_cases(table, chosen or "quick")


def _tables(
    methods: dict[str, TransferOptions], outcomes: list[Outcome], sums: list[Summary]
) -> dict[str, bytes]:
    """Return by suffix what is written: every transfer as CSV; and with what they sum up to, as JSON."""
    from relit.evaluate.summaries import as_record

    records = [as_record(outcome) for outcome in outcomes]
    table = io.StringIO()
    writer = csv.DictWriter(table, list(records[0]), lineterminator="\n")
    writer.writeheader()
    writer.writerows(records)
    settings = {name: asdict(options) for name, options in methods.items()}
    whole = {"methods": settings, "summaries": [asdict(line) for line in sums], "transfers": records}
    return {".csv": table.getvalue().encode(), ".json": json.dumps(whole, indent=1).encode()}


def _draw(
    case: Case, methods: dict[str, TransferOptions], folder: Path | None, figure: str, force: bool
) -> None:
    from relit.evaluate.cases import swapped
    from relit.evaluate.evaluation import images_of
    from relit.evaluate.figure import truth_figure
    from relit.photo.writing import write_image

    rows = {"case": case} | ({"swapped": swapped(case)} if folder else {})
    name = next(iter(methods))
    pictures = [(title, images_of(one, methods, folder)[0], name) for title, one in rows.items()]
    write_image(figure, truth_figure(pictures), overwrite=force)
