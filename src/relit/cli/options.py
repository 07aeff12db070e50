"""The options of the commands, made from `TransferOptions` wherever it declares them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields, replace
from typing import Any

import click
from click.core import ParameterSource

from relit.cli.groups import Option
from relit.cli.kinds import FILE, Count, Number, Words
from relit.errors import OptionError
from relit.settings.idle import idle
from relit.settings.option_fields import is_share, number_wanted
from relit.settings.options import TransferOptions

Command = Callable[..., None]
Decorator = Callable[[Command], Command]

ALIGNMENT = ("kernel", "affine", "smoothing")
SPLIT = ("lam", "neighborhood")

output_option = click.option(
    "-o", "--output", required=True, type=FILE, metavar="FILE", help="Photo to write; - is stdout."
)
force_option = click.option("--force", is_flag=True, help="Replace files that exist.")
json_option = click.option("--json", "as_json", is_flag=True, help="Print what was done, as JSON, on stdout.")


def transfer_options(*names: str) -> Decorator:
    """Add the named transfer options, or all, to a command; the command gets them by field name."""

    def decorate(command: Command) -> Command:
        for option in reversed(fields(TransferOptions)):
            if names and option.name not in names:
                continue
            declared, flag, metavar = option.metadata, option.metadata["flag"], None
            choices, words = declared["choices"], declared["words"]
            kind: click.ParamType[Any] | None
            if isinstance(option.default, bool):
                flag, kind = f"{flag}/{flag.replace('--', '--no-')}", None
            elif choices:
                kind = click.Choice([str(choice) for choice in choices])
            elif declared["text"]:
                kind, metavar = Words(words), "WORD"
            else:
                kind = Number(words, share=is_share(declared), wanted=number_wanted(declared))
                metavar = "|".join(("N", *words))
            command = click.option(
                flag,
                option.name,
                cls=Option,
                group=declared["group"],
                title=declared["title"],
                type=kind,
                metavar=metavar,
                default=str(option.default) if choices else option.default,
                show_default=True,
                help=declared["help"],
            )(command)
        return command

    return decorate


def settings_of(given: dict[str, Any], saved: TransferOptions | None = None) -> TransferOptions:
    """Return options from what the command line gave; choices come back as the values they stand for.

    Of saved options, those stay that the command line does not give.
    """
    known = {option.name: option for option in fields(TransferOptions)}
    values = {}
    for name, value in given.items():
        meant = [choice for choice in known[name].metadata["choices"] if str(choice) == value]
        values[name] = meant[0] if meant else value
    if saved is not None:
        source = click.get_current_context().get_parameter_source
        values = {
            name: value for name, value in values.items() if source(name) == ParameterSource.COMMANDLINE
        }
    return replace(saved or TransferOptions(), **values)


def check_heeded(settings: TransferOptions) -> None:
    """Refuse options that were given and would do nothing; those in a file of settings are all there."""
    source = click.get_current_context().get_parameter_source
    for name, beside in idle(settings).items():
        if source(name) == ParameterSource.COMMANDLINE:
            flag = TransferOptions.__dataclass_fields__[name].metadata["flag"]
            raise OptionError(f"{flag}: does nothing with {beside}")


def check_streams(output: str, as_json: bool, *inputs: str) -> None:
    """Refuse to use a standard stream twice."""
    if output == "-" and as_json:
        raise click.UsageError("stdout cannot take both the photo and --json; write the photo to a file.")
    if inputs.count("-") > 1:
        raise click.UsageError("stdin holds one photo; give the other as a file.")


def face_options(role: str, prefix: str = "", *, several: bool = False, group: str = "where") -> Decorator:
    """Add the options that say where the face of a photo is, or of several photos."""
    again = ", once for each" if several else ""

    def decorate(command: Command) -> Command:
        flag = prefix.replace("_", "-")
        short = ["--face"] if role == "target" else []
        command = click.option(
            *short,
            f"--{flag}face",
            f"{prefix}face",
            cls=Option,
            group=group,
            title=f"Which face of the {role}",
            type=Count(0),
            metavar="N",
            multiple=several,
            help=f"Which face of the {role}{again}: 0 is the largest. [default: 0]",
        )(command)
        return click.option(
            f"--{flag}landmarks",
            f"{prefix}landmarks",
            cls=Option,
            group="expert",
            title=f"Landmarks of the {role}",
            type=FILE,
            metavar="FILE",
            multiple=several,
            help=f"Landmarks of the {role}{again}, instead of detected ones: .pts, .tem, .json, .csv or "
            ".xml.",
        )(command)

    return decorate
