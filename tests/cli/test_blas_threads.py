"""Linear algebra in the command: in one thread, unless the user wants more."""

import os
import subprocess
import sys

import pytest

CODE = """
import relit.cli.app
from threadpoolctl import threadpool_info
print({library["num_threads"] for library in threadpool_info() if library["user_api"] == "blas"})
"""


@pytest.mark.skipif((os.cpu_count() or 1) < 2, reason="there are no more threads to have")
@pytest.mark.parametrize(("given", "wanted"), [({}, "{1}\n"), ({"OPENBLAS_NUM_THREADS": "2"}, "{2}\n")])
def test_the_command_takes_one_thread_by_default(given, wanted):
    others = {name: value for name, value in os.environ.items() if not name.endswith("_NUM_THREADS")}
    told = subprocess.run(
        [sys.executable, "-c", CODE], env=others | given, capture_output=True, text=True, check=True
    )
    assert told.stdout == wanted
