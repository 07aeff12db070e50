"""How much may be sent: in one body, by one client and by all, and how slowly."""

from __future__ import annotations

import asyncio
from contextlib import suppress
from dataclasses import dataclass, field

from fastapi.responses import JSONResponse
from starlette.datastructures import Headers
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from relit.studio.clients import client_of
from relit.studio.failures import refusal
from relit.studio.limits import Limits

#: The longest body that is no photo: landmark files have 4 MiB at most, JSON less.
SMALL_BYTES = 4_200_000

#: Bytes a second that a body must keep to in the long run: half of what the slowest lines that are sold have
#: upwards, 1 Mbit/s. A photo of 200 MB over such a line takes half an hour, and may.
LEAST_RATE = 64_000

#: Seconds that a body may stop coming.
PATIENCE = 30

#: Seconds for which a body must have let others wait before it gives way: a line may halt for a moment.
_LAGS = 1


@dataclass(eq=False)
class _Body:
    """A body that is in memory: whose, how much of it, and until when more must come."""

    client: str
    due: float
    received: int = 0
    whole: bool = False
    refused: JSONResponse | None = None
    waiting: asyncio.Timeout | None = None

    def give_up(self, refused: JSONResponse) -> None:
        """Refuse it, at once if it is waited for."""
        self.refused = refused
        if self.waiting and not self.waiting.expired():
            self.waiting.reschedule(0)


@dataclass
class _Pool:
    """Bodies of a kind: bytes that one may have, that those of a client and all may have, and they."""

    longest: int
    of_client: int
    together: int
    bodies: list[_Body] = field(default_factory=list)

    def held(self, client: str | None = None) -> int:
        """Bytes that the bodies have, of all clients or of one; what is refused has none in a moment."""
        held = [one for one in self.bodies if client in (None, one.client) and not one.refused]
        return sum(one.received for one in held)


class _RefusedError(Exception):
    """A body that is answered here."""


class Intake:
    """ASGI middleware that bounds the memory which bodies take, and the time for which they take it.

    A body has `body_seconds` at first, and as long again for what comes: sent quickly and then held back, or
    slower than `LEAST_RATE` all along, it is refused. Photos have one pool, and all other bodies another; in
    either a client has no more than half. Where a pool is full, a body that lags gives way to one that comes.

    Parameters
    ----------
    app : ASGI application
    limits : Limits
        Of them, `bytes`, the longest photo, and `body_seconds`.
    patience : float
        Seconds that a body may stop coming.
    """

    def __init__(self, app: ASGIApp, limits: Limits, patience: float = PATIENCE) -> None:
        self.app, self.patience, self.seconds = app, patience, limits.body_seconds
        photo, small = limits.bytes, min(limits.bytes, SMALL_BYTES)
        self.photos, self.others = _Pool(photo, photo, 2 * photo), _Pool(small, 8 * small, 16 * small)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass a request on, its body counted; or answer it here."""
        if scope["type"] != "http":
            await self.app(scope, receive, send)
            return
        photo = "/photos/" in scope["path"] or "/references/" in scope["path"]
        pool, clock = self.photos if photo else self.others, asyncio.get_running_loop().time
        body = _Body(client_of(scope), clock() + self.seconds)
        length = Headers(scope=scope).get("content-length", "")
        if length.isdigit() and int(length) > pool.longest:
            body.refused = _too_large(pool)

        async def counted() -> Message:
            if body.refused:
                raise _RefusedError
            until = None if body.whole else min(clock() + self.patience, body.due)
            try:
                async with asyncio.timeout_at(until) as body.waiting:
                    message = await receive()
            except TimeoutError:
                body.refused = body.refused or _too_slow()
                raise _RefusedError from None
            finally:
                body.waiting = None
            if message["type"] == "http.request":
                size = len(message.get("body", b""))
                body.received += size
                body.due = min(body.due + size / LEAST_RATE, clock() + self.seconds)
                body.whole = not message.get("more_body", False)
                body.refused = body.refused or self._excess(pool, body, clock())
            if body.refused:
                raise _RefusedError
            return message

        async def unless_refused(message: Message) -> None:
            if not body.refused:
                await send(message)

        pool.bodies.append(body)
        try:
            with suppress(_RefusedError):
                if not body.refused:
                    await self.app(scope, counted, unless_refused)
        finally:
            pool.bodies.remove(body)
        if body.refused:
            await body.refused(scope, receive, send)

    def _excess(self, pool: _Pool, body: _Body, now: float) -> JSONResponse | None:
        """Return the answer to a body that is too long, or one too many; others that lag give way."""
        if body.received > pool.longest:
            return _too_large(pool)
        if pool.held(body.client) > pool.of_client:
            return _busy("You are sending as much as one client may; send it again in a second.")
        coming = [one for one in pool.bodies if one is not body and not one.whole and not one.refused]
        for other in sorted(coming, key=lambda one: one.due):
            if pool.held() <= pool.together or other.due > now + self.seconds - _LAGS:
                break
            other.give_up(_too_slow())
        if pool.held() > pool.together:
            return _busy("Others are sending as much as fits into memory; send it again in a second.")
        return None


def _too_large(pool: _Pool) -> JSONResponse:
    return refusal(413, "too_large", f"The body may have {pool.longest / 1e6:.3g} MB at most; send less.")


def _too_slow() -> JSONResponse:
    return refusal(408, "too_slow", "The body stopped coming, or came too slowly; send it again.")


def _busy(message: str) -> JSONResponse:
    return refusal(429, "busy", message, {"Retry-After": "1"})
