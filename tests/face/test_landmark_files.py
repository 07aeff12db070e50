"""Landmark files: hand-written ones read right, written ones read back, broken ones say what is wrong."""

from __future__ import annotations

import contextlib
import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from relit.errors import FaceNotFoundError, LandmarkError, OutputError
from relit.face import landmark_files
from relit.face.landmark_files import read_landmarks, write_landmarks
from relit.face.landmarks import Landmarks
from relit.face.schemes import SCHEMES

PORTRAITS = Path(__file__).parents[3] / "shared" / "portraits"
EXTENSIONS = [".pts", ".tem", ".json", ".ljson", ".csv", ".xml"]

# No symmetry, so that swapped axes, another origin or another order cannot pass.
FACE = [[30.0, 40.0], [70.5, 42.0], [51.0, 81.25], [12.0, 9.0]]
DEPTH = [3.0, -4.5, 0.0, 7.0]

# fmt: off
PTS = "version: 1\nn_points: 4\n{\n31 41\n71.5 43\n52 82.25\n13 10\n}\n"
TEM = "4\n30\t40\n70.5\t42\n51\t81.25\n12\t9\n1\n0\n3\n0 1 2\n"
GROUP = '{"labels": [], "landmarks": {"points": [[40, 30], [42, 70.5], [81.25, 51], [9, 12]]}}'
JSON = '{"version": 3, "groups": {"a": ' + GROUP + "}}"
CSV = "x,y\n30,40\n70.5,42\n51,81.25\n12,9\n"
OPENFACE = (
    "frame, face_id, timestamp, confidence, success, x_0, x_1, x_2, x_3, y_0, y_1, y_2, y_3, X_0, Y_0, Z_0\n"
    "1, 0, 0.000, 0.98, 1, 30, 70.5, 51, 12, 40, 42, 81.25, 9, -1, -2, 500\n"
)
PARTS = (
    "<part name='00' x='30' y='40'/><part name='01' x='70.5' y='42'/>"
    "<part name='02' x='51' y='81.25'/><part name='03' x='12' y='9'/>"
)
XML = (
    "<dataset><images><image file='a.jpg'><box top='1' left='2' width='3' height='4'>"
    f"{PARTS}</box></image></images></dataset>"
)

BY_HAND = {
    "plain.pts": PTS,
    "messy.PTS": (
        "\ufeff// by hand\r\nN_Points :  4 \t\r\n\r\n{\t\r\n"
        " 31\t41 # eye\r\n\r\n71.5 43 // eye\r\n52 8.225e1\r\n13 10\r\n}"
    ),
    "no_count.pts": "{\n31 41\n71.5 43\n52 82.25\n13 10\n}\n",
    "plain.tem": TEM,
    "spaces.tem": "# by hand\r\n4\r\n30 40\r\n\r\n70.5   42\r\n51 81.25\r\n12 9\r\n0\r\n",
    "webmorph.tem": TEM + '0\n\n{"last_saved": "2014-01-01"}\n',
    "version_3.json": JSON,
    "version_3.ljson": JSON,
    "version_2.json": (
        '{"version": 2, "labels": [{"label": "all", "mask": [0, 1, 2, 3]}], "landmarks":'
        '{"connectivity": [[0, 1]], "points": [[40, 30], [42, 70.5], [81.25, 51], [9, 12]]}}'
    ),
    "version_1.json": (
        '{"version": 1, "groups": [{"label": "eyes", "connectivity": [[0, 1]], "landmarks":'
        '[{"point": [40, 30]}, {"point": [42, 70.5]}]}, {"label": "rest", "landmarks":'
        '[{"point": [81.25, 51]}, {"point": [9, 12]}]}]}'
    ),
    "plain.csv": CSV,
    "no_header.csv": "30,40\r\n70.5,42\r\n51,81.25\r\n12,9",
    "named.csv": '# by hand\nname, Y, X,\n"eye, right",40,30\neye,42,70.5,\nmouth,81.25,51\n\near,9,12\n,,\n',
    "openface.csv": OPENFACE,
    "image.csv": (
        "face, confidence, x_0, x_1, x_2, x_3, y_0, y_1, y_2, y_3\n"
        "0, 0.98, 30, 70.5, 51, 12, 40, 42, 81.25, 9\n"
    ),
    "byte_order_mark.csv": "\ufeff" + CSV,
    "plain.xml": XML,
    "unsorted.xml": XML.replace(PARTS, (
        "<part name='11' x='51' y='81.25'/><part name='9' x='30' y='40'/>"
        "<part name='12' x='12' y='9'/><part name='10' x='70.5' y='42'/>"
    )),
    "long_name.xml": XML.replace("03", "9" * 5000),
    "words.xml": XML.replace(PARTS, (
        "<part name='c' x='51' y='81.25'/><part name='a' x='30' y='40'/>"
        "<part name='ear' x='12' y='9'/><part name='b' x='70.5' y='42'/>"
    )),
}
# fmt: on


