"""How a run ends: with its exit code, and one line on what went wrong."""

from __future__ import annotations

import os
import sys
from typing import TYPE_CHECKING

import click

from relit.cli.telling import printable
from relit.cli.wording import in_flags
from relit.errors import OptionError, RelitError

if TYPE_CHECKING:
    from collections.abc import Callable


def exit_code_of(command: Callable[[], int | None]) -> int:
    """Run a command; print what went wrong in one line, and return the exit code."""
    try:
        return command() or 0
    except getattr(click.exceptions, "NoArgsIsHelpError", ()) as error:  # from click 8.2
        error.show()
        return int(error.exit_code)
    except click.UsageError as error:
        return _failed(_usage(error), error.exit_code)
    except click.ClickException as error:
        return _failed(error.format_message(), error.exit_code)
    except RelitError as error:
        return _failed(in_flags(str(error)), 2 if isinstance(error, OptionError) else 1)
    except (KeyboardInterrupt, click.Abort):
        click.echo("relit: interrupted", err=True)
        return 130
    except MemoryError:
        return _failed("not enough memory for photos of this size; try smaller ones")
    except BrokenPipeError:
        # Nobody reads our output any more: write nothing, also not when Python flushes stdout at its end.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1


def _usage(error: click.UsageError) -> str:
    """Return in one line what click finds wrong with a command, and where its help is."""
    told, ctx = error.format_message(), error.ctx
    parameter = None if isinstance(error, click.MissingParameter) else getattr(error, "param", None)
    if parameter is not None:
        hint = parameter.get_error_hint(ctx).replace("'", "")
        told = f"{hint}: {error.message}"
    return f"{told.removesuffix('.')} (see {ctx.command_path if ctx else 'relit'} --help)"


def _failed(message: str, code: int = 1) -> int:
    click.echo(f"relit: error: {printable(message)}", err=True)
    return code
