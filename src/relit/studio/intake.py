"""How much may be sent: in one body, in all that are coming in at once, and how slowly."""

from __future__ import annotations

import asyncio
from contextlib import suppress
from dataclasses import dataclass

from fastapi.responses import JSONResponse
from starlette.datastructures import Headers
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from relit.studio.failures import refusal

#: The longest body that is no photo: landmark files have 4 MiB at most, JSON less.
SMALL_BYTES = 4_200_000


@dataclass
class _Pool:
    """Bodies of a kind: bytes that one may have, that all in memory may have, and that they have."""

    longest: int
    together: int
    held: int = 0


class _RefusedError(Exception):
    """A body that is answered here."""


class Intake:
    """ASGI middleware that bounds the memory which bodies take, from all clients together.

    Photos have one pool, and all other bodies another: a flood of photos does not keep out the rest. What is
    refused is forgotten at once, so that there is room again.

    Parameters
    ----------
    app : ASGI application
    most_bytes : int
        The longest photo. Twice as much may be in memory.
    patience : float
        Seconds that a body may stop coming.
    """

    def __init__(self, app: ASGIApp, most_bytes: int, patience: float = 30) -> None:
        self.app, self.patience = app, patience
        small = min(most_bytes, SMALL_BYTES)
        self.photos, self.others = _Pool(most_bytes, 2 * most_bytes), _Pool(small, 16 * small)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass a request on, its body counted; or answer it here."""
        if scope["type"] != "http":
            await self.app(scope, receive, send)
            return
        photo = "/photos/" in scope["path"] or "/references/" in scope["path"]
        pool = self.photos if photo else self.others
        length = Headers(scope=scope).get("content-length", "")
        refused = _excess(pool, int(length) if length.isdigit() else 0)
        received, whole = 0, False

        async def counted() -> Message:
            nonlocal received, whole, refused
            if refused:
                raise _RefusedError
            try:
                async with asyncio.timeout(None if whole else self.patience):
                    message = await receive()
            except TimeoutError:
                refused = refusal(408, "too_slow", "The body stopped coming; send it again.")
                raise _RefusedError from None
            if message["type"] == "http.request":
                size = len(message.get("body", b""))
                received, pool.held = received + size, pool.held + size
                whole = not message.get("more_body", False)
                refused = _excess(pool, received)
            if refused:
                raise _RefusedError
            return message

        async def unless_refused(message: Message) -> None:
            if not refused:
                await send(message)

        try:
            with suppress(_RefusedError):
                if not refused:
                    await self.app(scope, counted, unless_refused)
        finally:
            pool.held -= received
        if refused:
            await refused(scope, receive, send)


def _excess(pool: _Pool, received: int) -> JSONResponse | None:
    """Return the answer to a body that is too long, or one too many."""
    if received > pool.longest:
        message = f"The body may have {pool.longest / 1e6:.3g} MB at most; send less."
        return refusal(413, "too_large", message)
    if pool.held > pool.together:
        message = "Others are sending as much as fits into memory; send it again in a second."
        return refusal(429, "busy", message, {"Retry-After": "1"})
    return None