def save(folder: Path, name: str, content: str | bytes) -> Path:
    path = folder / name
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return path


def scattered(count: int, dimensions: int = 2) -> np.ndarray:
    return np.random.default_rng(count).normal(200, 100, (count, dimensions))


# --- files written by hand


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


# --- menpo


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


# --- several faces


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


# --- writing


def test_what_is_written(tmp_path):
    landmarks = Landmarks(np.c_[FACE, DEPTH], confidence=0.75)
    texts = {}
    for extension in EXTENSIONS:
        write_landmarks(tmp_path / f"a{extension}", landmarks, image_name="photo & é.jpg")
        texts[extension] = (tmp_path / f"a{extension}").read_text(encoding="utf-8")
    assert texts[".pts"] == "version: 1\nn_points: 4\n{\n31.0 41.0\n71.5 43.0\n52.0 82.25\n13.0 10.0\n}\n"
    assert texts[".tem"] == "4\n30\t40\n70.5\t42\n51\t81.25\n12\t9\n0\n"
    assert texts[".csv"] == "x,y,z\n30,40,3\n70.5,42,-4.5\n51,81.25,0\n12,9,7\n"
    assert texts[".json"] == texts[".ljson"]
    assert json.loads(texts[".json"]) == {
        "version": 3,
        "groups": {
            "points": {
                "labels": [],
                "landmarks": {"points": [[40, 30], [42, 70.5], [81.25, 51], [9, 12]]},
                "depth": DEPTH,
                "confidence": 0.75,
            }
        },
    }
    assert texts[".xml"] == (
        "<?xml version='1.0' encoding='UTF-8'?>\n<dataset>\n  <images>\n"
        '    <image file="photo &amp; é.jpg">\n      <box top="9" left="12" width="60" height="74">\n'
        '        <part name="00" x="30" y="40" />\n        <part name="01" x="70.5" y="42" />\n'
        '        <part name="02" x="51" y="81.25" />\n        <part name="03" x="12" y="9" />\n'
        "      </box>\n    </image>\n  </images>\n</dataset>\n"
    )


def test_dlib_s_order_as_text_is_the_order_of_the_points(tmp_path):
    write_landmarks(tmp_path / "a.xml", Landmarks(scattered(478)))
    names = [line.split('"')[1] for line in (tmp_path / "a.xml").read_text().splitlines() if "<part" in line]
    assert names == sorted(names)
    assert len(names[0]) == 3


def test_dlib_s_box_covers_the_points(tmp_path):
    write_landmarks(tmp_path / "a.xml", Landmarks([[1.5, 10.25], [7.25, 11], [3, 15.5]]))
    assert '<box top="10" left="1" width="8" height="7">' in (tmp_path / "a.xml").read_text()


def test_an_image_name_that_is_not_unicode_does_no_harm(tmp_path):
    write_landmarks(tmp_path / "a.xml", Landmarks(FACE), image_name="\udcff.jpg")
    assert read_landmarks(tmp_path / "a.xml").points.tolist() == FACE


