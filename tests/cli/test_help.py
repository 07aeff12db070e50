"""Help in groups: examples first, what is wanted every day in whole, the expert's by a title."""

import shlex
from dataclasses import fields

import pytest

from relit.cli import app as cli
from relit.cli.groups import GroupedCommand
from relit.settings.option_fields import GROUPS
from relit.settings.options import TransferOptions

GROUPED = [name for name, command in cli.relit.commands.items() if isinstance(command, GroupedCommand)]
HEADINGS = ["Examples", "Light", "Colour", "Where", "Files", "Expert"]


def lines_of(succeed, command, monkeypatch, width=80):
    monkeypatch.setenv("COLUMNS", str(width))
    return succeed(command).decode().splitlines()


@pytest.mark.parametrize("command", GROUPED)
@pytest.mark.parametrize("flag", ["--help", "--help-all"])
def test_groups_come_in_their_order(succeed, monkeypatch, command, flag):
    lines = lines_of(succeed, f"{command} {flag}", monkeypatch)
    heads = [line.partition(" (")[0].rstrip(":") for line in lines if line[:1].strip() and line.endswith(":")]
    assert heads == HEADINGS
    assert [head for head in ("light", "color", "where", "expert") if head in GROUPS] == list(GROUPS)


@pytest.mark.parametrize("option", fields(TransferOptions), ids=lambda option: option.name)
def test_an_option_stands_in_its_group(succeed, monkeypatch, option):
    lines = lines_of(succeed, "transfer --help", monkeypatch)
    heads = {"light": "Light", "color": "Colour", "where": "Where", "expert": "Expert"}
    start = next(i for i, line in enumerate(lines) if line.startswith(heads[option.metadata["group"]]))
    group = "\n".join(lines[start : lines.index("", start) if "" in lines[start:] else None])
    assert f"  {option.metadata['flag']} " in group
    if option.metadata["group"] == "expert":
        assert option.metadata["title"] in " ".join(group.split())


def test_it_is_short_and_wide_as_the_terminal(succeed, monkeypatch):
    """120 lines was what it took before; each width is used."""
    for width, most in ((80, 115), (120, 95)):
        lines = lines_of(succeed, "transfer --help", monkeypatch, width)
        assert len(lines) <= most
        assert max(map(len, lines)) <= width
    assert max(map(len, lines)) > 100


@pytest.mark.parametrize("command", GROUPED)
def test_examples_are_commands(succeed, monkeypatch, command):
    lines = lines_of(succeed, f"{command} --help", monkeypatch)
    start = lines.index("Examples:") + 1
    examples = lines[start : lines.index("", start)]
    assert len(examples) in (3, 4)
    for example in examples:
        _, name, *words = shlex.split(example)
        assert name == command
        context = cli.relit.commands[name].make_context(name, words)
        assert context.params["output"]
