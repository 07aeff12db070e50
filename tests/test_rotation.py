"""Which of the rotating tests a run takes, as pytest collects them with our own conftest."""

import json
import subprocess
import sys
from collections import Counter
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]

TESTS = """
import pytest

@pytest.mark.rotating
@pytest.mark.parametrize("number", range(40))
def test_long(number): pass

@pytest.mark.rotating("key")
def test_one(): pass

@pytest.mark.rotating("key")
def test_other(): pass

def test_short(): pass
"""

COLLECT = """
import json, sys
import pytest

class Names:
    def pytest_collection_finish(self, session):
        self.found = [item.name for item in session.items]

runs = []
for given in json.loads(sys.argv[1]):
    names = Names()
    assert pytest.main([*given, *sys.argv[2:]], plugins=[names]) == 0
    runs.append(names.found)
with open("names.json", "w") as file:
    json.dump(runs, file)
"""


@pytest.mark.slow
def test_four_parts_are_all_and_share_none_and_what_is_named_runs_whole(tmp_path):
    (tmp_path / "test_some.py").write_text(TESTS)
    runs = [[".", "--part", str(part)] for part in range(4)]
    runs += [[".", "--all"], ["test_some.py"]]
    runs += [["test_some.py::test_long[3]", "--part", str(part)] for part in (4, 5)]
    more = ["--collect-only", "-q", "-p", "tests.conftest", "-p", "no:cacheprovider"]
    more += ["-c", ROOT / "pyproject.toml", "--rootdir", tmp_path]
    command = [sys.executable, "-c", f"import sys; sys.path.insert(0, {str(ROOT)!r})\n{COLLECT}"]
    subprocess.run([*command, json.dumps(runs), *more], cwd=tmp_path, check=True, timeout=900)
    *parts, whole, file, one, other = json.loads((tmp_path / "names.json").read_text())
    assert sorted(whole) == sorted(file)
    assert len(whole) == 43
    assert one == other == ["test_long[3]"]
    counts = Counter(name for part in parts for name in part)
    assert counts.pop("test_short") == 4
    assert counts == {name: 1 for name in whole if name != "test_short"}
    for part in parts:
        assert len(part) > 2
        assert ("test_one" in part) == ("test_other" in part)
