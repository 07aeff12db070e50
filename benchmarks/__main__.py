"""Measure everything, print the table, and write it down as JSON, Markdown and a plot."""

from __future__ import annotations

import json
import os
import platform
from collections.abc import Callable, Iterable
from dataclasses import asdict
from functools import partial
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import click
from rich.console import Console

from benchmarks.commands import command
from benchmarks.rows import GROUPS as SOLVERS
from benchmarks.rows import Row
from benchmarks.studio import studio
from benchmarks.transfers import batches, detection, pixels, rival, transfers

GROUPS = (*SOLVERS, transfers, detection, pixels, batches, command, studio)


@click.command(help=__doc__)
@click.option("--runs", default=5, show_default=True, help="Runs of every case, of which the median counts.")
@click.option("--only", multiple=True, type=click.Choice([group.__name__ for group in GROUPS]))
@click.option(
    "--rival",
    "other",
    metavar="COMMAND",
    help="Another tool's, run in turn with ours: words in quotes, with {target}, {reference} and {output}.",
)
@click.option("-o", "--output", type=click.Path(file_okay=False, path_type=Path), default=Path("benchmark"))
def main(runs: int, only: tuple[str, ...], other: str | None, output: Path) -> None:
    """Run the benchmarks."""
    console = Console()
    rows = []
    groups: list[Callable[[int], Iterable[Row]]] = [
        group for group in GROUPS if not (only or other) or group.__name__ in only
    ]
    if other:
        groups.append(partial(rival, command=other))
    for group in groups:
        with console.status(group.__doc__ or ""):
            for row in group(runs):
                rows.append(row)
                console.print(" | ".join(cells(row)), highlight=False, soft_wrap=True)
    output.mkdir(parents=True, exist_ok=True)
    record = {**machine(), "rows": [asdict(row) for row in rows]}
    (output / "solver.json").write_text(json.dumps(record, indent=1) + "\n")
    (output / "solver.md").write_text(markdown(rows))
    plot(rows, output / "cost.png")
    console.print(f"wrote {output}/solver.json, solver.md and cost.png")


def cells(row: Row) -> tuple[str, ...]:
    """Return a row as it is printed."""
    peer = f"{row.peer.median:.3f} s" if row.peer else ""
    ratio = f"{row.ratio:.1f}×" if row.ratio else ""
    return row.group, row.case, f"{row.ours.median:.3f} s ± {row.ours.iqr:.3f}", peer, ratio, row.target


def markdown(rows: list[Row]) -> str:
    """Return the table as Markdown."""
    head = "| what; against what | case | ours, median ± IQR | peer | ratio | target |\n"
    return head + "|---|---|---|---|---|---|\n" + "".join(f"| {' | '.join(cells(row))} |\n" for row in rows)


def machine() -> dict[str, Any]:
    """Return what the figures depend on."""
    versions: dict[str, str | None] = {}
    for name in ("relit", "numpy", "numba", "PyMaxflow", "opencv-python-headless"):
        try:
            versions[name] = version(name)
        except PackageNotFoundError:
            versions[name] = None
    return {
        "machine": platform.machine(),
        "processor": processor(),
        "cores": os.cpu_count(),
        "system": platform.system(),
        "python": platform.python_version(),
        "versions": versions,
    }


def processor() -> str:
    """Return the processor's name, where the system tells it."""
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        return platform.processor()
    return next((line.split(":")[1].strip() for line in lines if line.startswith("model name")), "")


def plot(rows: list[Row], path: Path) -> None:
    """Draw cost against size."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(6, 4), layout="constrained")
    axes = figure.subplots()
    for lam in sorted({row.facts["lam"] for row in rows if "lam" in row.facts}):
        points = [(row.facts["pixels"], row.ours.median) for row in rows if row.facts.get("lam") == lam]
        pixels, seconds = zip(*points, strict=True)
        axes.loglog(pixels, seconds, "o-", label=f"λ = {lam}")
        axes.loglog(pixels, [seconds[0] * n / pixels[0] for n in pixels], ":", color="grey", linewidth=1)
    axes.set(
        xlabel="pixels", ylabel="seconds, 1 thread (dotted: in proportion)", title="Exact TV-L1, 4 neighbours"
    )
    if axes.lines:
        axes.legend()
    figure.savefig(path, dpi=120)


main()
