"""Landmark files that are read line by line: ``.pts``, ``.tem`` and ``.csv``."""

from __future__ import annotations

import csv
import io
import re
import reprlib
from decimal import Context, Decimal
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from relit.errors import LandmarkError

if TYPE_CHECKING:
    from relit.face.landmarks import Landmarks
    from relit.face.schemes import SchemeName

# Enough digits to add and subtract 1 without rounding, whatever the number: a .pts file counts pixels from 1.
_EXACT = Context(prec=1100)

#: Rows of a table of faces: a file of 4 MiB holds fewer of 68 points, whose commas alone take 272 bytes.
_MOST_FACES = 16_000

_Row = tuple[int, list[str]]  # the number of its line, and its cells


class Face(NamedTuple):
    """One face of a file as it stands there, not yet checked."""

    points: list[list[float]]
    where: str = ""
    scheme: SchemeName | None = None
    confidence: float | None = None


def text_of(data: bytes) -> str:
    """Decode a text file, with or without a byte order mark."""
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise LandmarkError(
            f"is not a text file (byte {error.start} is not UTF-8); give a landmark file"
        ) from None


def number(text: str, where: str) -> float:
    """Parse a number, or say where it should have been."""
    try:
        return float(text)
    except ValueError:
        raise LandmarkError(f"{where}: expected a number, found {reprlib.repr(text)}; correct it") from None


def written(value: float) -> str:
    """Return the shortest text that reads back as the same float64, never with an exponent.

    WebMorph takes a line with an exponent for a comment, and dlib takes whole numbers only.
    """
    return np.format_float_positional(value, trim="-")


def read_pts(data: bytes) -> list[Face]:
    """Read an iBUG ``.pts`` file: x and y a line between braces, counted from 1."""
    lines = _lines(data)
    texts = [text for _, text in lines]
    if "{" not in texts or "}" not in texts:
        raise LandmarkError("expected the points between a line '{' and a line '}'; is the file complete?")
    start, end = texts.index("{"), texts.index("}")
    points = [_position(line, text, first=1) for line, text in lines[start + 1 : end]]
    for line, text in lines[:start]:
        key, _, count = text.partition(":")
        if key.strip().lower() == "n_points" and count.strip() != str(len(points)):
            raise LandmarkError(
                f"line {line}: {reprlib.repr(text)}, but it holds {len(points)}; is the file complete?"
            )
    return [Face(points)]


def write_pts(landmarks: Landmarks, _image_name: str) -> str:
    """Write an iBUG ``.pts`` file."""
    counted = ([_EXACT.add(Decimal(repr(value)), 1) for value in point] for point in landmarks.xy.tolist())
    rows = "".join(f"{x!s} {y!s}\n" for x, y in counted)
    return f"version: 1\nn_points: {len(landmarks)}\n{{\n{rows}}}\n"


def read_tem(data: bytes) -> list[Face]:
    """Read a WebMorph or Psychomorph ``.tem`` file: the count, x and y a line, then line definitions.

    Each definition takes three lines: closed or open, the number of points, the points. They are counted, as
    a check that the file is complete, and passed over, like the description that WebMorph puts behind them.
    """
    lines = _lines(data) or [(1, "")]
    count = _count(*lines[0], "the number of points")
    points = [_position(line, text) for line, text in lines[1 : count + 1]]
    if len(points) < count:
        raise LandmarkError(
            f"line {lines[0][0]}: says {count} points, but {len(points)} follow; is the file complete?"
        )
    rest = lines[count + 1 :] or [(lines[-1][0] + 1, "")]
    needed = 3 * _count(*rest[0], f"the number of line definitions after {count} points")
    if len(rest) - 1 < needed:
        raise LandmarkError(
            f"line {rest[0][0]}: the line definitions take {needed} lines, but {len(rest) - 1} follow; "
            "is the file complete?"
        )
    return [Face(points)]


def write_tem(landmarks: Landmarks, _image_name: str) -> str:
    """Write a WebMorph ``.tem`` file without line definitions."""
    rows = "".join(f"{written(x)}\t{written(y)}\n" for x, y in landmarks.xy)
    return f"{len(landmarks)}\n{rows}0\n"


