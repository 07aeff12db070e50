"""The command ``relit evaluate``: scores on photos whose true result is known."""

from __future__ import annotations

import csv
import io
import json
import sys
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from relit.cli.options import (
    ALIGNMENT,
    NumberOrWord,
    force_option,
    json_option,
    settings_of,
    transfer_options,
)
from relit.cli.terminal import report
from relit.errors import OptionError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from relit.evaluate.cases import Case
    from relit.evaluate.evaluation import Outcome, Summary
    from relit.settings.options import TransferOptions

_EVALUATED = ("method", "exposure", "neighborhood", "split_first", *ALIGNMENT)


@click.command()
@click.argument("source", metavar="FOLDER|TABLE", type=click.Path(exists=True, path_type=Path))
@click.option(
    "--protocol", metavar="FILE", type=click.Path(path_type=Path), help="[default: FOLDER/protocol.csv]"
)
@click.option("--set", "chosen", default="quick", show_default=True, help="Which set of the protocol.")
@click.option(
    "--lambda",
    "lams",
    type=NumberOrWord(("auto",)),
    multiple=True,
    default=(0.2,),
    show_default=True,
    help="As in transfer; may be given several times.",
)
@transfer_options(*_EVALUATED)
@click.option(
    "--jobs", type=click.IntRange(min=1), metavar="N", help="Processes to work in. [default: all cores]"
)
@click.option(
    "--limit", type=click.IntRange(min=1), metavar="N", help="Evaluate N cases only, spread evenly."
)
@click.option(
    "-o", "--output", metavar="STEM", help="Write STEM.json, and STEM.csv with a line per transfer."
)
@click.option("--figure", metavar="PICTURE", help="Draw a case, and the same with the roles swapped.")
@click.option("--case", "number", default=0, show_default=True, help="Which case to draw.")
@force_option
@json_option
def evaluate(
    source: Path,
    protocol: Path | None,
    chosen: str,
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

    FOLDER holds Yale B faces in the layout of CroppedYale, and a protocol of what to relight with what. TABLE
    is a CSV file with the columns target, reference and truth, paths of photos, and optionally group and
    second_reference.

    \b
    raw   mean absolute error, % of 255
    gain  the same after the best exposure
    ssim  structural similarity after it: is it still this person?
    identity  how much more its features are like the truth's than the reference's
    """  # noqa: D301 (click reads the backspace as «do not wrap»)
    from rich.console import Console
    from rich.progress import track

    from relit.evaluate.cases import protocol_cases, triple_cases
    from relit.evaluate.evaluation import evaluate as run
    from relit.evaluate.evaluation import summaries
    from relit.photo.atomic_files import check_free, save_atomically
    from relit.photo.writing import check_destination
    from relit.runtime.threads import available

    options = [settings_of({**given, "lam": lam}) for lam in lams]
    methods = {one.method if len(lams) == 1 else f"{one.method} {one.lam}": one for one in options}
    folder = source if source.is_dir() else None
    cases = protocol_cases(protocol or source / "protocol.csv", chosen) if folder else triple_cases(source)
    if not 0 <= number < len(cases):
        raise OptionError(f"--case: expected a number from 0 to {len(cases) - 1}, got {number}")
    for suffix in (".json", ".csv") if output else ():
        check_free(Path(f"{output}{suffix}"), overwrite=force)
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
        disable=not sys.stderr.isatty(),
    )
    outcomes = [outcome for of_case in done for outcome in of_case]
    sums = summaries(outcomes)
    for suffix, data in _tables(methods, outcomes, sums).items() if output else ():
        save_atomically(Path(f"{output}{suffix}"), data, overwrite=force)
    if figure:
        _draw(drawn, methods, folder, figure, force)
    if as_json:
        report(True, output=output, figure=figure, summaries=[asdict(line) for line in sums])
    else:
        click.echo(_table(sums))


def _tables(
    methods: dict[str, TransferOptions], outcomes: list[Outcome], sums: list[Summary]
) -> dict[str, bytes]:
    """Return by suffix what is written: every transfer as CSV; and with what they sum up to, as JSON."""
    from relit.evaluate.evaluation import as_record

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


def _table(sums: Sequence[Summary]) -> str:
    """Return the summaries as text: a line for each group and method, a column for each figure."""
    wide = max(len(line.method) for line in sums)
    lines = [f"{'':10} {'':{wide}} {'raw %':>20} {'gain %':>20} {'SSIM':>20} {'identity':>20}"]
    for group in dict.fromkeys(line.group for line in sums):
        rows = [line for line in sums if line.group == group]
        for method in dict.fromkeys(line.method for line in rows):
            cells = [
                f"{line.mean:.{digits}f} [{line.low:.{digits}f}, {line.high:.{digits}f}]"
                for line, digits in zip((r for r in rows if r.method == method), (2, 2, 3, 2), strict=True)
            ]
            lines.append(f"{group:10} {method:{wide}} " + " ".join(f"{cell:>20}" for cell in cells))
        lines.append(f"{'':10} {rows[0].cases} transfers of {rows[0].pairs} pairs")
    return "\n".join(lines)
