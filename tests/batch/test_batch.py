"""``relit batch``, in this process."""

# ruff: noqa: F811 (fixtures of another module)

import csv
import hashlib
import json
import signal
import sqlite3
import uuid
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest

from relit.batch import run as module
from relit.batch.places import read_bytes, write_atomically
from tests.batch.runs import ROWS, journal, results, table, tree  # noqa: F401 (tree is a fixture)
from tests.command import in_library, pixels_of, the_line


@pytest.fixture
def here(monkeypatch):
    """Let the work be done in this process."""
    from contextlib import contextmanager

    from tests.batch.test_batch_run import Engine

    @contextmanager
    def engine(_name, workers, **_address):
        lent = Engine()
        lent.workers = workers
        yield lent

    monkeypatch.setattr("relit.runtime.engines.engine", engine)


@pytest.mark.usefixtures("here", "tree")
class TestCommand:
    def test_a_manifest(self, studio, tree, succeed):
        report = json.loads(succeed("batch m.csv -o out --json"))
        assert report == {
            "output": "out",
            "results": "out/results.csv",
            "journal": "out/.relit/journal.sqlite",
            "total": ROWS,
            "kept": 0,
            "ok": ROWS,
            "failed": 0,
            "lossy": 0,
            "renamed": 0,
        }
        rows = table()
        assert [row["row"] for row in rows] == [str(n) for n in range(1, ROWS + 1)]
        assert {row["status"] for row in rows} == {"ok"}
        for number, row in enumerate(rows):
            assert row["output"] == f"{number % 3}/{number}.png"
            assert row["target"] == f"in/{row['output']}"
            assert row["sha256"] == hashlib.sha256((tree / "out" / row["output"]).read_bytes()).hexdigest()
            assert float(row["seconds"]) > 0
        expected = in_library(studio, strength=0.5).image
        np.testing.assert_array_equal(pixels_of("out/2/5.png"), expected)
        record = json.loads(Path("out/run.json").read_text())
        assert record["manifest_sha256"] == hashlib.sha256((tree / "m.csv").read_bytes()).hexdigest()
        assert (record["kind"], record["ok"], record["options"]["method"]) == ("transfer", ROWS, "shading")
        assert record["libraries"]["numpy"] == np.__version__

    def test_again_nothing_is_done(self, succeed):
        succeed("batch m.csv -o out")
        before, first = results("out"), table()
        report = json.loads(succeed("batch m.csv -o out --json"))
        assert (report["kept"], report["ok"]) == (ROWS, 0)
        assert (results("out"), table()) == (before, first)
        assert sorted(journal("out")) == list(range(1, ROWS + 1))

    @pytest.mark.parametrize(
        ("row", "reason"),
        [
            (",", "reference: expected a photo; give one, or a light by name (--light)"),
            ("rim,reference.png", "reference: expected none with a light by name; leave one of them out"),
        ],
    )
    def test_a_row_without_one_light_fails_as_it_was_foretold(self, tree, run, row, reason):
        (tree / "one.csv").write_text(f"target,light,reference\ntarget.png,{row}\n")
        foretold = run("batch one.csv -o out --dry-run").out.decode()
        assert f"row 1 would fail: {reason}\n1 rows: 0 to do, 0 done, 1 that would fail" in foretold
        assert run("batch one.csv -o out").code == 1
        assert table()[0]["reason"] == reason

    def test_reasons_in_the_table_are_plain(self, tree, run):
        (tree / "two.csv").write_text("target,reference,mask\ntarget.png,reference.png,maybe\n")
        assert run("batch two.csv -o out").code == 1
        assert table()[0]["reason"] == "mask: expected true or false, got 'maybe'"

    def test_a_method_that_takes_a_second_reference_is_foretold_too(self, run):
        foretold = run("batch m.csv --method quotient -o out --dry-run").out.decode()
        assert "row 1 would fail: method: 'quotient' takes a second reference" in foretold

    def test_only_rows_to_do_count_as_renamed(self, tree, run):
        (tree / "odd").mkdir()
        for name in ("a", "b?", "c?"):
            (tree / "odd" / f"{name}.png").write_bytes((tree / "target.png").read_bytes())
        for limit, renamed in (1, 0), (2, 1):
            done = run(f"batch --do normalize --targets odd -o out --limit {limit} --json")
            assert json.loads(done.out)["renamed"] == renamed
        assert done.err.startswith("relit: 1 result has another name than its target, whose name some system")

    def test_limit_and_then_the_rest(self, succeed):
        assert json.loads(succeed("batch m.csv -o out --limit 2 --json"))["total"] == 2
        assert len(table()) == len(results("out")) == 2
        report = json.loads(succeed("batch m.csv -o out --json"))
        assert (report["kept"], report["ok"]) == (2, ROWS - 2)

    def test_globs(self, tree, succeed, monkeypatch):
        not_needed = "relit.batch.reading.detect_landmarks"
        monkeypatch.setattr(not_needed, lambda *_a, **_k: pytest.fail("not needed"))
        done = succeed(
            "batch --targets in/**/*.png --references reference.png -o out --dry-run --limit 3"
        ).decode()
        assert done.splitlines() == [
            "transfer in/0/0.png + reference.png -> 0/0.png",
            "transfer in/0/3.png + reference.png -> 0/3.png",
            "transfer in/0/6.png + reference.png -> 0/6.png",
            "3 rows: 3 to do, 0 done, 0 that would fail",
        ]
        assert not (tree / "out").exists()

    def test_results_are_no_targets(self, succeed):
        succeed("batch --targets in/0/*.png --light rim -o in/0/done --limit 1 --format tif")
        succeed("batch --targets in/0 --light rim -o in/0/done --limit 2 --format tif")
        assert set(results("in/0/done")) == {"0.tif", "3.tif"}

    def test_layers(self, tree, succeed):
        succeed("batch --targets in/0 --light rim -o out --limit 1 --format ora")
        succeed("transfer in/0/0.png --light rim -o alone.ora")
        assert set(results("out")) == {"0.ora"}
        assert (tree / "out/0.ora").read_bytes() == (tree / "alone.ora").read_bytes()
        succeed("batch --targets in/0 --light rim -o deep --limit 1 --format layers.exr")
        assert set(results("deep")) == {"0.layers.exr"}

    def test_stores(self, tree, succeed, monkeypatch):
        """Manifest, photos and results in a store; again, what is there is asked for and not read."""
        root = f"memory://{uuid.uuid4()}"
        for path in (*tree.glob("*.*"), *tree.glob("in/*/*")):
            write_atomically(f"{root}/{path.relative_to(tree)}", path.read_bytes(), overwrite=False)
        command = f"batch {root}/m.csv -o {root}/out --journal j.sqlite --json"
        assert json.loads(succeed(command))["ok"] == ROWS
        succeed("batch m.csv -o out")
        for name, digest in results("out").items():
            assert hashlib.sha256(read_bytes(f"{root}/out/{name}")).hexdigest() == digest
        assert read_bytes(f"{root}/out/results.csv").count(b",ok,") == ROWS
        read = []
        monkeypatch.setattr(
            "relit.batch.places.read_bytes", lambda place: read.append(place) or read_bytes(place)
        )
        report = json.loads(succeed(command))
        assert (report["kept"], report["ok"]) == (ROWS, 0)
        assert not [place for place in read if place.endswith(".png")]
        write_atomically(f"{root}/in/1/4.png", (tree / "reference.png").read_bytes(), overwrite=True)
        assert json.loads(succeed(f"{command} --dry-run"))["to_do"] == 1
        report = json.loads(succeed(command))
        assert (report["kept"], report["ok"]) == (ROWS - 1, 1)

    def test_every_kind(self, tree, succeed):
        (tree / "one.jsonl").write_text('{"target": "in/0/0.png", "target_landmarks": "target.csv"}')
        for kind, files in {
            "normalize": {"0.png"},
            "decompose": {"0/u.png", "0/v.png"},
            "landmarks": {"0.json"},
        }.items():
            succeed(f"batch one.jsonl --do {kind} -o {kind}")
            assert set(results(kind)) == files
        succeed("batch one.jsonl --do landmarks --format pts -o pts")
        assert set(results("pts")) == {"0.pts"}

    def test_failures_end_with_1_and_the_rest_is_done(self, tree, run):
        (tree / "in/1/4.png").write_text("no photo")
        (tree / "in/2/5.png").unlink()
        done = run("batch m.csv -o out")
        assert done.code == 1
        assert done.err == f"relit: 2 of {ROWS} rows failed; out/results.csv says why\n"
        reasons = {row["row"]: row["reason"] for row in table() if row["status"] == "failed"}
        assert set(reasons) == {"5", "6"}
        assert "in/2/5.png: there is no such file" in reasons["6"]
        assert len(results("out")) == ROWS - 2

    def test_a_table_in_parquet(self, succeed):
        parquet = pytest.importorskip("pyarrow.parquet")
        succeed("batch m.csv -o out --results out/all.parquet --limit 3")
        succeed("batch m.csv -o out --limit 3")
        in_parquet = parquet.read_table("out/all.parquet").to_pylist()
        for one, other in zip(in_parquet, table(), strict=True):
            assert {name: "" if value is None else str(value) for name, value in one.items()} == other

    def test_rows_that_cannot_be_done_are_listed_beforehand(self, tree, succeed):
        (tree / "m.csv").write_text("target,strength,output\na.png,x,\nb.png,1,../b.png\nc.png,,\n")
        report = json.loads(succeed("batch m.csv --light rim -o out --dry-run --json"))
        assert (report["rows"], report["to_do"], report["failing"]) == (3, 1, 2)
        assert [number for number, _ in report["problems"]] == [1, 2]
        assert b"row 1 would fail: strength: expected" in succeed("batch m.csv --light rim -o out --dry-run")

    @pytest.mark.parametrize(
        ("command", "message"),
        [
            ("m.csv", "Missing option '-o'"),
            ("-o out", "Give a MANIFEST, or --targets"),
            ("m.csv --targets x -o out", "Give a MANIFEST, or --targets"),
            ("m.csv --references x -o out", "--references goes with --targets"),
            ("--targets in -o out", "Give --references, or --light"),
            ("--targets in --references in --light rim -o out", "Give --references, or --light"),
            (
                "--targets nothing/* --light rim -o out",
                "nothing/*: means no file",
            ),
            (
                "--targets in --references in/0 --pairing zip -o out",
                "as many references as targets, got 4 for 12",
            ),
            ("--targets in --references reference.png --seed 3 -o out", "--seed goes with --pairing random"),
            ("m.csv --do landmarks --strength 2 -o out", "--strength does not go with --do landmarks"),
            (
                "--targets in --references in --do normalize -o out",
                "--references does not go with --do normalize",
            ),
            (
                "m.csv --do decompose --format png -o out",
                "--format: expected none with decompose, got '.png'",
            ),
            ("m.csv --format gif -o out", "--format: expected one of .bmp, "),
            ("m.csv --do normalize --format ora -o out", "--format: expected one of .bmp, "),
            ("m.csv --do landmarks --format png -o out", "--format: expected one of .csv, .json"),
            ("m.csv -o out --results out.txt", "expected a table that ends in .csv or .parquet"),
            ("m.csv -o s3://bucket/out", "--journal: expected a local file"),
            ("no.csv -o out", "no.csv: cannot be read"),
            ("m.csv -o in/..", None),
            ("m.csv --strength 9 -o out", "--strength: expected"),
        ],
    )
    def test_usage(self, tree, fail, command, message):
        if message is None:
            (tree / "m.csv").write_text("target,light,output\nin/0/0.png,rim,in/0/0.png")
            message = "in/0/0.png: row 1 reads it and row 1 writes it"
        assert message in fail(f"batch {command}", code=[1, 2])

    @pytest.mark.parametrize("name", ["results.csv", "run.json"])
    def test_a_table_that_no_batch_wrote_stays(self, tree, run, name):
        (tree / "out").mkdir()
        (tree / "out" / name).write_text("precious")
        done = run("batch m.csv -o out")
        assert done.code == 1
        assert "exists already, and no batch wrote it" in the_line(done.err)
        assert results("out") == {}
        assert (tree / "out" / name).read_text() == "precious"
        assert run("batch m.csv -o out --force --limit 1").code == 0

    @pytest.mark.parametrize("data", [b"precious", b'{"run": {}}\n', b"SQLite format 3\0" + bytes(4080)])
    def test_a_file_that_is_no_journal_stays(self, tree, run, data):
        (tree / "mine.jsonl").write_bytes(data)
        for more in ("", " --force", " --dry-run"):
            done = run(f"batch m.csv -o out --journal mine.jsonl{more}")
            assert done.code == 1
            assert "mine.jsonl: is " in the_line(done.err)
            assert (tree / "mine.jsonl").read_bytes() == data
        assert not list(tree.glob("mine.jsonl?*"))
        assert not (tree / "out").exists()

    def test_a_table_that_a_later_run_finds_stays(self, tree, run, succeed):
        succeed("batch m.csv -o out --limit 2")
        (tree / "mine.csv").write_text("precious")
        done = run("batch m.csv -o out --limit 2 --results mine.csv")
        assert done.code == 1
        assert "mine.csv: exists already, and no batch wrote it" in the_line(done.err)
        assert (tree / "mine.csv").read_text() == "precious"
        succeed("batch m.csv -o out --limit 2 --results other.csv")
        succeed("batch m.csv -o out --limit 3 --results other.csv")
        assert len(table("other.csv")) == 3
        succeed("batch m.csv -o out --limit 3 --results mine.csv --force")
        assert len(table("mine.csv")) == 3

    def test_a_folder_may_be_moved(self, tree, succeed):
        succeed("batch m.csv -o out --limit 2")
        (tree / "out").rename(tree / "moved")
        assert json.loads(succeed("batch m.csv -o moved --limit 3 --json"))["kept"] == 2

    def test_the_journal_of_an_earlier_relit_stays(self, tree, run):
        old = tree / "out/.relit/journal.jsonl"
        old.parent.mkdir(parents=True)
        old.write_text('{"run": {"kind": "transfer"}}\n')
        for more in ("", " --dry-run"):
            done = run(f"batch m.csv -o out{more}")
            assert done.code == 2
            assert "journal.jsonl: is the journal of an earlier relit" in the_line(done.err)
        assert list(old.parent.iterdir()) == [old]
        assert run("batch m.csv -o out --limit 1 --force").code == 0
        assert old.read_text() == '{"run": {"kind": "transfer"}}\n'

    def test_a_damaged_journal_is_told_and_all_results_stay(self, tree, run, succeed):
        succeed("batch m.csv -o out --limit 3")
        before, path = results("out"), tree / "out/.relit/journal.sqlite"
        path.write_bytes(path.read_bytes()[:100] + bytes(9000))
        for more in ("", " --dry-run"):
            done = run(f"batch m.csv -o out --limit 3{more}")
            assert done.code == 1
            assert "journal.sqlite: is damaged" in the_line(done.err)
            assert results("out") == before
        path.unlink()
        succeed("batch m.csv -o out --limit 3 --force")
        assert results("out") == before

    def test_what_a_journal_was_made_to_say_of_a_row_does_not_count(self, tree, succeed):
        succeed("batch m.csv -o out --limit 3")
        before = results("out")
        with closing(sqlite3.connect(tree / "out/.relit/journal.sqlite")) as base, base:
            base.execute("UPDATE rows SET outcome = '{\"output\": 5}'")
        report = json.loads(succeed("batch m.csv -o out --limit 3 --json"))
        assert (report["kept"], report["ok"], results("out")) == (0, 3, before)

    def test_a_link_in_a_circle_is_a_row_that_fails(self, tree, run):
        (tree / "in/0/1.png").symlink_to(tree / "in/0/1.png")
        done = run("batch --targets in/0 --do landmarks -o out --limit 2")
        (row,) = [row for row in table() if row["status"] == "failed"]
        assert (done.code, row["target"]) == (1, "in/0/1.png")
        assert row["reason"].startswith("in/0/1.png: cannot be read (Too many levels of symbolic links)")

    def test_no_cell_is_a_formula(self, tree, run):
        names = ["=cmd|' calc'!A0.png", "+1.png", "-1.png", "@a.png", "'=b.png", "a=1.png"]
        for name in names:
            (tree / "in" / name).write_bytes((tree / "target.png").read_bytes())
        with (tree / "names.csv").open("w", newline="") as stream:
            writer = csv.writer(stream)
            writer.writerow(["target", "output", "target_landmarks"])
            writer.writerows([f"in/{name}", name, "target.csv"] for name in names)
        run("batch names.csv --do landmarks --format csv -o out")
        with Path("out/results.csv").open(newline="") as stream:
            cells = [cell for line in csv.reader(stream) for cell in line]
        assert not [cell for cell in cells if cell.startswith(("=", "+", "-", "@"))]
        assert [row["output"].removeprefix("'") for row in table()] == names

    def test_control_c(self, run, monkeypatch):
        work, done = module.do, []

        def press_control_c(*given):
            if len(done) == 3:
                raise KeyboardInterrupt
            done.append(given)
            return work(*given)

        monkeypatch.setattr(module, "do", press_control_c)
        stopped = run("batch m.csv -o out --jobs 1")
        assert stopped.code == 130
        assert list(filter(None, stopped.err.splitlines())) == [
            "relit: the same command goes on from here",
            "relit: interrupted",
        ]
        assert signal.getsignal(signal.SIGTERM) == signal.SIG_DFL
        monkeypatch.setattr(module, "do", work)
        assert run("batch m.csv -o out").code == 0
        assert len(results("out")) == ROWS

    def test_a_line_now_and_then(self, run, monkeypatch):
        monkeypatch.setattr("relit.cli.progress._EVERY", 0.0)
        done = run("batch m.csv -o out --jobs 1 --limit 3")
        assert done.err.splitlines()[-1].startswith("relit: 3 of 3 rows, 0 failed, ")
        assert done.err.splitlines()[-1].endswith(" rows/s, 0:00:00 left")