def read_csv(data: bytes) -> list[Face]:
    """Read a table of x, y and perhaps z, with or without a header, or what OpenFace writes."""
    (first, header), *rows = _table(data) or [(1, [""])]
    if any(map(_is_number, header)):
        if len(header) not in (2, 3):
            raise LandmarkError(
                f"line {first}: expected x,y or x,y,z, found {len(header)} columns; add a header"
            )
        rows.insert(0, (first, header))
        header = list("xyz"[: len(header)])
    openface = "x_0" in header
    names = header if openface else [name.lower() for name in header]
    for line, cells in rows:
        if len(cells) != len(names):
            raise LandmarkError(f"line {line}: expected {len(names)} columns, found {len(cells)}; correct it")
    columns = {name: index for index, name in enumerate(names)}
    if openface:
        return _openface(names, columns, rows)
    if not {"x", "y"} <= columns.keys():
        raise LandmarkError(
            f"line {first}: expected columns x and y, or OpenFace's x_0, y_0, ...; "
            f"found {reprlib.repr(','.join(header))}"
        )
    axes = [axis for axis in "xyz" if axis in columns]
    return [Face([[_cell(row, axis, columns) for axis in axes] for row in rows])]


def write_csv(landmarks: Landmarks, _image_name: str) -> str:
    """Write a table of x, y and, where it is known, the depth z."""
    header = ",".join("xyz"[: landmarks.points.shape[1]])
    return "\n".join([header, *(",".join(map(written, row)) for row in landmarks.points)]) + "\n"


def _table(data: bytes) -> list[_Row]:
    """Return the rows that are neither blank nor comments."""
    reader = csv.reader(io.StringIO(text_of(data), newline=""))
    rows: list[_Row] = []
    try:
        for row in reader:
            cells = [cell.strip() for cell in row]
            while cells and not cells[-1]:  # spreadsheets pad short rows with commas
                cells.pop()
            if cells and not cells[0].startswith("#"):
                rows.append((reader.line_num, cells))
    except csv.Error as error:
        raise LandmarkError(f"line {reader.line_num}: is not CSV ({error}); correct it") from None
    return rows


def _openface(names: list[str], columns: dict[str, int], rows: list[_Row]) -> list[Face]:
    """Return the faces of what OpenFace writes, a row each."""
    count = max(sum(re.fullmatch(f"{axis}_[0-9]+", name) is not None for name in names) for axis in "xy")
    pairs = [(f"x_{i}", f"y_{i}") for i in range(count)]
    if missing := [name for pair in pairs for name in pair if name not in columns]:
        raise LandmarkError(
            f"OpenFace's column {missing[0]} is missing; let it write its 2-D landmarks again"
        )
    if len(rows) > _MOST_FACES:
        raise LandmarkError(f"holds {len(rows)} faces, more than {_MOST_FACES}; split it into several files")
    return [
        Face(
            [[_cell(row, x, columns), _cell(row, y, columns)] for x, y in pairs],
            f"line {row[0]}",
            confidence=_cell(row, "confidence", columns) if "confidence" in columns else None,
        )
        for row in rows
        if "success" not in columns or _cell(row, "success", columns)
    ]


def _cell(row: _Row, column: str, columns: dict[str, int]) -> float:
    line, cells = row
    return number(cells[columns[column]], f"line {line}, column {column}")


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def _lines(data: bytes) -> list[tuple[int, str]]:
    """Return the lines that are neither blank nor comments, with their numbers."""
    stripped = (re.split("#|//", line)[0].strip() for line in text_of(data).splitlines())
    return [(line, text) for line, text in enumerate(stripped, 1) if text]


def _position(line: int, text: str, first: int = 0) -> list[float]:
    """Parse x and y where pixels are counted from `first`."""
    try:
        x, y = (float(_EXACT.subtract(Decimal(word), 1)) if first else float(word) for word in text.split())
    except (ValueError, ArithmeticError):
        raise LandmarkError(
            f"line {line}: expected two numbers x y, found {reprlib.repr(text)}; correct it"
        ) from None
    return [x, y]


def _count(line: int, text: str, what: str) -> int:
    if not re.fullmatch("[0-9]{1,6}", text):
        raise LandmarkError(f"line {line}: expected {what}, found {reprlib.repr(text)}; correct it")
    return int(text)
