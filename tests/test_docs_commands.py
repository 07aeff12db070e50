"""What the pages for newcomers tell to type works, in its order, in a folder with the sample photos."""

import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from relit.cli.app import relit as command_line
from relit.photo.reading import read_image
from relit.photo.samples import copy_samples

ROOT = Path(__file__).parents[1]
#: Pages, and what their commands write.
RUN = {
    "tutorial": "relit.png stages/sheet.png before-after.png two.png softer.png python.png lit/results.csv",
    "library": "relit.png",
    "retoucher": "compare.png gentle.png face.psd face.ora sitting/results.csv",
    "psychologist": "flat/results.csv stimuli/loop-half.png stimuli/run.json normal/results.csv parts/u.png",
    "data-scientist": "lit/results.csv normal/results.csv faces/results.csv",
    "ltv": "ltv.png parts/v.png",
}
#: Commands that serve until they are stopped, or that install: told, and not run.
_STAYS = re.compile(r"^(RELIT_TOKEN=\S+ )?relit (serve|studio)\b|^(pip|python3 -m venv)\b")
_BLOCK = re.compile(r"(<!-- (?:not run|file): ?(.+?) -->\n)?^```(\w+)\n(.*?)^```", re.DOTALL | re.MULTILINE)


def blocks(page):
    """Return language, code and note of every block of code of a page."""
    text = (ROOT / "docs" / f"{page}.md").read_text("utf-8")
    return [(found[3], found[4], found[1] or "") for found in _BLOCK.finditer(text)]


@pytest.fixture
def here(tmp_path):
    """A folder with the samples, and with a command `relit` of this checkout."""
    copy_samples(tmp_path / "photos")
    command = tmp_path / "bin" / "relit"
    command.parent.mkdir()
    command.write_text(
        f"#!/bin/sh\nexec {shlex.quote(sys.executable)} -c 'from relit.cli.app import main; main()' \"$@\"\n"
    )
    command.chmod(0o755)
    return tmp_path


@pytest.mark.slow
@pytest.mark.rotating
@pytest.mark.parametrize("page", RUN)
def test_the_commands_of_a_page_do_what_it_says(page, here):
    if page == "tutorial":  # which tells how to make them
        for photo in (here / "photos").iterdir():
            photo.unlink()
    environment = os.environ | {"PATH": f"{here / 'bin'}{os.pathsep}{os.environ['PATH']}"}
    programs = ""
    for language, code, note in blocks(page):
        if note.startswith("<!-- file:"):
            (here / note.split()[2]).write_text(code)
        elif language == "sh" and not note:
            script = "\n".join(line for line in code.splitlines() if not _STAYS.match(line))
            run(["sh", "-ec", script], here, environment)
        elif language == "python":
            programs += code  # later blocks go on with names of earlier ones
    run([sys.executable, "-c", programs], here, environment)
    for name in RUN[page].split():
        assert (here / name).stat().st_size > 0, name


def run(command, folder, environment):
    done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True)
    assert done.returncode == 0, f"{command[-1]}\n{done.stderr}"


@pytest.mark.slow
def test_the_programs_of_the_readme_run(here, monkeypatch):
    monkeypatch.chdir(here)
    text = (ROOT / "README.md").read_text("utf-8")
    for code in re.findall(r"^```python\n(.*?)^```", text, re.DOTALL | re.MULTILINE):
        exec(code, {})
    assert (read_image("relit.png").pixels != read_image("photos/target.png").pixels).any()


def told():
    """Return every command of README and docs that begins a line, and where it stands."""
    for path in (ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))):
        code = "".join(found[4] for found in _BLOCK.finditer(path.read_text("utf-8")) if found[3] == "sh")
        for line in code.replace("\\\n", " ").splitlines():
            for part in line.split("&&"):
                if part.strip().startswith("relit "):
                    yield path.name, part.strip()


def test_every_option_that_is_told_is_there():
    lines = list(told())
    assert len(lines) > 50
    for page, line in lines:
        _, name, *words = shlex.split(line, comments=True)
        known = {
            flag
            for option in command_line.commands[name].params
            for flag in option.opts + option.secondary_opts
        }
        flags = {word.partition("=")[0] for word in words if re.match("-[-a-z]", word) and len(word) > 1}
        assert flags <= known | {"--help", "-h"}, (page, line)


def test_the_setup_commands_of_readme_and_tutorial_agree():
    readme, tutorial = (
        " ".join((ROOT / name).read_text("utf-8").split()) for name in ("README.md", "docs/tutorial.md")
    )
    for command in (
        "python3 -m venv .venv && . .venv/bin/activate && pip install .",
        "relit samples photos",
        "relit transfer photos/target.png photos/reference.jpg -o relit.png --stages stages",
    ):
        assert command in readme
        assert command in tutorial


@pytest.mark.slow
@pytest.mark.rotating
def test_pictures_of_the_gallery_are_what_its_script_makes():
    from PIL import Image

    from examples import sliders

    for name, picture in sliders.pictures(None):
        with Image.open(ROOT / "docs" / "gallery" / f"{name}.webp") as kept:
            off = np.abs(
                np.asarray(kept.convert("RGB"), float) - np.asarray(Image.fromarray(picture).convert("RGB"))
            )
        assert off.mean() < 3, name  # of 255: WebP's own loss is 1 to 2


def test_the_gallery_shows_every_picture():
    text = "".join((ROOT / "docs" / name).read_text("utf-8") for name in ("gallery.md", "index.md"))
    kept = {path.name for path in (ROOT / "docs" / "gallery").iterdir()}
    assert kept == set(re.findall(r"\(gallery/(\S+?)\)", text))
