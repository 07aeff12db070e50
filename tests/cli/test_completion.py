"""The shell completes commands, options, words and files: what click tells it, and what bash makes of it."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import click
import pytest
from click.shell_completion import ShellComplete

from relit.cli.app import relit
from relit.settings.methods import METHODS
from relit.settings.options import PARTS
from relit.settings.studio_lights import STUDIO_LIGHTS

RELIT = f"#!/bin/sh\nexec {sys.executable} -c 'from relit.cli.app import main; main()' \"$@\"\n"


def completed(*words):
    """Return what click offers for the last word."""
    *before, last = words
    return ShellComplete(relit, {}, "relit", "_RELIT_COMPLETE").get_completions(before, last)


def offered(*words):
    return [item.value for item in completed(*words)]


def test_commands_and_flags():
    assert offered("tr") == ["transfer"]
    assert set(offered("")) == set(relit.commands)
    assert offered("transfer", "--str") == ["--strength"]


@pytest.mark.parametrize(
    ("flag", "start", "words"),
    [
        ("--method", "", list(METHODS)),
        ("--kernel", "g", ["gaussian"]),
        ("--light", "r", [name for name in STUDIO_LIGHTS if name.startswith("r")]),
        ("--tint", "", ["keep", "take", "neutral"]),
        ("--exposure", "t", ["take"]),
        ("--lambda", "", ["auto"]),
        ("--region", "left+", [f"left+{part}" for part in ("face", *PARTS)]),
        ("--region", "left+no", ["left+nose"]),
    ],
)
def test_words(flag, start, words):
    assert offered("transfer", flag, start) == words


def test_every_argument_and_option_completes_something():
    """Numbers, words of one's own and addresses apart, there is always something to offer."""
    free = {"--port", "--host", "--allow-host", "--seed", "--address", "--limit", "--jobs", "--cache-size"}
    free |= {"--set", "--case", "--format", "--channels", "--token", "--trusted-proxy"}
    numbers = ("number", "amount", "time", "integer range", "float range", "seconds")
    for name, command in relit.commands.items():
        for parameter in command.params:
            if isinstance(parameter, click.Option) and (parameter.is_flag or free & {*parameter.opts}):
                continue
            kind = parameter.type
            items = parameter.shell_complete(click.Context(command), "")
            assert items or getattr(kind, "name", "") in numbers, (name, parameter.name)


@pytest.mark.parametrize(
    ("words", "kind"),
    [
        (("transfer", "a"), "file"),
        (("transfer", "a.jpg", "b"), "file"),
        (("transfer", "a.jpg", "-o", "b"), "file"),
        (("transfer", "a.jpg", "--target-landmarks", ""), "file"),
        (("transfer", "a.jpg", "--stages", ""), "dir"),
        (("decompose", "a.jpg", "-o", ""), "dir"),
        (("batch", "pa"), "file"),
        (("evaluate", ""), "file"),
        (("studio", "t"), "file"),
        (("samples", ""), "dir"),
    ],
)
def test_files(words, kind):
    assert [item.type for item in completed(*words)] == [kind]


@pytest.mark.slow
@pytest.mark.skipif(os.name == "nt", reason="needs POSIX shells")
class TestShells:
    """What a shell is given, and gives back."""

    @pytest.fixture
    def command(self, tmp_path, monkeypatch):
        """A folder with the command on the path, and two files."""
        folder = tmp_path / "bin"
        folder.mkdir()
        (folder / "relit").write_text(RELIT)
        (folder / "relit").chmod(0o755)
        monkeypatch.setenv("PATH", f"{folder}{os.pathsep}{os.environ['PATH']}")
        monkeypatch.chdir(tmp_path)
        return folder / "relit"

    def call(self, words, **variables):
        done = subprocess.run(
            words, env={**os.environ, **variables}, stdout=subprocess.PIPE, timeout=600, check=False
        )
        assert done.returncode == 0
        return done.stdout.decode()

    @pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
    def test_a_script_for_each(self, command, shell):
        if shell == "bash" and not shutil.which("bash"):
            pytest.skip("click asks bash for its version")
        script = self.call([command], _RELIT_COMPLETE=f"{shell}_source")
        assert f"_RELIT_COMPLETE={shell}_complete" in script
        if shutil.which(shell):
            self.call([shell, "-n", "-c", script])

    @pytest.mark.parametrize(
        ("shell", "asked"),
        [
            ("bash", {"COMP_WORDS": "relit transfer --li", "COMP_CWORD": "2"}),
            ("zsh", {"COMP_WORDS": "relit transfer --li", "COMP_CWORD": "2"}),
            ("fish", {"COMP_WORDS": "relit transfer --li", "COMP_CWORD": "--li"}),
        ],
    )
    def test_an_answer_for_each(self, command, shell, asked):
        assert "--light" in re.split(
            r"[\s,]", self.call([command], _RELIT_COMPLETE=f"{shell}_complete", **asked)
        )

    @pytest.mark.skipif(not shutil.which("bash"), reason="needs bash")
    @pytest.mark.parametrize(
        ("line", "words"),
        [
            ("relit transfer --light lo", ["loop"]),
            ("relit transfer --tint ", ["keep", "take", "neutral"]),
            ("relit norm", ["normalize"]),
        ],
    )
    def test_bash_itself(self, command, line, words):
        """The function that the script defines, called as bash calls it when Tab is pressed."""
        assert Path(command).is_file()
        *before, last = line.split(" ")
        array = " ".join(f"'{word}'" for word in (*before, last))
        script = (
            'compopt() { :; }; eval "$(_RELIT_COMPLETE=bash_source relit)"; '
            f"COMP_WORDS=({array}); COMP_CWORD={len(before)}; _relit_completion relit; "
            'printf "%s\\n" "${COMPREPLY[@]}"'
        )
        assert self.call(["bash", "-c", script]).split() == words
