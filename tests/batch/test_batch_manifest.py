"""Rows of a batch: what a manifest says is what comes out, however it is written; pairs are all there are."""

import csv
import io
import itertools
import json
import string
from contextlib import suppress

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from relit.batch.jobs import options_with
from relit.batch.manifest import Manifest
from relit.batch.pairing import Pairs
from relit.errors import OptionError
from relit.settings.options import TransferOptions

# What a file name can be on one system or another: odd quotes, commas, line breaks, any script, and bytes
# that are not UTF-8, which Python holds as lone surrogates.
NAMES = st.text(
    st.characters(exclude_categories=("Cs",), exclude_characters="\0/\\:")
    | st.sampled_from("\",;'\n\r\t é\udcff"),
    min_size=1,
    max_size=12,
).filter(lambda name: name.strip() and not name.startswith("\ufeff"))


def write(path, data):
    path.write_bytes(data if isinstance(data, bytes) else data.encode("utf-8", "surrogateescape"))
    return Manifest(str(path))


def refused(manifest):
    with pytest.raises(OptionError) as error:
        list(manifest)
    return str(error.value)


class TestManifest:
    @pytest.mark.parametrize("name", ["strength", "shadows", "highlights", "softness", "fill", "tint"])
    def test_shares_are_as_on_the_command_line(self, tmp_path, name):
        manifest = write(tmp_path / "m.csv", f"target,{name}\na.png,80%\n")
        assert [row.options for row in manifest] == [((name, 0.8),)]

    def test_what_is_no_share_has_no_percentage(self, tmp_path):
        (row,) = write(tmp_path / "m.csv", "target,turn\na.png,80%\n")
        with pytest.raises(OptionError, match="turn: expected a finite number of -180 or more"):
            options_with(TransferOptions(), row.options)

    @given(
        rows=st.lists(st.tuples(NAMES, st.none() | NAMES, st.none() | st.floats(0, 4)), max_size=8),
        bom=st.booleans(),
        form=st.sampled_from(  # Python quotes a line break where it is part of its own line end
            [(csv.QUOTE_ALL, "\n"), (csv.QUOTE_ALL, "\r\n"), (csv.QUOTE_MINIMAL, "\r\n")]
        ),
        blank=st.booleans(),
    )
    @settings(max_examples=150, deadline=None)
    def test_csv_gives_what_was_written(self, tmp_path_factory, rows, bom, form, blank):
        quoting, end = form
        text = io.StringIO(newline="")
        writer = csv.writer(text, quoting=quoting, lineterminator=end)
        writer.writerow(["reference", "target", "strength"])
        for target, reference, strength in rows:
            writer.writerow([reference or "", target, "" if strength is None else repr(strength)])
            if blank:
                text.write(end + f",,{end}")
        data = (b"\xef\xbb\xbf" if bom else b"") + text.getvalue().encode("utf-8", "surrogateescape")
        folder = tmp_path_factory.mktemp("m")
        found = list(write(folder / "m.csv", data))
        assert [row.number for row in found] == list(range(1, len(rows) + 1))
        for row, (target, reference, strength) in zip(found, rows, strict=True):
            assert not row.problem
            assert row.target == f"{folder}/{target}"
            assert row.reference == (reference and f"{folder}/{reference}")
            assert dict(row.options) == ({} if strength is None else {"strength": strength})

    @example(b'{"":""}', "jsonl")  # a column that is none
    @given(st.lists(st.binary(max_size=40), max_size=5).map(b"\n".join), st.sampled_from(["csv", "jsonl"]))
    @settings(max_examples=200, deadline=None)
    def test_nonsense_is_refused_or_a_problem(self, tmp_path_factory, data, kind):
        head = b"target\n" if kind == "csv" else b""
        rows = write(tmp_path_factory.mktemp("m") / f"m.{kind}", head + data)
        with suppress(OptionError):
            for row in rows:
                assert row.problem or "\0" not in row.target

    def test_json_lines_and_parquet_say_the_same_as_csv(self, tmp_path):
        parquet = pytest.importorskip("pyarrow.parquet")
        import pyarrow as pa

        records = [
            {"target": "a.png", "reference": "b.png", "lam": 0.5, "mask": False, "neighborhood": 8},
            {"target": "/c.png", "light": "rim", "target_landmarks": "c.csv", "output": "x/c.png"},
            {"target": "s3://faces/d.png", "lam": "auto", "mask": True},
        ]
        names = list(dict.fromkeys(itertools.chain(*records)))
        cells = [[str(record.get(name, "")) for name in names] for record in records]
        by_csv = list(write(tmp_path / "m.csv", "\n".join(map(",".join, [names, *cells]))))
        by_json = list(write(tmp_path / "m.jsonl", "\n".join(map(json.dumps, records))))
        nested = [
            {key: value for key, value in record.items() if key in ("target", "reference")}
            | {"options": {"lam": record["lam"]}}
            for record in records
            if "lam" in record
        ]
        by_nested = list(write(tmp_path / "n.jsonl", "\n\n".join(map(json.dumps, nested))))
        whole = [{name: record.get(name) for name in names} for record in records]
        for record in whole:
            record["lam"] = record["lam"] and str(record["lam"])  # a column of Parquet has one type
        parquet.write_table(pa.Table.from_pylist(whole), tmp_path / "m.parquet")
        assert by_csv == by_json == list(Manifest(str(tmp_path / "m.parquet")))
        assert [dict(row.options)["lam"] for row in by_nested] == [0.5, "auto"]
        assert by_csv[0].target == f"{tmp_path}/a.png"
        assert by_csv[0].options == (("lam", 0.5), ("mask", False), ("neighborhood", 8))
        assert by_csv[1][1:5] == ("/c.png", None, "x/c.png", f"{tmp_path}/c.csv")
        assert by_csv[2].target == "s3://faces/d.png"

    def test_a_table_is_read_anew_each_time(self, tmp_path):
        manifest = write(tmp_path / "m.csv", "target\na\nb\n")
        assert list(manifest) == list(manifest)
        before = manifest.digest()
        write(tmp_path / "m.csv", "target\na\nc\n")
        assert [row.target for row in manifest] == [f"{tmp_path}/a", f"{tmp_path}/c"]
        assert manifest.digest() != before

    @pytest.mark.parametrize(
        ("name", "data", "message"),
        [
            ("m.csv", "", "is empty; name the columns"),
            ("m.csv", "\n\n", "is empty; name the columns"),
            ("m.csv", "reference\nb.png", "has no column 'target'"),
            ("m.csv", "target,refrence\na,b", "unknown column 'refrence'; did you mean 'reference'?"),
            ("m.csv", "target,qqq,zzz\na,b,c", "unknown columns 'qqq', 'zzz'; expected some of target, ref"),
            ("m.csv", "target,target\na,b", "has column 'target' more than once"),
            ("m.csv", '"target\na', "expected CSV"),
            ("m.csv", "target;refrence\na;b", "unknown column 'refrence'"),
            (
                "m.jsonl",
                '{"target": "a", "strenght": 1}',
                "row 1: unknown column 'strenght'; did you mean 'str",
            ),
            (
                "m.jsonl",
                '{"target": "a"}\n{"target": "a", "options": {"lamb": 1}}',
                "row 2: unknown column 'l",
            ),
            ("m.parquet", b"PAR1", "expected Parquet"),
            ("m.txt", "target\na", "expected a manifest that ends in one of .csv, .jsonl"),
        ],
    )
    def test_what_is_wrong_with_the_whole_is_refused(self, tmp_path, name, data, message):
        with pytest.raises(OptionError) as error:
            list(write(tmp_path / name, data))
        assert str(error.value).startswith(f"{tmp_path / name}: ")
        assert message in str(error.value)

    def test_what_is_not_there_is_refused(self, tmp_path):
        assert "cannot be read (No such file" in refused(Manifest(str(tmp_path / "m.csv")))
        (tmp_path / "d.csv").mkdir()
        assert "cannot be read (Is a directory" in refused(Manifest(str(tmp_path / "d.csv")))

    @pytest.mark.parametrize(
        ("line", "message"),
        [
            ("", None),
            ("x,,", "target: expected a photo"),
            (",a,,,", None),
            (",a,,b", "expected 3 cells, got 4"),
            (",a\0b,", "target: expected a path"),
            (',"a"b,', "expected CSV"),
            (',"a,', "expected CSV"),
        ],
    )
    def test_what_is_wrong_with_a_row_is_its_own_problem(self, tmp_path, line, message):
        rows = list(write(tmp_path / "m.csv", f"reference,target,strength\n,first,\n{line}"))
        assert rows[0].target.endswith("first")
        assert [row.problem for row in rows[1:]] == [] if not line else len(rows) == 2
        if message:
            assert message in rows[1].problem

    @pytest.mark.parametrize(
        ("line", "message"),
        [
            ("[1]", "expected a JSON object"),
            ('{"target": 3}', "target: expected a path, got 3"),
            ('{"target": "a", "options": 3}', 'and "options" in it to be one'),
            ('{"target": "a", "options": {"output": "b"}}', "output: is no option"),
            ('{"target": "a", "lam": [1]}', "lam: expected a number or a word, got [1]"),
            ("{", "expected a line of JSON"),
            ("[" * 5000, "expected a line of JSON"),
        ],
    )
    def test_what_is_wrong_with_a_line_of_json(self, tmp_path, line, message):
        first, second, third = write(tmp_path / "m.jsonl", f'{{"target": "a"}}\n{line}\n{{"target": "c"}}')
        assert not first.problem
        assert message in second.problem
        assert (third.number, third.problem) == (3, "")

    @pytest.mark.parametrize(
        ("name", "text", "value"),
        [
            ("mask", "FALSE", False),
            ("mask", "yes", True),
            ("neighborhood", "isotropic", "isotropic"),
            ("neighborhood", " 16 ", 16),
            ("exposure", "take", "take"),
            ("exposure", "-1.5", -1.5),
            ("light", "30,45", "30,45"),
            ("channels", "primary", "primary"),
            ("smoothing", "0", 0.0),
        ],
    )
    def test_text_means_what_it_means_on_the_command_line(self, tmp_path, name, text, value):
        (row,) = write(tmp_path / "m.csv", f'target,{name}\na,"{text}"\n')
        assert row.options == ((name, value),)
        assert type(row.options[0][1]) is type(value)
        base = TransferOptions(method="ltv", color_space="hsv")
        assert options_with(base, row.options) == base.changed(**{name: value})

    @pytest.mark.parametrize(
        ("name", "text"),
        [("mask", "maybe"), ("strength", "much"), ("strength", "nan"), ("neighborhood", "5")],
    )
    def test_text_that_means_nothing_is_refused_by_the_options(self, tmp_path, name, text):
        (row,) = write(tmp_path / "m.csv", f"target,{name}\na,{text}\n")
        with pytest.raises(OptionError, match=name):
            options_with(TransferOptions(), row.options)