coordinates = st.floats(-1e5, 1e5, allow_subnormal=True)


@st.composite
def faces(draw: st.DrawFn) -> Landmarks:
    size = draw(st.sampled_from([2, 3]))
    points = draw(st.lists(st.tuples(*[coordinates] * size), min_size=3, max_size=12))
    try:
        return Landmarks(points, confidence=draw(st.none() | st.floats(0, 1)))
    except LandmarkError:
        assume(False)
        raise


@pytest.mark.parametrize("extension", EXTENSIONS)
@settings(max_examples=50, deadline=None)
@given(landmarks=faces())
def test_every_number_survives(tmp_path_factory, extension, landmarks):
    path = tmp_path_factory.mktemp("face") / f"a{extension}"
    write_landmarks(path, landmarks)
    again = read_landmarks(path)
    assert again.xy.tolist() == landmarks.xy.tolist()
    if "json" in extension or extension == ".csv":
        assert again.points.tolist() == landmarks.points.tolist()
    assert again.confidence == (landmarks.confidence if "json" in extension else None)


@pytest.mark.parametrize("extension", EXTENSIONS)
@pytest.mark.parametrize("scheme", SCHEMES)
def test_every_scheme_survives_a_chain_of_formats(tmp_path, scheme, extension):
    landmarks = Landmarks(scattered(SCHEMES[scheme].count or 7, 3), scheme)
    for step in (extension, *EXTENSIONS):
        path = tmp_path / f"a{step}"
        write_landmarks(path, landmarks, overwrite=True)
        again = read_landmarks(path)
        assert again.scheme == scheme
        assert again.xy.tolist() == landmarks.xy.tolist()
        landmarks = again


def test_only_json_keeps_a_scheme_that_the_number_of_points_hides(tmp_path):
    landmarks = Landmarks(scattered(68), "points")
    write_landmarks(tmp_path / "a.json", landmarks)
    write_landmarks(tmp_path / "a.csv", landmarks)
    assert read_landmarks(tmp_path / "a.json").scheme == "points"
    assert read_landmarks(tmp_path / "a.csv").scheme == "ibug68"


def test_a_file_is_replaced_only_when_asked(tmp_path):
    path = save(tmp_path, "a.csv", "old")
    with pytest.raises(OutputError, match="use --force or overwrite=True"):
        write_landmarks(path, Landmarks(FACE))
    assert path.read_text() == "old"
    write_landmarks(path, Landmarks(FACE), overwrite=True)
    assert path.read_text() == CSV


def test_the_format_to_write_may_be_named(tmp_path):
    write_landmarks(tmp_path / "a.txt", Landmarks(FACE), format="csv")
    assert (tmp_path / "a.txt").read_text() == CSV


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("a.txt", r"unknown landmark format '\.txt'; use one of \.pts, .*\.xml"),
        ("no/a.csv", "there is no folder"),
        ("a\0.csv", "cannot be written"),
    ],
)
def test_where_nothing_can_be_written(tmp_path, name, message):
    with pytest.raises(OutputError, match=message):
        write_landmarks(tmp_path / name, Landmarks(FACE))
    assert list(tmp_path.iterdir()) == []


# --- what is wrong with a file


