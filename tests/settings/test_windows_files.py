"""Settings and landmarks as Windows keeps them: with a byte order mark, and lines that end in CRLF."""

import numpy as np
import pytest

from relit.errors import LandmarkError, OptionError
from relit.face.landmark_files import FORMATS, landmarks_from, read_landmarks, write_landmarks
from relit.face.landmarks import Landmarks
from relit.settings.options import TransferOptions
from relit.settings_file import Settings, as_json, read_settings

MARKS = Landmarks(np.array([[30.5, 40], [70, 41], [50, 82]]))


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16"])
@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_settings_are_read_all_the_same(tmp_path, encoding, end):
    path = tmp_path / "settings.json"
    text = as_json(Settings(TransferOptions(strength=0.5, light="rim"), MARKS)).decode()
    path.write_bytes((text.replace("\n", end) + end * 3).encode(encoding))
    found = read_settings(path)
    assert found.options == TransferOptions(strength=0.5, light="rim")
    np.testing.assert_array_equal(found.target.points, MARKS.points)


@pytest.mark.parametrize("extension", FORMATS)
@pytest.mark.parametrize("mark", [b"", b"\xef\xbb\xbf"])
@pytest.mark.parametrize("end", [b"\r\n", b"\n"])
def test_landmarks_are_read_all_the_same(tmp_path, extension, mark, end):
    path = tmp_path / f"a{extension}"
    write_landmarks(path, MARKS)
    expected = read_landmarks(path).points
    data = mark + path.read_bytes().replace(b"\n", end) + end * 3
    np.testing.assert_array_equal(landmarks_from(data, path).points, expected)


@pytest.mark.parametrize("extension", FORMATS)
def test_landmarks_in_utf_16_are_read_or_refused_in_a_line(tmp_path, extension):
    path, found, told = tmp_path / f"a{extension}", None, "-"
    write_landmarks(path, MARKS)
    try:
        found = landmarks_from(path.read_text().encode("utf-16"), path).points
    except LandmarkError as error:
        told = str(error)
    assert told.isprintable()
    if found is not None:
        np.testing.assert_array_equal(found, read_landmarks(path).points)


def test_what_is_wrong_in_settings_names_the_file_in_one_line(tmp_path):
    path = tmp_path / "settings.json"
    path.write_text('{"landmarks": {"target": {"points": [[1, 2]]}}}')
    with pytest.raises(LandmarkError, match=r"settings\.json: target_landmarks: "):
        read_settings(path)
    path.write_text('{"options": {"' + "a\\nb" * 900 + '": 1}}')
    with pytest.raises(OptionError) as refused:
        read_settings(path)
    assert str(refused.value).isprintable()
    assert len(str(refused.value)) < 700