PHOTOS = st.lists(st.text(string.ascii_letters, min_size=1), unique=True, min_size=1, max_size=9)


class TestPairs:
    @given(PHOTOS, PHOTOS)
    def test_all(self, targets, references):
        rows = list(Pairs(targets, references, "all"))
        assert [row[:3] for row in rows] == [
            (number, *pair) for number, pair in enumerate(itertools.product(targets, references), 1)
        ]

    @given(PHOTOS, PHOTOS, st.integers(0, 3), st.data())
    def test_by_chance(self, targets, references, seed, data):
        pairs = {row.target: row.reference for row in Pairs(targets, references, "random", seed)}
        assert list(pairs) == targets
        assert set(pairs.values()) <= set(references)
        if len(references) > 1:
            assert all(target != reference for target, reference in pairs.items())
        fewer = data.draw(st.lists(st.sampled_from(targets), unique=True, min_size=1))
        assert all(pairs[row.target] == row.reference for row in Pairs(fewer, references, "random", seed))

    def test_chance_is_even_and_the_seed_decides(self):
        targets, references = [f"{n}.png" for n in range(4000)], list("abcd")
        drawn = [[row.reference for row in Pairs(targets, references, "random", seed)] for seed in (0, 1)]
        for one in drawn:
            assert all(abs(one.count(letter) - 1000) < 5 * (4000 * 3 / 16) ** 0.5 for letter in references)
        alike = sum(map(str.__eq__, *drawn))
        assert abs(alike - 1000) < 5 * (4000 * 3 / 16) ** 0.5

    def test_what_does_not_pair(self):
        with pytest.raises(OptionError, match="targets: expected photos, got none"):
            Pairs([])
        with pytest.raises(OptionError, match="zip expected as many references as targets, got 1 for 2"):
            Pairs(["a", "b"], ["x"], "zip")
        with pytest.raises(OptionError, match="pairing: expected one of all, random, zip, got 'some'"):
            Pairs(["a"], ["x"], "some")
        assert [row[1:3] for row in Pairs(["a", "b"])] == [("a", None), ("b", None)]
        assert [row[:3] for row in Pairs(["a", "b"], ["x", "y"], "zip")] == [(1, "a", "x"), (2, "b", "y")]
        assert Pairs(["a", "b"]).digest() != Pairs(["a"], ["b"]).digest()
