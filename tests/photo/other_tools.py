"""exiftool and ImageMagick: what others write, and what they find in ours."""

from __future__ import annotations

import json
import shutil
import subprocess

import pytest


def exiftool(path, *words):
    """What exiftool finds, by group and name."""
    if not shutil.which("exiftool"):
        pytest.skip("needs exiftool, of Debian's libimage-exiftool-perl")
    found = subprocess.run(
        ["exiftool", "-json", "-G1", "-a", "-charset", "iptc=UTF8", *words, str(path)],
        capture_output=True,
        check=True,
    )
    return json.loads(found.stdout)[0]


def changed(path, *words):
    """The file with more metadata in it, by exiftool."""
    exiftool(path)
    subprocess.run(["exiftool", "-q", "-m", "-overwrite_original", *words, str(path)], check=True)
    return path


def convert(*words):
    """Run ImageMagick."""
    program = shutil.which("magick") or "/usr/bin/convert"
    if not shutil.which(program):
        pytest.skip("needs ImageMagick")
    subprocess.run([program, *map(str, words)], check=True, capture_output=True)
