"""Manifests as Excel and Windows write them: byte order marks, UTF-16, semicolons, tabs, ends of lines."""

import csv
import io

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from relit.batch.manifest import Manifest
from relit.errors import OptionError

ROWS = [["target", "output", "strength"], ["a b.png", "ä;,\t.png", "0.5"], ["日本.png", "x\ny.png", ""]]


def table(delimiter=",", end="\r\n", rows=ROWS):
    text = io.StringIO(newline="")
    csv.writer(text, delimiter=delimiter, lineterminator=end).writerows(rows)
    return text.getvalue()


def read(folder, data, name="m.csv"):
    (folder / name).write_bytes(data)
    return [(row.target, row.output, row.options, row.problem) for row in Manifest(str(folder / name))]


@pytest.fixture
def expected(tmp_path):
    return read(tmp_path, table().encode(), "plain.csv")


@pytest.mark.parametrize("delimiter", [",", ";", "\t"])
@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "utf-16-be-bom"])
@pytest.mark.parametrize("end", ["\r\n", "\n"])
@pytest.mark.parametrize("around", ["", "{end}", "{end}{end}{end}"])
def test_all_say_the_same(tmp_path, expected, delimiter, encoding, end, around):
    blank = around.format(end=end)
    text = blank + table(delimiter, end) + blank
    data = b"\xfe\xff" + text.encode("utf-16-be") if encoding == "utf-16-be-bom" else text.encode(encoding)
    assert [row[3] for row in expected] == ["", ""]
    assert expected[0][0] == f"{tmp_path}/a b.png"
    assert read(tmp_path, data) == expected


@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16"])
def test_json_lines_too(tmp_path, encoding):
    text = '{"target": "日本.png"}\r\n\r\n{"target": "b.png"}\r\n\r\n'
    assert [row[0] for row in read(tmp_path, text.encode(encoding), "m.jsonl")] == [
        f"{tmp_path}/日本.png",
        f"{tmp_path}/b.png",
    ]


def test_excels_line_of_columns_may_be_quoted_and_spaced(tmp_path):
    ((target, *_),) = read(tmp_path, b'"target";reference \r\na.png;b.png\r\n')
    assert target == f"{tmp_path}/a.png"


def test_a_comma_for_a_point_is_told_of_its_row(tmp_path):
    from relit.batch.jobs import options_with
    from relit.settings.options import TransferOptions

    ((_, _, options, _),) = read(tmp_path, b"target;strength\na.png;0,5\n")
    with pytest.raises(OptionError, match=r"strength: expected a finite number .*, got '0,5'"):
        options_with(TransferOptions(), options)


def test_a_cell_too_many_is_told_of_its_row(tmp_path):
    ((_, _, _, problem),) = read(tmp_path, b"target;output\na.png;b.png;c.png\n")
    assert problem == "expected 2 cells, got 3; quote cells that hold what parts them"


@given(
    st.binary(max_size=60),
    st.sampled_from([b"\xff\xfe", b"\xfe\xff", b"\xef\xbb\xbf"]),
    st.sampled_from(["csv", "jsonl"]),
)
@example(b"t", b"\xff\xfe", "csv")
@example(b"\x00\xd8" * 3, b"\xff\xfe", "jsonl")
@settings(max_examples=200, deadline=None)
def test_nonsense_behind_a_mark_is_refused_in_one_line(tmp_path_factory, data, mark, kind):
    folder, told = tmp_path_factory.mktemp("m"), []
    try:
        told += [problem for *_, problem in read(folder, mark + data, f"m.{kind}")]
    except OptionError as error:
        told.append(str(error))
    assert all(len(line) < 700 and "\n" not in line for line in told)
