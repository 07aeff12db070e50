"""Help in groups: what is wanted every day in whole sentences, the rest by its name.

``--help`` tells the expert's options in a line each, ``--help-all`` all of them as they are declared.
"""

from __future__ import annotations

from typing import Any

import click

_HEADINGS = {
    "light": "Light (shares as 0.8 or 80%)",
    "color": "Colour",
    "where": "Where",
    "files": "Files",
    "expert": "Expert",
}
_WHOLE = "relit.help_all"  # key of click's context
_COLUMN = 24  # characters that flags have beside their text, of 80: most flags do with one line then


class Option(click.Option):
    """An option of a group, which a short help may tell by its title."""

    def __init__(self, *flags: Any, group: str = "files", title: str = "", **declared: Any) -> None:
        super().__init__(*flags, **declared)
        self.group, self.title = group, title

    def row(self, ctx: click.Context, *, whole: bool) -> tuple[str, str]:
        """Return the flags and the text of a help: of an expert's option the title, unless it is `whole`."""
        flags, text = self.get_help_record(ctx) or ("", "")
        if whole or self.group != "expert":
            return flags, text
        names = [self.opts[-1], *(self.secondary_opts if self.default is True else ())]
        default = text.removeprefix(self.help or "") if self.default is not False else ""
        return " / ".join(names), self.title + default


class GroupedCommand(click.Command):
    """A command that shows its options in groups, and examples after its usage."""

    def __init__(self, *given: Any, examples: tuple[str, ...] = (), **declared: Any) -> None:
        super().__init__(*given, **declared)
        self.examples = examples
        self.params.append(
            Option(
                ["--help-all"],
                is_flag=True,
                is_eager=True,
                expose_value=False,
                callback=_show_all,
                help="Show this with every expert option told in whole.",
            )
        )

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the examples, and the options, group by group."""
        with formatter.section("Examples"):
            for example in self.examples:
                formatter.write(f"  {example}\n")
        _write_groups(self, ctx, formatter, _HEADINGS)


class SectionedCommand(click.Command):
    """A command that shows its options in sections of its own (group → heading); "files" has the others."""

    def __init__(self, *given: Any, headings: dict[str, str], **declared: Any) -> None:
        super().__init__(*given, **declared)
        self.headings = headings

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the options, section by section."""
        _write_groups(self, ctx, formatter, self.headings)


def _write_groups(
    command: click.Command, ctx: click.Context, formatter: click.HelpFormatter, headings: dict[str, str]
) -> None:
    groups: dict[str, list[tuple[str, str]]] = {group: [] for group in headings}
    for parameter in command.get_params(ctx):
        if isinstance(parameter, Option):
            groups[parameter.group].append(parameter.row(ctx, whole=ctx.meta.get(_WHOLE, False)))
        elif isinstance(parameter, click.Option) and (record := parameter.get_help_record(ctx)):
            groups["files"].append(record)
    for group, rows in groups.items():
        with formatter.section(headings[group]):
            formatter.write_dl([_filled(row) for row in rows], col_max=_COLUMN)


def _filled(row: tuple[str, str]) -> tuple[str, str]:
    """Return a row whose text begins in the same column in every group."""
    return row[0].ljust(_COLUMN), row[1]


def _show_all(ctx: click.Context, _param: click.Parameter, asked: bool) -> None:
    if asked:
        ctx.meta[_WHOLE] = True
        click.echo(ctx.get_help())
        ctx.exit()
