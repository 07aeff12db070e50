"""The commands ``relit studio`` and ``relit serve``: the page in a browser, and the API for others."""

from __future__ import annotations

import webbrowser
from importlib import import_module
from types import ModuleType

import click

from relit.cli.kinds import FILE
from relit.cli.sources import read_photo
from relit.cli.telling import progress
from relit.errors import OptionError

_PORT = click.IntRange(0, 65535)


@click.command()
@click.argument("photos", metavar="[TARGET REFERENCE]", nargs=-1, type=FILE)
@click.option(
    "--port", type=_PORT, default=0, help="Port of 127.0.0.1 to listen at. [default: any that is free]"
)
@click.option("--open/--no-open", "opened", default=True, show_default=True, help="Open a browser at it.")
def studio(photos: tuple[str, ...], port: int, opened: bool) -> None:
    """Relight interactively, on a page in your browser.

    The page is served on this machine alone. Photos stay in its memory, and nothing is sent elsewhere.
    TARGET and REFERENCE can also be dropped onto the page.
    """
    if len(photos) not in (0, 2):
        raise click.UsageError("Give a TARGET and a REFERENCE, or neither.")
    server = _server()
    limits = server.PERSONAL
    sessions = server.Sessions(limits)
    token = ""
    if photos:
        with progress("Reading the photos"):
            token = sessions.begin([read_photo(path) for path in photos])

    def ready(address: str) -> None:
        address += f"#{token}" if token else ""
        click.echo(f"relit studio: {address} (Ctrl-C ends it)", err=True)
        if opened:
            webbrowser.open(address)

    server.Server(server.create_app(limits=limits, sessions=sessions), "127.0.0.1", port, ready).run()


@click.command()
@click.option("--host", default="127.0.0.1", show_default=True, help="Address to listen at.")
@click.option("--port", type=_PORT, default=8765, show_default=True, help="Port to listen at.")
@click.option(
    "--allow-host",
    "names",
    multiple=True,
    metavar="NAME",
    help="Host name that clients may use, besides localhost; may be given several times.",
)
@click.option("--page/--no-page", default=False, show_default=True, help="Show the page as well.")
def serve(host: str, port: int, names: tuple[str, ...], page: bool) -> None:
    """Serve the studio's HTTP API for a team, without a browser.

    Its description is at /api/v1/openapi.json. There is no password: listen where only your team is.
    """
    server = _server()
    app = server.create_app(hosts=(*server.LOCAL, host, *names), page=page)
    server.Server(app, host, port, lambda url: click.echo(f"relit serve: {url}api/v1", err=True)).run()


def _server() -> ModuleType:
    """Import the server, or say how to get the web framework that it takes."""
    try:
        return import_module("relit.studio.app")
    except ModuleNotFoundError as error:
        raise OptionError(f"studio: {error.name} is not installed; run pip install 'relit[studio]'") from None
