"""The command ``relit serve``: the HTTP API for programs and teams."""

from __future__ import annotations

import logging
import os
import re
import time
from collections.abc import Callable
from dataclasses import fields
from ipaddress import ip_network
from typing import Any

import click

from relit.cli.groups import Option, SectionedCommand
from relit.cli.kinds import Amount, Count, Duration
from relit.cli.studio import PORT, studio_module
from relit.errors import OptionError
from relit.studio.addresses import plain
from relit.studio.limits import Limits

_TOKEN = "RELIT_TOKEN"
#: What a client may call a server by (RFC 3986, reg-name, as far as names of machines go).
_NAME = re.compile(r"[A-Za-z0-9_-]+(\.[A-Za-z0-9_-]+)*\.?")
#: Field of `Limits` → its flag, what it may be, and what it bounds.
LIMITS: dict[str, tuple[str, click.ParamType[Any], str]] = {
    "bytes": ("--max-bytes", Amount(), "Of one photo that is sent."),
    "pixels": ("--max-pixels", Amount(), "Of one photo."),
    "memory": ("--memory", Amount(), "Bytes that photos and previews of all sessions may hold."),
    "working_memory": ("--working-memory", Amount(), "Bytes that all computations at once may take."),
    "sessions": ("--max-sessions", Count(1), "Sessions, over all clients."),
    "sessions_per_client": ("--max-sessions-per-client", Count(1), "Sessions of one client."),
    "live_seconds": (
        "--live",
        Duration(),
        "Seconds after a request for which no other client ends its session.",
    ),
    "workers": ("--workers", Count(1), "Computations at once."),
    "queue": ("--queue", Count(1), "Computations that may wait."),
    "queue_per_session": ("--queue-per-session", Count(1), "Computations of one session that may wait."),
    "connections": (
        "--max-connections",
        Count(4),
        "Connections at once; of one client, a quarter. Fewer where the system allows few open files.",
    ),
    "header_seconds": ("--header-timeout", Duration(), "Seconds for the head of a request."),
    "body_seconds": ("--body-timeout", Duration(), "Seconds for its body."),
    "compute_seconds": ("--compute-timeout", Duration(), "Seconds for its answer."),
}


def _limit_options(command: Callable[..., None]) -> Callable[..., None]:
    """Add an option for every limit."""
    for field in reversed(fields(Limits)):
        flag, kind, meaning = LIMITS[field.name]
        command = click.option(
            flag,
            field.name,
            cls=Option,
            group="limits",
            type=kind,
            metavar="S" if isinstance(kind, Duration) else "N",
            default=_short(field.default) if isinstance(kind, Amount) else field.default,
            show_default=True,
            help=meaning,
        )(command)
    return command


def _short(amount: Any) -> str:
    """Write 200000000 as 200M."""
    factor, letter = next(((10**n, one) for n, one in ((9, "G"), (6, "M")) if amount % 10**n == 0), (1, ""))
    return f"{amount // factor}{letter}"


def _names(_ctx: click.Context, _param: click.Parameter, names: tuple[str, ...]) -> tuple[str, ...]:
    for name in names:
        if not (_NAME.fullmatch(name) or plain(name)):
            wanted = "a name alone, as light.team, without http:// and without a port"
            raise OptionError(f"--allow-host: expected {wanted}, got {name!r}")
    return names


def _networks(_ctx: click.Context, _param: click.Parameter, proxies: tuple[str, ...]) -> tuple[str, ...]:
    for proxy in proxies:
        try:
            ip_network(proxy)
        except ValueError:
            wanted = "an address or a network, as 127.0.0.1 or 10.0.0.0/8"
            raise OptionError(f"--trusted-proxy: expected {wanted}, got {proxy!r}") from None
    return proxies


