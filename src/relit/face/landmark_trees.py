"""Landmark files that hold a tree: menpo's ``.json`` and dlib's ``.xml``."""

from __future__ import annotations

import itertools
import json
import math
import re
import reprlib
from typing import TYPE_CHECKING, Any
from xml.etree import ElementTree as ET

import numpy as np

from relit.errors import LandmarkError
from relit.face.landmark_lines import Face, number, text_of, written
from relit.face.schemes import SCHEMES

if TYPE_CHECKING:
    from relit.face.landmarks import Landmarks

# landmarker.io stores iBUG's 68 points with the eyes before the brows. Its labels, in iBUG's order:
_IBUG_LABELS = ("chin", "leyebrow", "reyebrow", "nose", "leye", "reye", "mouth")

_ENCODING = re.compile(rb"(?:\xef\xbb\xbf)?<\?xml[^>]*?encoding\s*=\s*[\"']([^\"']*)")
# Python would also take what is no encoding of texts, and warn of it.
_KNOWN_ENCODING = re.compile(rb"utf-(8|16)|us-ascii|iso-8859-\d+|windows-\d+", re.IGNORECASE)


def read_json(data: bytes) -> list[Face]:
    """Read menpo's ljson, version 1, 2 or 3: ``[y, x]`` counted from 0, null where a point is missing."""
    text = text_of(data)
    try:
        document = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise LandmarkError(f"is not valid JSON ({error}); is the file complete?") from None
    version = document.get("version") if isinstance(document, dict) else None
    if version == 1:
        return [_ljson_face(_version_2(document), "the file")]
    if version == 2:
        return [_ljson_face(document, "the file")]
    if version == 3:
        groups = _get(document, "groups", dict, "the file")
        return [_ljson_face(_get(groups, name, dict, "groups"), name) for name in groups]
    raise LandmarkError(
        f"expected menpo's ljson, an object whose version is 1, 2 or 3; found version {reprlib.repr(version)}"
    )


def write_json(landmarks: Landmarks, _image_name: str) -> str:
    """Write ljson version 3, with one group named after the scheme.

    The points stay two-dimensional, so that menpo can attach them to an image. What else is known goes into
    keys that menpo passes over: ``depth``, the list of z, and ``confidence``.
    """
    group: dict[str, Any] = {"labels": [], "landmarks": {"points": landmarks.xy[:, ::-1].tolist()}}
    if landmarks.points.shape[1] == 3:
        group["depth"] = landmarks.points[:, 2].tolist()
    if landmarks.confidence is not None:
        group["confidence"] = float(landmarks.confidence)
    return json.dumps({"version": 3, "groups": {landmarks.scheme: group}}, indent=1) + "\n"


def read_xml(data: bytes) -> list[Face]:
    """Read a dlib or imglab dataset: one face a box that has parts, in the order of the parts' numbers."""
    declared = _ENCODING.match(data)
    if declared and not _KNOWN_ENCODING.fullmatch(declared[1]):
        name = reprlib.repr(declared[1].decode("latin-1"))
        raise LandmarkError(f"is not valid XML (unknown encoding {name}); save it as UTF-8")
    try:
        root = ET.fromstring(data, ET.XMLParser(target=_TreeWithoutDoctype()))
    except LandmarkError:
        raise
    except (ET.ParseError, ValueError, LookupError) as error:  # the latter two: an unknown encoding
        raise LandmarkError(f"is not valid XML ({error}); is the file complete?") from None
    if root.tag != "dataset":
        raise LandmarkError(f"expected dlib's <dataset>, found {reprlib.repr(root.tag)}; give a dlib dataset")
    faces = []
    for image in root.iter("image"):
        for index, box in enumerate(image.findall("box")):  # iter() would go down anew from image in image
            if parts := box.findall("part"):
                where = f"{reprlib.repr(image.get('file'))} box {index}"
                faces.append(Face(_part_points(parts, where), where))
    return faces


def write_xml(landmarks: Landmarks, image_name: str) -> str:
    """Write a dlib dataset of one box; the depth has no place in it."""
    left, top = np.floor(landmarks.xy.min(axis=0))
    right, bottom = np.ceil(landmarks.xy.max(axis=0))
    root = ET.Element("dataset")
    image = ET.SubElement(ET.SubElement(root, "images"), "image", file=image_name)
    sides = {"top": top, "left": left, "width": right - left + 1, "height": bottom - top + 1}
    box = ET.SubElement(image, "box", {name: written(side) for name, side in sides.items()})
    digits = max(2, len(str(len(landmarks) - 1)))  # dlib sorts the names as text
    for row, (x, y) in enumerate(landmarks.xy):
        ET.SubElement(box, "part", name=str(row).zfill(digits), x=written(x), y=written(y))
    ET.indent(root)
    return "<?xml version='1.0' encoding='UTF-8'?>\n" + ET.tostring(root, encoding="unicode") + "\n"


