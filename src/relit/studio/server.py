"""The server that runs the studio's application."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from functools import partial
from ipaddress import ip_network
from signal import SIGINT
from socket import socket
from types import FrameType

import uvicorn
from starlette.types import ASGIApp

from relit.studio.addresses import listen, urls
from relit.studio.connection import TOLD, Bounds, Connection
from relit.studio.limits import Limits

#: Connections that the event loop accepts in a turn, beside the first; and that may wait for that. Who finds
#: no place there tries again after a second.
_IN_A_TURN, _WAITING = 8, 1024
#: Files that the server needs besides connections: its own (8 were seen, here twice as many), those of
#: clients who were just told why they are refused, and of four turns: so many pass from accepting a
#: connection to closing it.
_OWN_FILES = 16 + TOLD + 4 * (_IN_A_TURN + 1)
#: Seconds that requests may go on once the server is to end: `docker stop` kills it after 10.
_TO_END = 8


class Server(uvicorn.Server):
    """A server that tells `ready` its address once it can be opened.

    `run` returns once `should_exit` is set, and raises `KeyboardInterrupt` where Ctrl-C has set it.

    Parameters
    ----------
    app : ASGI application
    host, port : str, int
        Where it listens; port 0 is any that is free.
    ready : callable
        Given the first of its addresses.
    limits : Limits
        What its clients may take.
    proxies : sequence of str
        Addresses or networks of proxies, which are believed whom they ask for (X-Forwarded-For).
    refused : callable
        Told, in a word, why a connection was closed.

    Attributes
    ----------
    addresses : list of str
        Where it is reached, once it is ready.
    """

    def __init__(
        self,
        app: ASGIApp,
        host: str,
        port: int,
        ready: Callable[[str], None],
        *,
        limits: Limits = Limits(),
        proxies: Sequence[str] = (),
        refused: Callable[[str], None] = lambda _reason: None,
    ) -> None:
        self.addresses: list[str] = []
        self._interrupted = False
        self._where, self._ready = (host, port), ready
        self.most_connections = connections_of(limits)
        bounds = Bounds(
            self.most_connections,
            max(self.most_connections // 4, 1),
            limits.header_seconds,
            limits.body_seconds,
            [ip_network(proxy) for proxy in proxies],
            refused,
        )
        config = uvicorn.Config(
            app,
            http=partial(Connection, bounds=bounds),  # type: ignore[arg-type]
            # One implementation, whatever else is installed.
            loop="asyncio",
            ws="none",
            lifespan="off",
            # Warnings are about what strangers send: they would fill a disk.
            log_level="error",
            access_log=False,
            server_header=False,
            backlog=_IN_A_TURN,
            timeout_graceful_shutdown=_TO_END,
            proxy_headers=bool(proxies),
            forwarded_allow_ips=",".join(proxies),
        )
        super().__init__(config)

    def run(self, sockets: list[socket] | None = None) -> None:
        """Serve, until interrupted.

        Raises
        ------
        OptionError
            If it cannot listen there.
        KeyboardInterrupt
            Once all requests have ended, after Ctrl-C.
        """
        super().run(sockets or [listen(*self._where, _WAITING)])
        if self._interrupted:  # which uvicorn tells asyncio alone, and that is through by then
            raise KeyboardInterrupt

    def handle_exit(self, sig: int, frame: FrameType | None) -> None:
        """Begin to end."""
        self._interrupted |= sig == SIGINT
        super().handle_exit(sig, frame)

    async def startup(self, sockets: list[socket] | None = None) -> None:
        """Begin to listen."""
        await super().startup(sockets)
        if self.started and sockets:
            sockets[0].listen(_WAITING)  # the event loop has made it the same as what it accepts in a turn
            self.addresses = urls(sockets[0])
            self._ready(self.addresses[0])


def connections_of(limits: Limits) -> int:
    """Return how many connections there may be: fewer than the limit, where few files may be open."""
    with suppress(ImportError):  # Windows has no such bound
        from resource import RLIM_INFINITY, RLIMIT_NOFILE, getrlimit

        files = getrlimit(RLIMIT_NOFILE)[0]
        if files != RLIM_INFINITY:
            return max(min(limits.connections, files - _OWN_FILES), 4)
    return limits.connections
