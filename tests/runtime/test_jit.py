"""Compiled functions: where the cache goes, and what a first call says."""

import os
import pty
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import relit

#: What compiles the least.
FIRST_CALL = "import numpy, relit; print(relit.tv_l1_isotropic(numpy.eye(9), 0.2).u.max() < 0.1)"


def run(tmp_path, code, **environment):
    """Run some code in a process that finds no cache."""
    settings = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path / "cache"), **environment}
    return subprocess.run(
        [sys.executable, "-c", code], env=settings, capture_output=True, text=True, check=True
    )


@pytest.mark.slow
@pytest.mark.rotating
def test_first_use_of_a_solver_is_announced_on_a_terminal_once(tmp_path):
    picture = tmp_path / "eye.png"
    relit.write_image(picture, np.eye(9, dtype=np.uint8))
    command = [
        sys.executable,
        "-c",
        "from relit.cli.app import main; main()",
        "decompose",
        str(picture),
        "--eye-distance",
        "100",
        "--neighborhood",
        "isotropic",
        "-o",
    ]
    settings = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path / "cache")}
    told = []
    for folder in ("first", "second"):
        ours, theirs = pty.openpty()
        subprocess.run([*command, str(tmp_path / folder)], env=settings, stderr=theirs, check=True)
        os.write(theirs, b"the end")
        text = b""
        while b"the end" not in text:
            text += os.read(ours, 10_000)
        told.append(text.count(b"compiling"))
        os.close(ours)
        os.close(theirs)
    assert told == [1, 0]
    silent = subprocess.run(
        [*command, str(tmp_path / "third")],
        env={**settings, "NUMBA_CACHE_DIR": str(tmp_path / "other")},
        capture_output=True,
        text=True,
        check=True,
    )
    assert "compiling" not in silent.stderr


def test_our_own_method_brings_neither_compiler_nor_scipy_along():
    code = (
        "import sys, relit; relit.transfer(relit.sample('target'), relit.sample('reference')); "
        "print({'numba', 'llvmlite', 'scipy'} & set(sys.modules))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "set()\n"


@pytest.mark.slow
def test_without_scipy_all_but_one_baseline_works():
    code = """
import sys
sys.modules["scipy"] = None  # what is None there is not found
import numpy, relit
from relit.errors import OptionError
from relit.settings.methods import METHODS
target, reference = relit.sample("target"), relit.sample("reference")
there, here = relit.detect_landmarks(reference), relit.detect_landmarks(target)
relit.align(reference, there, here, (512, 512))
relit.decompose(target)
relit.transfer(target, light="rembrandt", region="left")
relit.transfer(target, light=(30, 20), target_landmarks=here.xy[::9])
for method in METHODS:
    second = {"second_reference": reference} if METHODS[method].needs_second else {}
    try:
        relit.transfer(target, reference, method=method, **second)
    except OptionError as error:
        print(error)
import relit.cli.evaluate, relit.evaluate.evaluation
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    told = "method: wls needs an extra: pip install 'relit[baselines]'\n"
    assert (done.stdout, done.stderr) == (told, "")


@pytest.mark.slow
@pytest.mark.rotating
def test_nowhere_to_keep_the_compiled_functions_is_no_failure(tmp_path):
    shutil.copytree(
        Path(relit.__file__).parent, tmp_path / "relit", ignore=shutil.ignore_patterns("__pycache__")
    )
    # What is a file can be no folder, also for root.
    (tmp_path / "relit" / "__pycache__").write_text("")
    (tmp_path / "home").write_text("")
    home = str(tmp_path / "home")
    code = f"import sys; sys.path.insert(0, {str(tmp_path)!r}); {FIRST_CALL}"
    done = run(
        tmp_path, code, NUMBA_CACHE_DIR="", HOME=home, XDG_CACHE_HOME=home, PYTHONDONTWRITEBYTECODE="1"
    )
    assert done.stdout == "True\n"