# fmt: off
BROKEN = {
    ".txt": [(PTS, r"unknown landmark format '\.txt'; use one of \.pts, .* \.csv, \.xml")],
    "": [(PTS, "unknown landmark format ''")],
    ".pts": [
        ("31 41\n71 43\n", r"between a line '\{' and a line '\}'"),
        (PTS.replace("}", ""), r"between a line '\{' and a line '\}'; is the file complete"),
        (PTS.replace("13 10\n", ""), "line 2: 'n_points: 4', but it holds 3"),
        (PTS.replace(": 4", ": four"), "line 2: 'n_points: four', but it holds 4"),
        (PTS.replace("n_points: 4", "N_POINTS: 5"), "line 2: 'N_POINTS: 5', but it holds 4"),
        (PTS.replace("52 82.25", "52"), "line 6: expected two numbers x y, found '52'"),
        (PTS.replace("52 82.25", "52 82.25 1"), "line 6: expected two numbers x y, found '52 82.25 1'"),
        (PTS.replace("52 82.25", "52 l"), "line 6: expected two numbers x y, found '52 l'"),
        (PTS.replace("52 82.25", "52 1e9999999"), "line 6: expected two numbers x y"),
        (PTS.replace("52 82.25", "52 nan"), "point 2 is missing or not finite"),
        (PTS.replace("52 82.25", "52 1e999"), "point 2 is missing or not finite"),
        ("{\n1 1\n2 2\n}\n", "at least 3 points are needed, got 2"),
        ("{\n1 1\n2 2\n3 3\n}\n", "points lie on one line"),
        ("{\n}\n", "holds no points"),
    ],
    ".tem": [
        ("# nothing\n", "line 1: expected the number of points, found ''"),
        ("four\n", "line 1: expected the number of points, found 'four'"),
        ("1234567\n", "line 1: expected the number of points, found '1234567'"),
        (TEM.replace("4\n", "9\n", 1), "line 6: expected two numbers x y, found '1'"),
        (TEM.replace("4\n", "3\n", 1), r"line 5: expected .* definitions after 3 points, found '12\\t9'"),
        ("4\n1 2\n3 4\n", "line 1: says 4 points, but 2 follow"),
        (TEM.removesuffix("1\n0\n3\n0 1 2\n"), "line 6: expected .* definitions after 4 points, found ''"),
        (TEM.removesuffix("0 1 2\n"), "line 6: the line definitions take 3 lines, but 2 follow"),
        (TEM.replace("70.5", "70,5"), "line 3: expected two numbers x y"),
    ],
    ".json": [
        (JSON[:50], r"is not valid JSON \(.*\); is the file complete"),
        ("[" * 100_000, "is not valid JSON"),
        ("[[1, 2], [3, 4], [5, 9]]", "expected menpo's ljson, .* found version None"),
        ('{"version": 4}', "version is 1, 2 or 3; found version 4"),
        ('{"version": 3}', "'the file': expected an object under 'groups'"),
        ('{"version": 3, "groups": {}}', "holds no face"),
        ('{"version": 3, "groups": {"a": 1}}', "'groups': expected an object under 'a'"),
        ('{"version": 3, "groups": {"a": {}}}', "'a': expected an object under 'landmarks'"),
        ('{"version": 2, "landmarks": {"points": 1}}', "'the file': expected a list under 'points'"),
        ('{"version": 2, "landmarks": {"points": []}}', "holds no points"),
        ('{"version": 1, "groups": {}}', "'the file': expected a list under 'groups'"),
        ('{"version": 1, "groups": [1]}', r"'groups\[0\]': expected a list under 'landmarks'"),
        ('{"version": 1, "groups": [{"landmarks": [1]}]}', r"'groups\[0\]\.landmarks\[0\]': .* 'point'"),
        (JSON.replace("[42, 70.5]", "[null, null]"), "point 1 is missing or not finite; place it"),
        (JSON.replace("[42, 70.5]", "[NaN, 1]"), "point 1 is missing or not finite; place it"),
        (JSON.replace("[42, 70.5]", f"[1{'0' * 400}, 1]"), "point 1 is missing or not finite; place it"),
        (JSON.replace("[42, 70.5]", "[1, 2, 3]"), r"'a', point 1: expected \[y, x\], found \[1, 2, 3\];"),
        (JSON.replace("[42, 70.5]", "70.5"), r"'a', point 1: expected \[y, x\], found 70\.5"),
        (JSON.replace("[42, 70.5]", '["42", 1]'), "'a', point 1: expected a number, found '42'"),
        (JSON.replace("[42, 70.5]", "[true, 1]"), "'a', point 1: expected a number, found True"),
        (JSON.replace('"a"', '"a\\nb"').replace("[42, 70.5]", "1"), r"'a\\nb', point 1: expected"),
        (JSON.replace('"lab', '"depth": [1, 2, 3], "lab'), "'a': expected 'depth' to be a list of 4 numbers"),
        (JSON.replace('"lab', '"depth": 7, "lab'), "'a': expected 'depth' to be a list of 4 numbers"),
        (JSON.replace('"lab', '"depth": [1, "b", 3, 4], "lab'), "'a', depth 1: expected a number, found 'b'"),
        (JSON.replace('"lab', '"confidence": "high", "lab'), "'a', confidence: expected a number"),
    ],
    ".csv": [
        ("# nothing\n", "line 1: expected columns x and y"),
        ("x,y\n", "holds no points"),
        ("y,z\n1,2\n", "line 1: expected columns x and y, or OpenFace's x_0, y_0, ...; found 'y,z'"),
        ("a;b\n1;2\n", "line 1: expected columns x and y"),
        ("1,2,3,4\n", "line 1: expected x,y or x,y,z, found 4 columns"),
        ("1\n2\n", "line 1: expected x,y or x,y,z, found 1 columns"),
        ("3O,40\n70.5,42\n51,81\n", "line 1, column x: expected a number, found '3O'"),
        (CSV.replace("51,", "5,1,"), "line 4: expected 2 columns, found 3"),
        (CSV.replace("51,81.25", "51,"), "line 4: expected 2 columns, found 1"),
        (CSV.replace("51,", "5l,"), "line 4, column x: expected a number, found '5l'"),
        (CSV.replace("51,", ","), "line 4, column x: expected a number, found ''"),
        (CSV.replace("51,", "nan,"), "point 2 is missing or not finite"),
        ('"' + "a" * 200_000, "line 1: is not CSV"),
        (OPENFACE.replace(" y_2,", " q,"), "OpenFace's column y_2 is missing"),
        (OPENFACE.replace(" x_2,", " q,"), "OpenFace's column x_2 is missing"),
        (OPENFACE.replace(" x_3,", " q,"), "OpenFace's column x_3 is missing"),
        (OPENFACE.replace("70.5", "?"), r"line 2, column x_1: expected a number, found '\?'"),
        (OPENFACE.replace("0.98", "?"), r"line 2, column confidence: expected a number, found '\?'"),
        (OPENFACE.splitlines()[0], "holds no face"),
    ],
    ".xml": [
        (XML[:-20], r"is not valid XML \(.*\); is the file complete"),
        ("<?xml version='1.0' encoding='klingon'?><dataset/>", "is not valid XML"),
        ("<?xml version='1.0' encoding='big5'?><dataset/>", "is not valid XML"),
        ("<svg/>", "expected dlib's <dataset>, found 'svg'"),
        ("<dataset/>", "holds no face"),
        (XML.replace(PARTS, ""), "holds no face"),
        (XML.replace("'02'", "'01'"), r"'a\.jpg' box 0: two parts have the same name"),
        (XML.replace("name='02' ", "").replace("name='03' ", ""), "two parts have the same name"),
        (XML.replace("'02'", "'04'"), r"'a\.jpg' box 0: no part is named between 01 and 03"),
        (XML.replace("'03'", "'99999'"), "no part is named between 02 and 99999"),
        (XML.replace("x='51'", ""), r"'a\.jpg' box 0, part '02', x: expected a number, found ''"),
        (XML.replace("y='9'", "y='b'"), "part '03', y: expected a number, found 'b'"),
        ("<!DOCTYPE dataset>" + XML, r"\.xml: declares a DOCTYPE"),
        ('<!DOCTYPE d [<!ENTITY a "b"><!ENTITY c "&a;&a;">]><d>&c;</d>', r"\.xml: declares a DOCTYPE"),
        ('<!DOCTYPE d [<!ENTITY a SYSTEM "f">]><d>&a;</d>'.encode("utf-16"), r"\.xml: declares a DOCTYPE"),
    ],
}
# fmt: on
for extension in EXTENSIONS:
    BROKEN.setdefault(extension, []).extend(
        [
            ("", "is empty"),
            (" \n\n", "is empty"),
            (b"\x89PNG\r\n\x1a\n\x00\x00", "is not a text file|is not valid XML"),
        ]
    )


