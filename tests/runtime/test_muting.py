"""What libraries write to stderr by themselves is kept from it; all else is heard, whatever happens."""

import os
import subprocess
import sys
import threading

import pytest

from relit.runtime.muting import muted


def is_noise(line):
    return line.startswith(b"noise")


def speak(*lines):
    with muted(is_noise):
        os.write(2, b"".join(lines))


def fail():
    with muted(is_noise):
        os.write(2, b"second\n")
        raise KeyError


def test_noise_is_kept_back_and_all_else_heard(capfd):
    speak(b"noise 1\n", b"first\n", b"noise 2\n")
    with pytest.raises(KeyError):
        fail()
    os.write(2, b"third\n")
    assert capfd.readouterr().err == "first\nsecond\nthird\n"


def test_threads_do_not_take_it_from_one_another(capfd):
    def often():
        for _ in range(50):
            speak(b"noise\n", b"word\n")

    threads = [threading.Thread(target=often) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    os.write(2, b"end\n")
    assert capfd.readouterr().err == "word\n" * 200 + "end\n"


def test_where_nothing_can_be_put_aside_all_goes_on(capfd, monkeypatch):
    """As in a container whose every disk is read-only."""

    def refuse(*_, **__):
        raise FileNotFoundError("No usable temporary directory found")

    monkeypatch.setattr("relit.runtime.muting.TemporaryFile", refuse)
    speak(b"noise\n")
    assert capfd.readouterr().err == "noise\n"


def test_where_stderr_is_closed_all_goes_on():
    code = "import os; os.close(2)\nfrom relit.runtime.muting import muted\nwith muted(bool): print(1)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, check=True, timeout=300)
    assert done.stdout.strip() == b"1"
