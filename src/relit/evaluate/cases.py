"""What to evaluate on: transfers whose result is known, from a folder's protocol or a table of photos."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from relit.errors import OptionError
from relit.evaluate.yale_b import Light, read_table


@dataclass(frozen=True)
class Case:
    """One transfer whose result is known.

    Attributes
    ----------
    pair : str
        Target and reference by name; cases of one pair are not independent of one another.
    group : str
        What the case is summed up with, such as the subset of its light.
    target, reference, truth : tuple
        ``(subject, light)`` of a Yale B folder, ``(person, light)`` of one of heads, or ``(path,)``.
    second_reference : tuple or None
        The reference's face in the target's light, of the same kind, if there is one.
    """

    pair: str
    group: str
    target: tuple[Any, ...]
    reference: tuple[Any, ...]
    truth: tuple[Any, ...]
    second_reference: tuple[Any, ...] | None = None


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
        If the file cannot be read as such a table, or has no such set.
    """
    names = dict.fromkeys(("set", "target", "reference"), str)
    angles = dict.fromkeys(("target_azimuth", "target_elevation", "azimuth", "elevation"), int)
    return [
        _yale_case(
            (row["target"], Light(row["target_azimuth"], row["target_elevation"])),
            (row["reference"], Light(row["azimuth"], row["elevation"])),
        )
        for row in _rows_of_set(path, {**names, **angles}, chosen)
    ]


def head_cases(path: Path, chosen: str) -> list[Case]:
    """Return the cases of one set of a protocol of rendered heads; the set is their group.

    Parameters
    ----------
    path : Path
        A CSV file of the columns set, target, target_light, reference and reference_light.
    chosen : str
        The set.

    Raises
    ------
    OptionError
        If the file cannot be read as such a table, or has no such set.
    """
    columns = ("set", "target", "target_light", "reference", "reference_light")
    return [
        _lit_case(
            (row["target"], row["target_light"]), (row["reference"], row["reference_light"]), row["set"]
        )
        for row in _rows_of_set(path, dict.fromkeys(columns, str), chosen)
    ]


def _rows_of_set(path: Path, columns: dict[str, type], chosen: str) -> list[dict[str, Any]]:
    table = read_table(path, columns)
    rows = [row for row in table if row["set"] == chosen]
    if not rows:
        sets = ", ".join(sorted({row["set"] for row in table}))
        raise OptionError(f"--set: {path} has no set {chosen!r}; expected one of {sets}")
    return rows


def _yale_case(target: tuple[str, Light], reference: tuple[str, Light]) -> Case:
    return _lit_case(target, reference, f"subset {reference[1].subset}")


def _lit_case(target: tuple[str, Any], reference: tuple[str, Any], group: str) -> Case:
    """Return the case of a folder in which everyone is there in every light."""
    (ours, own), (theirs, light) = target, reference
    return Case(f"{ours} < {theirs}", group, target, reference, (ours, light), (theirs, own))


def swapped(case: Case) -> Case:
    """Return the case of a folder in which the two faces swap their roles."""
    target, reference = case.reference, case.target
    if isinstance(reference[1], Light):
        return _yale_case(target, reference)
    return _lit_case(target, reference, case.group)


def triple_cases(path: Path) -> list[Case]:
    """Return the cases of a CSV file of the columns target, reference and truth: paths, from where it is.

    A column ``group`` is what to sum up by; without it, all is one. A column ``second_reference`` has the
    reference's face in the target's light, for the methods that take one. The truth must lie on its target
    pixel by pixel.

    Raises
    ------
    OptionError
        If the file cannot be read as such a table.
    """
    return [
        Case(
            f"{row['target']} < {row['reference']}",
            row.get("group") or "all",
            (path.parent / row["target"],),
            (path.parent / row["reference"],),
            (path.parent / row["truth"],),
            (path.parent / row["second_reference"],) if row.get("second_reference") else None,
        )
        for row in read_table(path, dict.fromkeys(("target", "reference", "truth"), str))
    ]