@click.command(
    cls=SectionedCommand,
    headings={
        "files": "Options",
        "who": "Who may come in",
        "limits": "Limits (k, M and G are 1e3, 1e6, 1e9)",
    },
)
@click.option("--host", default="127.0.0.1", show_default=True, help="Address to listen at; 0.0.0.0 for all.")
@click.option(
    "--port",
    type=PORT,
    metavar="N",
    default=8765,
    show_default=True,
    help="Port to listen at; 0 is any free.",
)
@click.option("--page/--no-page", default=False, show_default=True, help="Show the page as well.")
@click.option(
    "--access-log",
    is_flag=True,
    help="A line on stderr for every request: when, what kind, status, seconds; no names, no addresses.",
)
@click.option(
    "--token",
    cls=Option,
    group="who",
    envvar=_TOKEN,
    show_envvar=True,
    metavar="TOKEN",
    help="What clients have to send. Better in RELIT_TOKEN: this is seen in the list of processes. [default: "
    "for others than this machine, one that is made and printed]",
)
@click.option(
    "--no-token",
    "tokenless",
    cls=Option,
    group="who",
    is_flag=True,
    help="Ask nobody for a token: only where a proxy in front asks who it is, and nobody gets past that.",
)
@click.option(
    "--allow-host",
    "names",
    cls=Option,
    group="who",
    multiple=True,
    metavar="NAME",
    callback=_names,
    help="Name that clients call it by, besides localhost and its address; may be given several times.",
)
@click.option(
    "--trusted-proxy",
    "proxies",
    cls=Option,
    group="who",
    multiple=True,
    metavar="ADDRESS",
    callback=_networks,
    help="Address or network of a proxy, to be believed whom it asks for (X-Forwarded-For); may be given "
    "several times.",
)
@_limit_options
def serve(
    host: str,
    port: int,
    page: bool,
    access_log: bool,
    token: str | None,
    tokenless: bool,
    names: tuple[str, ...],
    proxies: tuple[str, ...],
    **limits: Any,
) -> None:
    """Serve the studio's HTTP API for programs and a team, without a browser.

    Its description is at /api/v1/openapi.json. On this machine alone, it asks nobody who it is. For others
    (another --host than 127.0.0.1, an --allow-host or a --trusted-proxy) it asks for a token, and wants a
    proxy in front that has TLS: docs/api.md has one.
    """
    parts = {
        name: studio_module(name) for name in ("app", "server", "access", "addresses", "metrics", "watch")
    }
    address = parts["addresses"].resolved(host)
    local = parts["addresses"].is_loopback(address)
    if token is None:  # click takes an empty variable for none, and whoever set it wanted a token
        token = os.environ.get(_TOKEN)
    if token is not None and tokenless:
        raise click.UsageError("--token (or RELIT_TOKEN) and --no-token exclude each other.")
    token = None if token is None else parts["access"].checked(token)
    made = token is None and not tokenless and bool(not local or names or proxies)
    if made:
        token = parts["access"].new_token()
    if access_log:
        _log_to_stderr(parts["watch"].LOG)
    # An address needs no leave: it is compared with the one that a connection came in at.
    named = () if parts["addresses"].plain(host) else (host,)
    bounds, metrics = Limits(**limits), parts["metrics"].Metrics()
    app = parts["app"].create_app(
        hosts=(*parts["app"].LOCAL, *named, *names), token=token, page=page, limits=bounds, metrics=metrics
    )

    def ready(_first: str) -> None:
        for url in server.addresses:
            click.echo(f"relit serve: {url}api/v1", err=True)
        for url in server.addresses if page else ():
            click.echo(f"relit serve: the page: {url}{f'#token={token}' if made else ''}", err=True)
        if made:
            click.echo(f"relit serve: the token, made for this run: {token}", err=True)
        if not local:
            _warn_of(address)
        if server.most_connections < bounds.connections:
            _warn(
                f"so few files may be open at once that there are {server.most_connections} connections at "
                "most; raise ulimit -n"
            )

    server = parts["server"].Server(
        app, address, port, ready, limits=bounds, proxies=proxies, refused=metrics.refused
    )
    server.run()


def _warn_of(address: str) -> None:
    """Say what it means to be reached from elsewhere."""
    if address in ("0.0.0.0", "::"):
        _warn(f"{address} is every address of this machine, in every network that it is in")
    _warn("no TLS: whoever is on the way reads photos and the token; have a proxy in front (docs/api.md)")


def _warn(text: str) -> None:
    click.echo(f"relit: warning: {text}", err=True)


def _log_to_stderr(log: logging.Logger) -> None:
    handler = logging.StreamHandler()
    handler.setFormatter(logging.Formatter("%(asctime)s.%(msecs)03dZ %(message)s", "%Y-%m-%dT%H:%M:%S"))
    handler.formatter.converter = time.gmtime  # type: ignore[union-attr]
    log.addHandler(handler)
    log.setLevel(logging.INFO)
    log.propagate = False
