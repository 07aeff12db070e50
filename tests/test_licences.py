"""The check of licences can fail: on what packages say of themselves, and on what their wheels hold."""

import subprocess
import sys
import sysconfig
import tomllib
import venv
from pathlib import Path

import pytest

from check import FOR_DEVELOPERS, extras_for_users
from tools.licences import complaints

ROOT = Path(__file__).parents[1]


@pytest.mark.parametrize(
    ("field", "terms", "allowed"),
    [
        ("Expression", "MIT", True),
        ("Expression", "BSD-3-Clause AND 0BSD AND MIT AND Zlib AND CC0-1.0", True),
        ("Expression", "BSD-2-Clause AND Apache-2.0 WITH LLVM-exception", True),
        ("Expression", "GPL-3.0-or-later OR Apache-2.0", True),
        ("Expression", "MIT AND (GPL-2.0-only OR LGPL-3.0-only)", False),
        ("Expression", "AGPL-3.0-only", False),
        ("Classifier", "Mozilla Public License 2.0 (MPL 2.0)", True),
        ("Classifier", "MIT License; GNU General Public License v2 (GPLv2)", False),
        ("Metadata", "GPL", False),
        ("Metadata", "", False),
        ("Metadata", "UNKNOWN", False),
    ],
)
def test_licences_that_are_allowed_and_others(field, terms, allowed):
    found = complaints([{"Name": "some", f"License-{field}": terms}], [])
    assert [line.split(":")[0] for line in found] == ([] if allowed else ["some"])


def test_libraries_under_the_gpl_are_told_by_their_names():
    names = ["a.libs/libx264-1a2b.so.164", "b/.dylibs/libreadline.8.dylib", "c.libs/libx265-0f.dll"]
    fine = ["d.libs/libgslice-12.so", "e/x265.py", "f/libjpeg.so.62", "pillow_heif.libs/libx265-48.so.217"]
    found = complaints([], map(Path, names + fine))
    assert [line.split(": ")[0] for line in found] == names
    assert "GPL" in (ROOT / "README.md").read_text("utf-8")  # which tells of the one that is let through


@pytest.mark.slow
def test_an_environment_with_the_gpl_in_it_fails(tmp_path):
    venv.create(tmp_path, with_pip=False)
    paths = sysconfig.get_paths("venv", {"base": str(tmp_path), "platbase": str(tmp_path)})
    about = Path(paths["purelib"], "some-1.dist-info", "METADATA")
    about.parent.mkdir()
    python = Path(paths["scripts"], "python")

    def check(terms):
        about.write_text(f"Metadata-Version: 2.4\nName: some\nVersion: 1\nLicense-Expression: {terms}\n")
        command = [sys.executable, "-m", "tools.licences", str(python)]
        return subprocess.run(command, cwd=ROOT, capture_output=True, text=True)

    assert check("MIT").returncode == 0
    done = check("GPL-3.0-only")
    assert done.returncode == 1
    assert done.stdout == "some: 'GPL-3.0-only' is not among the licences allowed\n"


def test_every_extra_for_users_is_checked():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    assert {*extras_for_users(), *FOR_DEVELOPERS} == {*project["optional-dependencies"]}
    assert not {*extras_for_users()} & FOR_DEVELOPERS
