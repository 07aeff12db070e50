"""The journal: what was added is found again, whatever tears its end off."""

import subprocess
import sys
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from relit.batch.jobs import File, Outcome
from relit.batch.journal import Journal
from relit.errors import OutputError

TEXTS = st.text(max_size=20)
OUTCOMES = st.builds(
    Outcome,
    st.integers(1, 9),
    st.sampled_from(["", "a", "b/c.png", "é\udcff\n"]),
    st.sampled_from(["ok", "failed"]),
    TEXTS,
    TEXTS,
    st.lists(st.builds(File, TEXTS, st.none() | st.tuples(st.integers(), st.integers()))).map(tuple),
    metrics=st.dictionaries(TEXTS, st.floats(allow_nan=False)),
)


def found_in(path, keys):
    with Journal(path).reading() as journal:
        return {key: journal.find(key) for key in keys}


class TestJournal:
    @given(st.lists(st.lists(OUTCOMES, max_size=4), max_size=4))
    @settings(deadline=None)
    def test_the_last_word_counts(self, tmp_path_factory, runs):
        path = tmp_path_factory.mktemp("j") / "deep" / "journal.jsonl"
        last = {}
        for number, outcomes in enumerate(runs):
            with Journal(path).writing() as journal:
                assert journal.header == ({"run": number - 1} if number else None)
                journal.begin({"run": number})
                journal.add(outcomes)
                last |= {outcome.key: outcome for outcome in outcomes}
                journal.refresh()
                assert {key: journal.find(key) for key in last} == last
                assert journal.find("elsewhere") is None
        assert found_in(path, last) == last

    def test_torn_at_any_byte_it_holds_the_lines_before(self, tmp_path):
        path = tmp_path / "journal.jsonl"
        outcomes = [Outcome(n, f"{n}.png", "ok", made="x" * n) for n in range(1, 5)]
        with Journal(path).writing() as journal:
            journal.add(outcomes)
        whole = path.read_bytes()
        more = Outcome(9, "9.png", "ok")
        for size in range(len(whole) + 1):
            path.write_bytes(whole[:size])
            with Journal(path).writing() as journal:
                journal.add([more])
            lines = whole[:size].count(b"\n")
            expected = {outcome.key: outcome for outcome in [*outcomes[:lines], more]}
            assert found_in(path, [*(outcome.key for outcome in outcomes), "9.png"]) == {
                **dict.fromkeys(outcome.key for outcome in outcomes),
                **expected,
            }
            assert path.read_bytes().count(b"\n") == lines + 1

    @pytest.mark.parametrize(
        "line", [b"", b"\0" * 200, b"{}", b"[]", b'{"run": 1, ', b"3", b'{"number": 1}', b"\xff"]
    )
    def test_what_is_no_line_is_passed_over(self, tmp_path, line):
        path = tmp_path / "journal.jsonl"
        one, other = Outcome(1, "a", "ok"), Outcome(2, "b", "failed")
        for outcome in (one, other):
            with Journal(path).writing() as journal:
                journal.add([outcome])
            with path.open("ab") as stream:
                stream.write(line + b"\n")
        assert found_in(path, ["a", "b"]) == {"a": one, "b": other}

    def test_one_at_a_time_and_free_after_a_crash(self, tmp_path):
        path = tmp_path / "journal.jsonl"
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
            child.kill()
            child.wait(10)
            with Journal(path).writing() as journal:
                journal.add([Outcome(1, "a", "ok")])

    def test_a_place_that_cannot_be_written(self, tmp_path):
        (tmp_path / "file").write_text("")
        for path in (tmp_path / "file" / "journal.jsonl", tmp_path / "there"):
            (tmp_path / "there").mkdir(exist_ok=True)
            with pytest.raises(OutputError, match="cannot be written"), Journal(path).writing():
                pytest.fail("it was opened")

    def test_looking_writes_nothing(self, tmp_path):
        with Journal(tmp_path / "no" / "journal.jsonl").reading() as journal:
            assert journal.find("a") is None
            assert journal.header is None
        assert not any(Path(tmp_path).iterdir())
