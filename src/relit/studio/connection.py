"""One connection: how long it may keep the server waiting, and how many there may be."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from http import HTTPStatus
from ipaddress import IPv4Network, IPv6Network
from typing import Any

import h11
from fastapi.responses import JSONResponse
from uvicorn.protocols.http.h11_impl import H11Protocol

from relit.studio.addresses import plain
from relit.studio.clients import client_of
from relit.studio.failures import refusal

#: Closed connections, beside the open ones, that still have time to read why.
TOLD = 8
#: Seconds that they have.
_TO_READ = 1.0
#: bytes/s: who takes an answer more slowly has gone, or means to hold it; GPRS is several times as fast.
_SLOWEST = 1000


@dataclass(frozen=True)
class Bounds:
    """What connections may take.

    Attributes
    ----------
    most, per_client : int
        How many there may be at once, and of one client.
    head_seconds : float
        How long the head of a request may take, or the rest of one that was refused.
    read_seconds : float
        How often a client must have taken some of its answer.
    proxies : sequence of networks
        Whose connections are those of many clients.
    refused : callable
        Told, in a word, why a connection was closed.
    """

    most: int
    per_client: int
    head_seconds: float
    read_seconds: float
    proxies: Sequence[IPv4Network | IPv6Network] = ()
    refused: Callable[[str], None] = field(default=lambda _reason: None)


class Connection(H11Protocol):
    """An HTTP/1.1 connection that does not wait for ever."""

    def __init__(self, *given: Any, bounds: Bounds, **named: Any) -> None:
        super().__init__(*given, **named)
        self._bounds, self._closed = bounds, False
        self._turn: asyncio.TimerHandle | None = None  # runs while the client owes a head
        self._reading: asyncio.TimerHandle | None = None  # runs while it owes reading
        self._unread = 0

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Take a connection, or refuse one too many."""
        super().connection_made(transport)
        transport.set_write_buffer_limits(0)  # `pause_writing` tells of whatever was not taken yet
        bounds, host = self._bounds, self.client[0] if self.client else ""
        address, us = plain(host), client_of({"client": self.client})
        many = address is not None and any(address in network for network in bounds.proxies)
        others = [one for one in self.connections if isinstance(one, Connection) and not one._closed]
        ours = 0 if many else sum(client_of({"client": one.client}) == us for one in others)
        if len(others) > bounds.most or ours > bounds.per_client:
            message = "There are as many connections as there may be; close some, or ask again in a second."
            self._close("too_many_connections", refusal(503, "busy", message, {"Retry-After": "1"}))
        else:
            self._time()

    def connection_lost(self, exc: Exception | None) -> None:
        """Forget a connection."""
        self._closed = True
        for timer in (self._turn, self._reading):
            if timer:
                timer.cancel()
        super().connection_lost(exc)

    def data_received(self, data: bytes) -> None:
        """Take what came."""
        if not self._closed:
            super().data_received(data)
            self._time()

    def on_response_complete(self) -> None:
        """Go on to the next request."""
        super().on_response_complete()
        self._time()

    def shutdown(self) -> None:
        """End, once what is being answered is."""
        if self._closed:
            self.transport.abort()
        else:
            super().shutdown()

    def pause_writing(self) -> None:
        """Have an answer wait for its reader, as long as that one reads."""
        super().pause_writing()
        if not self._closed:
            self._unread = self.transport.get_write_buffer_size()
            self._reading = self.loop.call_later(self._bounds.read_seconds, self._check_reading)
            self._time()

    def resume_writing(self) -> None:
        """Go on with an answer."""
        super().resume_writing()
        if self._reading:
            self._reading.cancel()
            self._reading = None
        self._time()

    def send_400_response(self, msg: str) -> None:
        """Answer what is no HTTP; with a broken body, an answer may be on its way already."""
        del msg
        if self.conn.our_state in (h11.IDLE, h11.SEND_RESPONSE):
            message = "This is no HTTP/1.1 request that can be read; see what the client sends."
            self._close("malformed", refusal(400, "bad_request", message))
        else:
            self._cut("malformed")

    def _time(self) -> None:
        """Give the client a deadline while it is its turn: to send a head, or the rest of a refused body.

        As long as it reads an answer, it is not: what it has not taken yet would be lost.
        """
        if self._closed:
            return
        theirs = self.conn.their_state
        answered = self.cycle is not None and self.cycle.response_complete
        if not self._reading and (theirs is h11.IDLE or (theirs is h11.SEND_BODY and answered)):
            self._turn = self._turn or self.loop.call_later(self._bounds.head_seconds, self._late)
        elif self._turn:
            self._turn.cancel()
            self._turn = None

    def _late(self) -> None:
        if self.conn.their_state is h11.IDLE and self.conn.trailing_data[0]:
            message = "The head of the request did not come in time; send it again."
            self._close("slow_head", refusal(408, "too_slow", message))
        else:
            self._cut("idle")

    def _check_reading(self) -> None:
        left = self.transport.get_write_buffer_size()
        if self._unread - left < _SLOWEST * self._bounds.read_seconds:
            self._cut("slow_reader")
        else:
            self._unread = left
            self._reading = self.loop.call_later(self._bounds.read_seconds, self._check_reading)

    def _close(self, reason: str, answer: JSONResponse) -> None:
        """Say why, and hang up once it was read."""
        self._end(reason)
        status, headers = HTTPStatus(answer.status_code), answer.headers | {"connection": "close"}
        lines = [
            f"HTTP/1.1 {status} {status.phrase}",
            *(f"{name}: {value}" for name, value in headers.items()),
        ]
        self.transport.write("\r\n".join([*lines, "", ""]).encode("latin-1") + bytes(answer.body))
        if sum(isinstance(one, Connection) and one._closed for one in self.connections) > TOLD:
            self.transport.close()
        else:
            # What comes until then is read: the system would answer it by taking back what was said.
            with suppress(OSError):  # it has gone since it was told
                self.transport.write_eof()
            self._turn = self.loop.call_later(_TO_READ, self.transport.abort)

    def _cut(self, reason: str) -> None:
        self._end(reason)
        self.transport.abort()

    def _end(self, reason: str) -> None:
        """Have no more of this connection, and tell a request that its client has gone."""
        self._closed = True
        if self._turn:
            self._turn.cancel()
        if self.cycle is not None and not self.cycle.response_complete:
            self.cycle.disconnected = True
            self.cycle.message_event.set()
        self._bounds.refused(reason)
