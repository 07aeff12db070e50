"""Landmarks that are written come back, number by number, through every format."""

from __future__ import annotations

import json

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from relit.errors import LandmarkError, OutputError
from relit.face.landmark_files import read_landmarks, write_landmarks
from relit.face.landmarks import Landmarks
from relit.face.schemes import SCHEMES
from tests.face.landmark_texts import CSV, DEPTH, EXTENSIONS, FACE, save, scattered


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


def test_arrays_may_be_written(tmp_path):
    write_landmarks(tmp_path / "face.csv", [[1, 2], [30, 4], [5, 60]])
    assert read_landmarks(tmp_path / "face.csv").points.tolist() == [[1, 2], [30, 4], [5, 60]]
    with pytest.raises(LandmarkError, match="landmarks: expected"):
        write_landmarks(tmp_path / "other.csv", [1, 2, 3])
    assert not (tmp_path / "other.csv").exists()