def _get(node: Any, key: str, kind: type[dict[str, Any]] | type[list[Any]], where: str) -> Any:
    """Return what an object of the file holds under a key, if that is of the kind expected."""
    value = node.get(key) if isinstance(node, dict) else None
    if not isinstance(value, kind):
        expected = "an object" if kind is dict else "a list"
        raise LandmarkError(
            f"{reprlib.repr(where)}: expected {expected} under {reprlib.repr(key)}; correct it"
        )
    return value


def _version_2(document: dict[str, Any]) -> dict[str, Any]:
    """Turn version 1, whose labels hold the points, into version 2, whose labels refer to all points."""
    points: list[Any] = []
    labels = []
    for index, group in enumerate(_get(document, "groups", list, "the file")):
        where = f"groups[{index}]"
        start, marks = len(points), _get(group, "landmarks", list, where)
        points += [_get(mark, "point", list, f"{where}.landmarks[{i}]") for i, mark in enumerate(marks)]
        labels.append({"label": group.get("label"), "mask": list(range(start, len(points)))})
    return {"landmarks": {"points": points}, "labels": labels}


def _ljson_face(group: dict[str, Any], name: str) -> Face:
    """Return the face of a group of version 3, or of a file of version 2."""
    where = reprlib.repr(name)
    marks = _get(_get(group, "landmarks", dict, name), "points", list, name)
    points = [_image_point(mark, f"{where}, point {row}") for row, mark in enumerate(marks)]
    if (depth := group.get("depth")) is not None:
        if not isinstance(depth, list) or len(depth) != len(points):
            raise LandmarkError(
                f"{where}: expected 'depth' to be a list of {len(points)} numbers; correct it"
            )
        for row, (point, z) in enumerate(zip(points, depth, strict=True)):
            point.append(_value(z, f"{where}, depth {row}"))
    if (confidence := group.get("confidence")) is not None:
        confidence = _value(confidence, f"{where}, confidence")
    scheme = next((known for known in SCHEMES if known == name), None)
    if scheme and SCHEMES[scheme].count not in (None, len(points)):
        scheme = None
    points = [points[row] for row in _ibug_rows(group.get("labels"), len(points))]
    return Face(points, where, scheme, confidence)


def _image_point(mark: object, where: str) -> list[float]:
    """Return ``[x, y]`` of ``[y, x]``."""
    if not isinstance(mark, list) or len(mark) != 2:
        raise LandmarkError(
            f"{where}: expected [y, x], found {reprlib.repr(mark)}; give landmarks of an image"
        )
    y, x = (_value(value, where) for value in mark)
    return [x, y]


def _value(value: object, where: str) -> float:
    if value is None:
        return math.nan
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise LandmarkError(f"{where}: expected a number, found {reprlib.repr(value)}; correct it")
    return number(str(value), where)


def _ibug_rows(labels: object, count: int) -> list[int]:
    """Return the order that makes the rows iBUG's: as they stand, except for landmarker.io's template."""
    masks = {
        entry["label"]: entry["mask"]
        for entry in (labels if isinstance(labels, list) else [])
        if isinstance(entry, dict)
        and isinstance(entry.get("label"), str)
        and isinstance(entry.get("mask"), list)
    }
    rows = [row for label in _IBUG_LABELS for row in masks.get(label, [])]
    if count == 68 and all(isinstance(row, int) for row in rows) and sorted(rows) == list(range(count)):
        return rows
    return list(range(count))


class _TreeWithoutDoctype(ET.TreeBuilder):
    """Refuses a document type, which dlib never writes, and with it all entities that could blow up."""

    def doctype(self, _name: str, _public_id: str | None, _system: str | None) -> None:
        raise LandmarkError("declares a DOCTYPE, which dlib never writes; remove it")


def _part_points(parts: list[ET.Element], where: str) -> list[list[float]]:
    named = {part.get("name", ""): part for part in parts}
    if len(named) < len(parts):
        raise LandmarkError(f"{where}: two parts have the same name; give every <part> a name of its own")
    if all(re.fullmatch("[0-9]{1,6}", name) for name in named):
        order = sorted(named, key=int)
        for before, after in itertools.pairwise(order):
            if int(after) != int(before) + 1:
                raise LandmarkError(
                    f"{where}: no part is named between {before} and {after}; place what is missing"
                )
    else:
        order = sorted(named)
    return [
        [number(named[name].get(axis, ""), f"{where}, part {reprlib.repr(name)}, {axis}") for axis in "xy"]
        for name in order
    ]