@pytest.mark.parametrize(
    ("extension", "content", "message"),
    [(extension, *case) for extension, cases in BROKEN.items() for case in cases],
)
def test_what_is_wrong_is_said_in_one_line(tmp_path, extension, content, message):
    path = save(tmp_path, f"a{extension}", content)
    with pytest.raises(LandmarkError, match=message) as caught:
        read_landmarks(path)
    assert str(caught.value).startswith(f"{path}: ")
    assert not str(caught.value).startswith(f"{path}: landmarks")
    assert "\n" not in str(caught.value)
    assert len(str(caught.value)) < len(str(path)) + 250


@pytest.mark.parametrize("name", ["missing.pts", "folder.pts", "a\0.pts"])
def test_what_cannot_be_read(tmp_path, name):
    (tmp_path / "folder.pts").mkdir()
    with pytest.raises(LandmarkError, match="cannot be read"):
        read_landmarks(tmp_path / name)


def test_a_large_file_is_not_read(tmp_path, monkeypatch):
    monkeypatch.setattr(landmark_files, "_MAX_BYTES", 2**20)
    assert read_landmarks(save(tmp_path, "a.pts", PTS.ljust(2**20))).points.tolist() == FACE
    with pytest.raises(LandmarkError, match="is larger than 1 MB"):
        read_landmarks(save(tmp_path, "a.pts", PTS.ljust(2**20 + 1)))


