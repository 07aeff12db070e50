"""Scores as text: what ``relit evaluate`` prints."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Sequence

    from relit.evaluate.summaries import Summary

_CELL = 20


def table_of_groups(sums: Sequence[Summary]) -> str:
    """Return the summaries as text: a line for each group and method, a column for each figure."""
    wide = max(len(line.method) for line in sums)
    lines = [
        f"{'':10} {'':{wide}} {'raw %':>{_CELL}} {'gain %':>{_CELL}} {'SSIM':>{_CELL}} {'identity':>{_CELL}}"
    ]
    for group in dict.fromkeys(line.group for line in sums):
        rows = [line for line in sums if line.group == group]
        for method in dict.fromkeys(line.method for line in rows):
            cells = [
                _cell(line, digits)
                for line, digits in zip((r for r in rows if r.method == method), (2, 2, 3, 2), strict=True)
            ]
            lines.append(f"{group:10} {method:{wide}} " + " ".join(f"{cell:>{_CELL}}" for cell in cells))
        lines.append(f"{'':10} {rows[0].cases} transfers of {rows[0].pairs} pairs")
    return "\n".join(lines)


def table_of_figures(sums: Sequence[Summary]) -> str:
    """Return the summaries as text: of each group, a line for each figure and a column for each method."""
    wide = max(len(line.figure) for line in sums)
    blocks = []
    for group in dict.fromkeys(line.group for line in sums):
        rows = [line for line in sums if line.group == group]
        methods = [f"{method:>{_CELL}}" for method in dict.fromkeys(line.method for line in rows)]
        lines = [
            f"{group}: {rows[0].cases} transfers of {rows[0].pairs} pairs",
            " ".join([" " * wide, *methods]),
        ]
        for figure in dict.fromkeys(line.figure for line in rows):
            digits = 3 if figure == "ssim" else 2
            cells = [f"{_cell(line, digits):>{_CELL}}" for line in rows if line.figure == figure]
            lines.append(" ".join([f"{figure:{wide}}", *cells]))
        blocks.append("\n".join(lines))
    return "\n\n".join(blocks)


def _cell(line: Summary, digits: int) -> str:
    return f"{line.mean:.{digits}f} [{line.low:.{digits}f}, {line.high:.{digits}f}]"
