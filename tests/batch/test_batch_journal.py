"""The journal: what was added is found again, whatever becomes of the process or of the file."""

import json
import sqlite3
import subprocess
import sys
from contextlib import closing, suppress
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from relit.batch.jobs import File, Outcome
from relit.batch.journal import Journal
from relit.errors import OutputError

TEXTS = st.text(max_size=20)
FILES = st.lists(st.builds(File, TEXTS, st.none() | TEXTS), max_size=3).map(tuple)
OUTCOMES = st.builds(
    Outcome,
    st.sampled_from(["", "a", "b/c.png", "é\udcff\n"]),
    TEXTS,
    TEXTS,
    FILES,
    FILES,
    st.dictionaries(TEXTS, st.floats(allow_nan=False)),
)


def found_in(path, outputs):
    with Journal(path).reading() as journal:
        return {output: journal.find(output) for output in outputs}


def by_hand(path, *commands):
    with closing(sqlite3.connect(path)) as base, base:
        for command in commands:
            base.execute(*command)


@pytest.fixture
def kept(tmp_path):
    """A journal with an outcome, made by a run that has ended."""
    path = tmp_path / "journal.sqlite"
    with Journal(path).writing() as journal:
        journal.begin({"kind": "transfer"})
        journal.take("results.csv")
        journal.add([Outcome("a", recipe="x"), Outcome("b", "no face")])
    return path


class TestJournal:
    @given(st.lists(st.lists(OUTCOMES, max_size=4), max_size=4))
    @settings(deadline=None, max_examples=30)
    def test_the_last_word_counts(self, tmp_path_factory, runs):
        path = tmp_path_factory.mktemp("j") / "deep" / "journal.sqlite"
        last = {}
        for number, outcomes in enumerate(runs):
            with Journal(path).writing() as journal:
                assert journal.settings == ({"run": number - 1} if number else None)
                journal.begin({"run": number})
                journal.add(outcomes)
                last |= {outcome.output: outcome for outcome in outcomes}
                assert {output: journal.find(output) for output in last} == last
                assert journal.find("elsewhere") is None
        assert found_in(path, last) == last

    def test_places_are_taken_for_good(self, kept):
        with Journal(kept).writing() as journal:
            assert journal.owns("results.csv")
            assert not journal.owns("run.json")
            journal.take("results.csv")

    def test_what_was_added_outlives_the_process(self, tmp_path):
        path = tmp_path / "journal.sqlite"
        code = (
            "import os, sys, pathlib\n"
            "from relit.batch.jobs import Outcome\n"
            "from relit.batch.journal import Journal\n"
            "with Journal(pathlib.Path(sys.argv[1])).writing() as journal:\n"
            "    journal.begin({})\n"
            "    for number in range(3): journal.add([Outcome(f'{number}')])\n"
            "    os.kill(os.getpid(), 9)\n"
        )
        done = subprocess.run([sys.executable, "-c", code, str(path)], check=False, timeout=300)
        assert done.returncode == -9
        assert found_in(path, "0123") == {**{number: Outcome(number) for number in "012"}, "3": None}

    @pytest.mark.parametrize("at", range(8))
    def test_killed_while_it_is_made_it_is_made_anew(self, tmp_path, at):
        """At each of the commands that make it."""
        path = tmp_path / "journal.sqlite"
        code = (
            "import os, sys, pathlib\n"
            "from relit.batch.journal import Journal\n"
            "ask, left = Journal._ask, [int(sys.argv[2])]\n"
            "def counted(self, *given):\n"
            "    if not left[0]: os.kill(os.getpid(), 9)\n"
            "    left[0] -= 1\n"
            "    return ask(self, *given)\n"
            "Journal._ask = counted\n"
            "with Journal(pathlib.Path(sys.argv[1])).writing() as journal: counted(journal, 'SELECT 1')\n"
        )
        subprocess.run([sys.executable, "-c", code, str(path), str(at)], check=False, timeout=300)
        with Journal(path).writing() as journal:
            assert journal.settings is None
            journal.add([Outcome("a")])
        assert found_in(path, "a") == {"a": Outcome("a")}

    def test_one_at_a_time_and_free_after_a_crash(self, tmp_path):
        path = tmp_path / "journal.sqlite"
        code = (
            "import os, sys, pathlib; from relit.batch.journal import Journal\n"
            "with Journal(pathlib.Path(sys.argv[1])).writing(): print(flush=True); sys.stdin.read()"
        )
        streams = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE}
        with subprocess.Popen([sys.executable, "-c", code, str(path)], **streams) as child:
            child.stdout.readline()
            with (
                pytest.raises(OutputError, match="another run is at work here"),
                Journal(path).writing(),
            ):
                pytest.fail("two runs in one folder")
            assert found_in(path, "a") == {"a": None}  # to look is allowed
            child.kill()
            child.wait(120)
            with Journal(path).writing() as journal:
                journal.add([Outcome("a")])

    def test_a_place_that_cannot_be_written(self, tmp_path):
        (tmp_path / "file").write_text("")
        for path in (tmp_path / "file" / "journal.sqlite", tmp_path / "there"):
            (tmp_path / "there").mkdir(exist_ok=True)
            with pytest.raises(OutputError, match="cannot be written"), Journal(path).writing():
                pytest.fail("it was opened")

    def test_looking_writes_nothing(self, tmp_path):
        with Journal(tmp_path / "no" / "journal.sqlite").reading() as journal:
            assert journal.find("a") is None
            assert journal.settings is None
        assert not any(Path(tmp_path).iterdir())


