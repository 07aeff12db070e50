"""A relit command as editors find it: a file that can be started, which runs the code under test."""

import os
import sys
from pathlib import Path

import relit

EDITORS = Path(__file__).parents[2] / "integrations" / "editors"


def relit_file(folder):
    """Write a ``relit`` that runs this checkout, and return its path."""
    path = Path(folder) / "relit"
    source = Path(relit.__file__).parents[1]
    path.write_text(
        f"#!{sys.executable}\nimport sys\nsys.path.insert(0, {str(source)!r})\n"
        "from relit.cli.app import main\nmain()\n",
        "utf-8",
    )
    path.chmod(0o755)
    assert os.access(path, os.X_OK)
    return path
