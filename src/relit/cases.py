"""What to evaluate on: transfers whose result is known, from a protocol of Yale B or a table of photos."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from relit.errors import OptionError
from relit.yale_b import Light, read_table

if TYPE_CHECKING:
    from pathlib import Path


@dataclass(frozen=True)
class Case:
    """One transfer whose result is known.

    Attributes
    ----------
    pair : str
        Who lends light to whom; cases of one pair are not independent of one another.
    group : str
        What the case is summed up with, such as the subset of its light.
    target, reference, truth : tuple
        ``(subject, light)`` of a Yale B folder, or ``(path,)``.
    """

    pair: str
    group: str
    target: tuple[Any, ...]
    reference: tuple[Any, ...]
    truth: tuple[Any, ...]


def protocol_cases(path: Path, chosen: str) -> list[Case]:
    """Return the cases of one set of a Yale B protocol.

    Parameters
    ----------
    path : Path
        A CSV file of the columns set, target, reference, target_azimuth, target_elevation, azimuth and
        elevation.
    chosen : str
        The set.

    Raises
    ------
    OptionError
        If the file cannot be read, or has no such set.
    """
    columns = ("set", "target", "reference", "target_azimuth", "target_elevation", "azimuth", "elevation")
    rows = read_table(path, columns)
    if not any(row["set"] == chosen for row in rows):
        sets = ", ".join(sorted({row["set"] for row in rows}))
        raise OptionError(f"--set: {path} has no set {chosen!r}; expected one of {sets}")
    cases = []
    for row in rows:
        if row["set"] != chosen:
            continue
        own = Light(int(row["target_azimuth"]), int(row["target_elevation"]))
        light = Light(int(row["azimuth"]), int(row["elevation"]))
        target, reference = row["target"], row["reference"]
        cases.append(
            Case(
                f"{target} < {reference}",
                f"subset {light.subset}",
                (target, own),
                (reference, light),
                (target, light),
            )
        )
    return cases


def swapped(case: Case) -> Case:
    """Return the case of a Yale B folder in which the two faces swap their roles."""
    (target, own), (reference, light) = case.target, case.reference
    return Case(
        f"{reference} < {target}", f"subset {own.subset}", (reference, light), (target, own), (reference, own)
    )


def triple_cases(path: Path) -> list[Case]:
    """Return the cases of a CSV file of the columns target, reference and truth: paths, from where it is.

    A column ``group`` is what to sum up by; without it, all is one. The truth must lie on its target pixel by
    pixel.

    Raises
    ------
    OptionError
        If the file cannot be read.
    """
    return [
        Case(
            f"{row['target']} < {row['reference']}",
            row.get("group") or "all",
            *((path.parent / row[name],) for name in ("target", "reference", "truth")),
        )
        for row in read_table(path, ("target", "reference", "truth"))
    ]