class TestOtherFiles:
    """What is no journal stays as it is, byte for byte."""

    @pytest.mark.parametrize(
        ("data", "told"),
        [
            (b"precious", "is no journal"),
            (b"a\nb\n", "is no journal"),
            (b"\0" * 5000, "is no journal"),
            (b"SQLite format 3\0", "is no journal"),
            (b'{"run": {"kind": "transfer"}}\n{"output": "a"}\n', "is the journal of an earlier relit"),
            (b'{"run": 5}\n', "is the journal of an earlier relit"),
            (b"[" * 100_000, "is no journal"),
        ],
    )
    @pytest.mark.parametrize("opened", ["writing", "reading"])
    def test_of_any_kind(self, tmp_path, data, told, opened):
        path = tmp_path / "pairs.jsonl"
        path.write_bytes(data)
        with pytest.raises(OutputError) as caught, getattr(Journal(path), opened)():
            pytest.fail("it was opened")
        assert str(caught.value).startswith(f"{path}: {told}, and stays as it is; choose another file")
        assert path.read_bytes() == data

    def test_that_are_databases(self, tmp_path):
        path = tmp_path / "mine.sqlite"
        by_hand(path, ["CREATE TABLE rows (output, outcome)"], ["INSERT INTO rows VALUES ('a', 'b')"])
        before = path.read_bytes()
        for opened in (Journal(path).writing, Journal(path).reading):
            with pytest.raises(OutputError, match="is no journal, and stays as it is"), opened():
                pytest.fail("it was opened")
        assert path.read_bytes() == before

    def test_an_empty_one_may_be_filled(self, tmp_path):
        path = tmp_path / "empty"
        path.touch()
        assert found_in(path, "a") == {"a": None}
        with Journal(path).writing() as journal:
            journal.add([Outcome("a")])
        assert found_in(path, "a") == {"a": Outcome("a")}


class TestDamage:
    """One clear line, or the row counts as one that was never recorded."""

    @pytest.mark.parametrize(
        "text",
        [
            *("", "{}", "[]", "3", "5", "null", '{"reason": 5}', "[" * 100_000, None, b"\xff"),
            *(
                json.dumps({"reason": "", "recipe": "", "inputs": [], "files": [], "measured": {}} | change)
                for change in (
                    {"inputs": 5},
                    {"files": [["x"]]},
                    {"files": [["x", 3]]},
                    {"files": [["x", [3]]]},
                    {"files": [5]},
                    {"reason": None, "recipe": 5},
                    {"measured": 5},
                    {"measured": {"seconds": "long"}},
                    {"measured": {"seconds": [[]]}},
                )
            ),
        ],
    )
    def test_of_an_outcome(self, kept, text):
        by_hand(kept, ["UPDATE rows SET outcome = ? WHERE output = ?", (text, b"a")])
        assert found_in(kept, "ab") == {"a": None, "b": Outcome("b", "no face")}
        with Journal(kept).writing() as journal:
            journal.add([Outcome("a")])
        assert found_in(kept, "a") == {"a": Outcome("a")}

    def test_of_letters(self, kept):
        by_hand(kept, ["UPDATE rows SET outcome = CAST(x'7bff' AS TEXT)"])
        assert found_in(kept, "ab") == {"a": None, "b": None}

    @pytest.mark.parametrize("text", ["", "5", "[]", "{", "[" * 100_000, None, b"\xff"])
    def test_of_the_settings(self, kept, text):
        by_hand(kept, ["UPDATE runs SET settings = ?", (text,)])
        with (
            Journal(kept).writing() as journal,
            pytest.raises(OutputError, match=r"is damaged .*; move it"),
        ):
            _ = journal.settings

    def test_of_a_table(self, kept):
        by_hand(kept, ["DROP TABLE rows"], ["CREATE TABLE rows (something)"])
        with (
            pytest.raises(OutputError, match=r"journal\.sqlite: is damaged \("),
            Journal(kept).writing() as journal,
        ):
            journal.add([Outcome("a")])

    @given(st.data())
    @settings(deadline=None, max_examples=60)
    def test_of_any_bytes(self, tmp_path_factory, data):
        path = tmp_path_factory.mktemp("j") / "journal.sqlite"
        known = [Outcome(f"{number}", "x" * 900) for number in range(20)]
        with Journal(path).writing() as journal:
            journal.begin({"kind": "transfer"})
            journal.add(known)
        whole = path.read_bytes()
        size = data.draw(st.integers(0, len(whole)) | st.just(len(whole)))
        at = data.draw(st.integers(0, len(whole)))
        path.write_bytes((whole[:at] + data.draw(st.binary(max_size=300)) + whole[at:])[:size])
        with suppress(OutputError), Journal(path).writing() as journal:
            assert journal.settings in (None, {"kind": "transfer"})
            for outcome in known:
                assert journal.find(outcome.output) in (None, outcome)
            journal.add([Outcome("a")])
            assert journal.find("a") == Outcome("a")
