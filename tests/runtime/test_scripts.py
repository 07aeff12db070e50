"""Scripts that start processes: with a guard any start method does, without one they end by a word."""

import os
import subprocess
import sys

import pytest

pytestmark = pytest.mark.slow  # every test starts processes

USES = {
    "evaluate": "from relit.evaluate.evaluation import evaluate\nlist(evaluate([1, 2], {}, jobs=2))",
    "dask": "from relit.runtime.engines import engine\nwith engine('dask', 1) as lent: print('lent')",
}
LOCAL = """
import multiprocessing, sys
from relit.runtime.engines import engine
def triple(number): return 3 * number
def work():
    with engine(sys.argv[2], 2) as lent:
        print(*(found for ended in lent.run(triple, [(14,)]) for _, found in ended))
if __name__ == "__main__":
    multiprocessing.set_start_method(sys.argv[1])
    work()
"""
COMMAND = """
import multiprocessing, sys
from relit.cli import app
if __name__ == "__main__":
    multiprocessing.set_start_method(sys.argv.pop(1))
    app.main()
"""


def done(folder, text, *arguments):
    """Run a script, which must end by itself, and count how often it began."""
    script, log = folder / "script.py", folder / "log"
    script.write_text(f"open({str(log)!r}, 'a').write('began ')\n{text}")
    command = [sys.executable, str(script), *map(str, arguments)]
    ended = subprocess.run(command, capture_output=True, text=True, check=False, timeout=900)
    return ended, len(log.read_text().split())


@pytest.mark.parametrize("use", USES)
def test_one_without_a_guard_is_told_so_and_starts_no_process_after_process(tmp_path, use):
    if use == "dask":
        pytest.importorskip("distributed")
    ended, began = done(tmp_path, USES[use])
    assert ended.returncode == 1
    assert "relit: this script starts processes" in ended.stderr
    assert 'below a line if __name__ == "__main__":' in ended.stderr
    assert "freeze_support" not in ended.stderr  # Python's own forty lines
    assert began <= 1 + 4  # itself, and the few processes that were asked for


@pytest.mark.parametrize("how", ["spawn", "fork", "forkserver"])
@pytest.mark.parametrize("name", ["local", "dask"])
def test_with_a_guard_any_start_method_does(tmp_path, how, name):
    if name == "dask":
        pytest.importorskip("distributed")
    if os.name == "nt" and how != "spawn":
        pytest.skip("Windows can only spawn")
    ended, _ = done(tmp_path, LOCAL, how, name)
    assert (ended.returncode, ended.stdout, ended.stderr) == (0, "42\n", "")


@pytest.mark.parametrize("how", ["spawn", "forkserver"])
def test_the_command_too(place, how):
    if os.name == "nt" and how != "spawn":
        pytest.skip("Windows can only spawn")
    words = ("batch", "--do", "normalize", "--targets", place / "target.png", "-o", "out", "--jobs", "2")
    ended, _ = done(place, COMMAND, how, *words)
    assert (ended.returncode, ended.stderr) == (0, "")
    assert (place / "out" / "target.png").exists()
