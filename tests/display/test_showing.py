"""`relit.show` in a notebook, in a terminal, and where there is neither."""

import contextlib
import os
import pty
import subprocess
import sys

import nbformat
import numpy as np
import pytest
from nbclient import NotebookClient
from PIL import Image

import relit
from relit.errors import ImageError

GREY = np.full((20, 30), 128, np.uint8)


def test_without_a_terminal_sizes_are_told(capsys, tmp_path):
    Image.fromarray(GREY).save(tmp_path / "a.png")
    relit.show([GREY, np.zeros((8, 9, 3)), tmp_path / "a.png"])
    told = capsys.readouterr().out
    assert told == "30x20 grey uint8\n9x8 float64\na.png, 30x20 grey uint8\n"
    relit.show(Image.fromarray(GREY), caption="mine")
    assert capsys.readouterr().out == "mine: 30x20 grey uint8\n"


def test_captions_are_as_many_as_images():
    with pytest.raises(ImageError, match="caption: expected as many as there are images, 2, got 1"):
        relit.show([GREY, GREY], caption=["one"])


def test_a_result_is_told_as_its_repr(capsys):
    result = relit.transfer(relit.sample("target"), light="loop")
    relit.show(result)
    assert capsys.readouterr().out == f"{result!r}\n"


@pytest.mark.slow
def test_in_a_terminal_it_is_drawn():
    code = "import numpy, relit; relit.show(numpy.full((20, 30, 3), 128, 'uint8'), caption='grey')"
    leader, follower = pty.openpty()
    told = b""
    with subprocess.Popen([sys.executable, "-c", code], stdout=follower) as running:
        os.close(follower)
        with contextlib.suppress(OSError):  # how Linux tells that nobody writes any more
            while part := os.read(leader, 4096):
                told += part
    os.close(leader)
    assert running.returncode == 0
    lines = told.decode().replace("\r\n", "\n").strip("\n").split("\n")
    assert len(lines) == 11
    assert lines[0].count("\x1b[38;2;128;128;128m\x1b[48;2;128;128;128m▀") == 30
    assert lines[-1] == "grey: 30x20 uint8"


@pytest.mark.slow
@pytest.mark.filterwarnings("default")  # those of Jupyter are not ours
def test_in_a_real_kernel_it_is_the_output(monkeypatch, tmp_path):
    monkeypatch.setenv("JUPYTER_CONFIG_DIR", str(tmp_path))
    monkeypatch.setenv("JUPYTER_RUNTIME_DIR", str(tmp_path))
    cells = [
        "import relit\nresult = relit.transfer(relit.sample('target'), light='loop')\nresult",
        "relit.show(result)",
        "relit.show([result, relit.sample('reference')])",
        "relit.show(relit.sample('target'), caption='a < b')",
    ]
    notebook = nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell(one) for one in cells])
    notebook.metadata["kernelspec"] = {"name": "python3", "display_name": "", "language": "python"}
    patience = {"timeout": 1200, "startup_timeout": 300}
    NotebookClient(notebook, resources={"metadata": {"path": str(tmp_path)}}, **patience).execute()
    outputs = [[one for one in cell.outputs if "data" in one] for cell in notebook.cells]
    assert [len(one) for one in outputs] == [1, 1, 1, 1]
    alone, shown, both, captioned = (one[0]["data"]["text/html"] for one in outputs)
    assert alone == shown
    assert alone in both
    assert both.count("<form") == 1
    assert "<figcaption>a &lt; b</figcaption>" in captioned
    assert outputs[1][0]["data"]["text/plain"].startswith("TransferResult(512x512")
