"""The networks run on a library that announces itself on stderr; nobody should see that."""

import os
import subprocess
import sys

import pytest

from relit.face.face_models import _ANNOUNCEMENT, _unannounced

LOOK = "import numpy as np; from relit import detect_faces; detect_faces(np.full((32, 32), 9, np.uint8))"


@pytest.mark.slow
@pytest.mark.parametrize("before", ["", "import os; os.close(2); "], ids=["open", "closed"])
def test_a_process_that_looks_for_faces_says_nothing(before):
    done = subprocess.run([sys.executable, "-c", before + LOOK], capture_output=True, check=True)
    assert done.stderr == b"" == done.stdout


def test_what_others_say_meanwhile_is_heard(capfd):
    os.write(2, b"before\n")
    with _unannounced():
        os.write(2, b"mine\n" + _ANNOUNCEMENT + b"\nhers")
    os.write(2, b"\nafter\n")
    assert capfd.readouterr().err == "before\nmine\nhers\nafter\n"


def fail_aloud():
    with _unannounced():
        os.write(2, b"torn model\n")
        raise ValueError("torn")


def test_it_is_heard_if_loading_fails(capfd):
    with pytest.raises(ValueError, match="torn"):
        fail_aloud()
    os.write(2, b"after\n")
    assert capfd.readouterr().err == "torn model\nafter\n"
