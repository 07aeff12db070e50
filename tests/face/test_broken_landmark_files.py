"""Landmark files that are broken or cut short say what is wrong, in one line."""

from __future__ import annotations

import contextlib

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from relit.errors import LandmarkError
from relit.face import landmark_files
from relit.face.landmark_files import read_landmarks
from tests.face.landmark_texts import (
    BY_HAND,
    CSV,
    EXTENSIONS,
    FACE,
    JSON,
    OPENFACE,
    PARTS,
    PTS,
    TEM,
    XML,
    save,
)

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
        ("x_0,y_0\n" + "1,2\n" * 16_001, "holds 16001 faces, more than 16000; split it into several files"),
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
