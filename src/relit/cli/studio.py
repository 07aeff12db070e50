"""The command ``relit studio``: the page in a browser on this machine."""

from __future__ import annotations

import webbrowser
from importlib import import_module
from pathlib import Path
from types import ModuleType

import click

from relit.cli.kinds import FILE, Count
from relit.cli.sources import read_photo
from relit.cli.telling import progress
from relit.errors import OptionError

PORT = Count(0, 65535)


@click.command()
@click.argument("photos", metavar="[TARGET REFERENCE]", nargs=-1, type=FILE)
@click.option(
    "--port",
    type=PORT,
    metavar="N",
    default=0,
    help="Port of 127.0.0.1 to listen at. [default: any that is free]",
)
@click.option("--open/--no-open", "opened", default=True, show_default=True, help="Open a browser at it.")
def studio(photos: tuple[str, ...], port: int, opened: bool) -> None:
    """Relight interactively, on a page in your browser.

    The page is served on this machine alone. Photos stay in its memory, and nothing is sent elsewhere.
    TARGET and REFERENCE can also be dropped onto the page.
    """
    if len(photos) not in (0, 2):
        raise click.UsageError("Give a TARGET and a REFERENCE, or neither.")
    app, server = studio_module("app"), studio_module("server")
    limits = app.PERSONAL
    sessions = app.Sessions(limits, app.EXPIRES_AT_HOME)
    token = ""
    if photos:
        with progress("Reading the photos"):
            token = sessions.begin([(Path(path).name, read_photo(path)) for path in photos])

    def ready(address: str) -> None:
        address += f"#{token}" if token else ""
        click.echo(f"relit studio: {address} (Ctrl-C ends it)", err=True)
        if opened:
            webbrowser.open(address)

    server.Server(
        app.create_app(limits=limits, sessions=sessions), "127.0.0.1", port, ready, limits=limits
    ).run()


def studio_module(name: str) -> ModuleType:
    """Import a module of the studio, or say how to get the web framework that it takes."""
    try:
        return import_module(f"relit.studio.{name}")
    except ModuleNotFoundError as error:
        raise OptionError(f"studio: {error.name} is not installed; run pip install 'relit[studio]'") from None
