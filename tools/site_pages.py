"""Pages of the docs site that are made of the code: every command, and the API by module."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import fields

import click
from click.testing import CliRunner

import relit
from relit.cli.app import relit as command_line

#: Characters of a line of help: as many as fit beside the table of contents.
_WIDTH = 88
#: Pages of the API: a room of `src/relit`, or what is above all rooms; its title and what it is for.
_ROOMS = {
    "transfer": ("Transfer", "The light of one face on another, the steps on the way, and what can be set."),
    "photo": ("Photos", "Photos in and out of files."),
    "face": ("Faces", "Where a face is, and its landmarks in and out of files."),
    "warp": ("Warping", "One face laid over another."),
    "ltv": ("Light and person", "A photo parted into light and person, by logarithmic total variation."),
    "solver": ("TV-L1", "The exact solver, its proof, and the isotropic one."),
    "train": ("Training", "Faces relit at random, to train with, and without their light."),
    "display": ("Display", "Results and images, shown in notebooks and terminals."),
}
_INTRODUCTION = """# The API

`import relit` has all that is public; the rest may change. Images are arrays, `(H, W)` grey or `(H, W, 3)`
RGB, of uint8, uint16, or floats in [0, 1]; landmarks are `(x, y)` in px, pixel centres at integers.
[In Python](../library.md) has what to try first.

| module | what for | names |
|---|---|---|"""
_TOP = ("relighting", "results", "settings", "errors")


def generated() -> dict[str, str]:
    """Return the text of every page, by its place on the site."""
    rooms = names_by_room()
    index = [_INTRODUCTION]
    pages = {"commands.md": commands()}
    for room, names in rooms.items():
        title, about = _ROOMS.get(room, (room.capitalize(), ""))
        links = ", ".join(f"[`{name}`][relit.{relit._HOME[name]}.{name}]" for name in names)
        index.append(f"| [{title}]({room}.md) | {about} | {links} |")
        parts = [f"# {title}", about, *(_entry(name) for name in names)]
        pages[f"api/{room}.md"] = "\n\n".join(parts)
    pages["api/index.md"] = "\n".join(index)
    return pages


def names_by_room() -> dict[str, list[str]]:
    """Return the public names, functions first, by the page that documents them."""
    rooms = defaultdict(list)
    for name in sorted(relit.__all__, key=lambda name: (name[0].isupper(), name)):
        room = relit._HOME[name].partition(".")[0]
        rooms["transfer" if room in _TOP else room].append(name)
    return {room: rooms[room] for room in sorted(rooms, key=[*_ROOMS, *rooms].index)}


def _entry(name: str) -> str:
    label = f'      heading: "relit.{name}"\n      toc_label: "{name}"'
    entry = f"::: relit.{relit._HOME[name]}.{name}\n    options:\n{label}"
    # Its signature would be the declarations of all options.
    return f"{entry}\n      show_signature: false\n\n{_defaults()}" if name == "TransferOptions" else entry


def _defaults() -> str:
    rows = [
        f"| `{field.name}` | `{field.default!r}` | `{field.metadata['flag']}` |"
        for field in fields(relit.TransferOptions)
    ]
    return "\n".join(["| field | default | on the command line |", "|---|---|---|", *rows])


def commands() -> str:
    """Return the help of every command, the expert's options told in whole."""
    parts = [
        "# Every command\n\nWhat `relit COMMAND --help-all` prints. [The command line](command-line.md) "
        "tells what to try first, and what is said where."
    ]
    for name, command in sorted(command_line.commands.items()):
        parts.append(f"## relit {name}\n\n```text\n{_help(name, command)}\n```")
    return "\n\n".join(parts)


def _help(name: str, command: click.Command) -> str:
    flag = "--help-all" if any("--help-all" in given.opts for given in command.params) else "--help"
    asked = CliRunner().invoke(command_line, [name, flag], prog_name="relit", terminal_width=_WIDTH)
    return asked.output.rstrip()
