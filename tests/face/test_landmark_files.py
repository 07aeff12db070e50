"""Landmark files: hand-written ones read right, written ones read back, broken ones say what is wrong."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from relit.errors import FaceNotFoundError, LandmarkError
from relit.face.landmark_files import read_landmarks
from tests.face.landmark_texts import (
    BY_HAND,
    DEPTH,
    FACE,
    JSON,
    OPENFACE,
    PTS,
    TEM,
    XML,
    save,
    scattered,
)

PORTRAITS = Path(__file__).parents[3] / "shared" / "portraits"


@pytest.mark.parametrize("name", BY_HAND)
def test_a_file_by_hand(tmp_path, name):
    landmarks = read_landmarks(save(tmp_path, name, BY_HAND[name]))
    assert landmarks.points.tolist() == FACE
    assert landmarks.scheme == "points"
    assert landmarks.confidence == (0.98 if "x_0" in BY_HAND[name] else None)


def test_a_path_may_be_a_string(tmp_path):
    assert read_landmarks(str(save(tmp_path, "a.tem", TEM))).points.tolist() == FACE


def test_the_format_may_be_named(tmp_path):
    path = save(tmp_path, "a.txt", PTS)
    assert read_landmarks(path, format="pts").points.tolist() == FACE
    assert read_landmarks(path, format=".PTS").points.tolist() == FACE


@pytest.mark.parametrize(
    "text",
    [
        "x,y,z\n30,40,3\n70.5,42,-4.5\n51,81.25,0\n12,9,7\n",
        "Z,y,X\n3,40,30\n-4.5,42,70.5\n0,81.25,51\n7,9,12\n",
        "30,40,3\n70.5,42,-4.5\n51,81.25,0\n12,9,7\n",
    ],
)
def test_a_table_may_have_a_depth(tmp_path, text):
    assert read_landmarks(save(tmp_path, "a.csv", text)).points.tolist() == np.c_[FACE, DEPTH].tolist()


def test_xml_says_its_encoding(tmp_path):
    xml = f"<?xml version='1.0' encoding='ISO-8859-1'?>{XML.replace('a.jpg', 'é.jpg')}"
    assert read_landmarks(save(tmp_path, "a.xml", xml.encode("latin-1"))).points.tolist() == FACE


@pytest.mark.parametrize(
    ("count", "scheme"), [(68, "ibug68"), (189, "frl189"), (478, "mesh478"), (67, "points")]
)
def test_the_scheme_follows_from_the_number_of_points(tmp_path, count, scheme):
    rows = "".join(f"{x},{y}\n" for x, y in scattered(count))
    assert read_landmarks(save(tmp_path, "a.csv", rows)).scheme == scheme


IBUG = {
    "chin": (0, 17),
    "leyebrow": (17, 22),
    "reyebrow": (22, 27),
    "nose": (27, 36),
    "leye": (36, 42),
    "reye": (42, 48),
    "mouth": (48, 68),
}

LANDMARKER = ["chin", "leye", "reye", "leyebrow", "nose", "reyebrow", "mouth"]


def landmarker_file(version: int, points: list[list[float]]) -> str:
    """What landmarker.io saves with its ibug68 template, which has an order of its own."""
    groups = [(label, [[y, x] for x, y in points[slice(*IBUG[label])]]) for label in LANDMARKER]
    if version == 1:
        v1 = [{"label": label, "landmarks": [{"point": p} for p in marks]} for label, marks in groups]
        return json.dumps({"version": 1, "groups": v1})
    flat = [point for _, marks in groups for point in marks]
    labels, start = [], 0
    for label, marks in groups:
        labels.append({"label": label, "mask": list(range(start, start + len(marks)))})
        start += len(marks)
    body = {"labels": labels, "landmarks": {"points": flat}}
    return json.dumps({"version": 2, **body} if version == 2 else {"version": 3, "groups": {"ibug68": body}})


@pytest.mark.parametrize("version", [1, 2, 3])
def test_landmarker_io_s_68_points_come_in_ibug_s_order(tmp_path, version):
    points = scattered(68).tolist()
    landmarks = read_landmarks(save(tmp_path, "a.json", landmarker_file(version, points)))
    assert landmarks.scheme == "ibug68"
    assert landmarks.points.tolist() == points


@pytest.mark.parametrize("mask", [[0, 0], ["0"], "01", None, 7, [0.5], [[0]]])
def test_labels_of_any_other_kind_leave_the_order_alone(tmp_path, mask):
    points = scattered(68).tolist()
    document = json.loads(landmarker_file(2, points))
    stored = [[x, y] for y, x in document["landmarks"]["points"]]
    document["labels"][0]["mask"] = mask
    assert read_landmarks(save(tmp_path, "a.json", json.dumps(document))).points.tolist() == stored
    document["labels"][0] = {"label": [0], "mask": [0]}
    assert read_landmarks(save(tmp_path, "a.json", json.dumps(document))).points.tolist() == stored
    document["labels"] = mask
    assert read_landmarks(save(tmp_path, "a.json", json.dumps(document))).points.tolist() == stored


def test_labels_reorder_no_other_number_of_points(tmp_path):
    labels = '[{"label": "mouth", "mask": [0, 1]}, {"label": "chin", "mask": [2, 3]}]'
    path = save(tmp_path, "a.json", JSON.replace('"labels": []', f'"labels": {labels}'))
    assert read_landmarks(path).points.tolist() == FACE


@pytest.mark.parametrize(
    ("group", "count", "scheme"), [("points", 68, "points"), ("PTS", 68, "ibug68"), ("mesh478", 68, "ibug68")]
)
def test_a_group_that_fits_names_the_scheme(tmp_path, group, count, scheme):
    body = {"labels": [], "landmarks": {"points": scattered(count).tolist()}}
    path = save(tmp_path, "a.json", json.dumps({"version": 3, "groups": {group: body}}))
    assert read_landmarks(path).scheme == scheme


OTHER = [[1.0, 2.0], [3.0, 5.0], [8.0, 13.0], [0.0, 7.0]]
TWO_FACES = {
    "two.csv": OPENFACE + "1, 1, 0.000, 0.5, 1, 1, 3, 8, 0, 2, 5, 13, 7, -1, -2, 500\n",
    "two.json": JSON[:-2] + ', "b": {"landmarks": {"points": [[2, 1], [5, 3], [13, 8], [7, 0]]}}}}',
    "boxes.xml": XML.replace(
        "</box>", "</box><box/><box><part name='1' x='1' y='2'/><part name='2' x='3' y='5'/>"
        "<part name='3' x='8' y='13'/><part name='4' x='0' y='7'/></box>"
    ),
    "images.xml": XML.replace(
        "</images>", "<image file='b.jpg'><box><part name='1' x='1' y='2'/><part name='2' x='3' y='5'/>"
        "<part name='3' x='8' y='13'/><part name='4' x='0' y='7'/></box></image></images>"
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", TWO_FACES)
def test_one_of_several_faces(tmp_path, name):
    path = save(tmp_path, name, TWO_FACES[name])
    assert read_landmarks(path, face=0).points.tolist() == FACE
    assert read_landmarks(path, face=1).points.tolist() == OTHER
    with pytest.raises(
        LandmarkError, match=r"holds 2 faces \(0: .+, 1: .+\); choose one with face=0 to face=1"
    ):
        read_landmarks(path)
    for absent in (2, -1):
        with pytest.raises(FaceNotFoundError, match=f"has no face {absent}: it holds 2"):
            read_landmarks(path, face=absent)


def test_many_faces_are_not_all_listed(tmp_path):
    path = save(tmp_path, "a.csv", OPENFACE + OPENFACE.splitlines()[1].join(["", "\n"]) * 6)
    with pytest.raises(LandmarkError, match=r"holds 7 faces \(0: line 2, .*, 4: line 6, \.\.\.\)"):
        read_landmarks(path)


@pytest.mark.parametrize("name", ["plain.pts", "plain.tem", "plain.csv", "plain.xml", "version_2.json"])
def test_the_only_face_may_be_asked_for(tmp_path, name):
    path = save(tmp_path, name, BY_HAND[name])
    assert read_landmarks(path, face=0).points.tolist() == FACE
    with pytest.raises(FaceNotFoundError, match="has no face 1: it holds 1"):
        read_landmarks(path, face=1)


def test_openface_rows_without_success_hold_no_face(tmp_path):
    header, row = OPENFACE.splitlines()
    failed = "2, 0, 0.033, 0, 0" + ", 0" * 11
    path = save(tmp_path, "a.csv", "\n".join([header, failed, row, failed]))
    assert read_landmarks(path).points.tolist() == FACE
    with pytest.raises(FaceNotFoundError, match="holds no face"):
        read_landmarks(save(tmp_path, "a.csv", "\n".join([header, failed])))


def test_a_broken_face_does_not_hide_another(tmp_path):
    path = save(tmp_path, "a.json", TWO_FACES["two.json"].replace("[2, 1]", "[2, null]"))
    assert read_landmarks(path, face=0).points.tolist() == FACE
    with pytest.raises(LandmarkError, match="point 0 is missing"):
        read_landmarks(path, face=1)


@pytest.mark.skipif(not PORTRAITS.is_dir(), reason="the shared portraits are not beside this checkout")
def test_real_tem_files():
    paths = sorted(PORTRAITS.glob("*.tem"))
    assert len(paths) == 14
    for path in paths:
        landmarks = read_landmarks(path)
        assert landmarks.scheme == "frl189"
        assert landmarks.points.tolist() == np.loadtxt(path, skiprows=1, max_rows=189).tolist()
        assert 150 < landmarks.interocular_distance < 300