@pytest.mark.parametrize(
    "name", ["plain.pts", "plain.tem", "version_1.json", "version_2.json", "version_3.json", "plain.xml"]
)
def test_a_truncated_file_never_passes(tmp_path, name):
    content = BY_HAND[name].rstrip()
    end = (
        content.rindex("0 1 2") if name == "plain.tem" else len(content)
    )  # the points of a line are not read
    for length in range(end):
        with pytest.raises(LandmarkError):
            read_landmarks(save(tmp_path, name, content[:length]))


@pytest.mark.parametrize(
    "name",
    ["plain.pts", "plain.tem", "version_1.json", "version_3.json", "openface.csv", "plain.csv", "plain.xml"],
)
@settings(max_examples=60, deadline=None)
@given(data=st.data())
def test_a_damaged_file_is_read_or_refused(tmp_path_factory, name, data):
    content = BY_HAND[name].encode()
    start = data.draw(st.integers(0, len(content)))
    end = data.draw(st.integers(start, min(len(content), start + 8)))
    damage = data.draw(
        st.binary(max_size=6) | st.sampled_from([b"-", b"1", b" ", b"\n", b",", b"null", b"{", b"<", b"'"])
    )
    path = save(tmp_path_factory.mktemp("face"), name, content[:start] + damage + content[end:])
    with contextlib.suppress(LandmarkError):
        assert read_landmarks(path).points.shape[1] in (2, 3)


# --- real files


@pytest.mark.skipif(not PORTRAITS.is_dir(), reason="the shared portraits are not beside this checkout")
def test_real_tem_files():
    paths = sorted(PORTRAITS.glob("*.tem"))
    assert len(paths) == 14
    for path in paths:
        landmarks = read_landmarks(path)
        assert landmarks.scheme == "frl189"
        assert landmarks.points.tolist() == np.loadtxt(path, skiprows=1, max_rows=189).tolist()
        assert 150 < landmarks.interocular_distance < 300


def test_arrays_may_be_written(tmp_path):
    write_landmarks(tmp_path / "face.csv", [[1, 2], [30, 4], [5, 60]])
    assert read_landmarks(tmp_path / "face.csv").points.tolist() == [[1, 2], [30, 4], [5, 60]]
    with pytest.raises(LandmarkError, match="landmarks: expected"):
        write_landmarks(tmp_path / "other.csv", [1, 2, 3])
    assert not (tmp_path / "other.csv").exists()
