"""How much may be sent: in one body, in all that are coming in at once, and how slowly."""

from __future__ import annotations

import asyncio
from contextlib import suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING

from relit.studio.failures import refusal

if TYPE_CHECKING:
    from fastapi.responses import JSONResponse
    from starlette.types import ASGIApp, Message, Receive, Scope, Send

#: The longest body that is no photo: landmark files have 4 MiB at most, JSON less.
SMALL_BYTES = 4_200_000


@dataclass
class _Pool:
    """Bodies of a kind.

    Attributes
    ----------
    longest : int
        Bytes of one.
    together : int
        Bytes of all that are in memory.
    held : int
        How many those are.
    """

    longest: int
    together: int
    held: int = 0


class _RefusedError(Exception):
    """A body that is answered here."""


class Intake:
    """ASGI middleware that bounds the memory which bodies take, from all clients together.

    Photos have one pool, and what is small another: who floods the one does not keep others from the other.
    What is refused is forgotten at once, so that there is room again.

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
        pool = self.photos if "/photos/" in scope["path"] else self.others
        lengths = [value for name, value in scope["headers"] if name == b"content-length"]
        if any(length.isdigit() and int(length) > pool.longest for length in lengths):
            await _too_large(pool)(scope, receive, send)
            return
        received, whole, refused = 0, False, False

        async def refuse(answer: JSONResponse) -> None:
            nonlocal refused
            refused = True
            await answer(scope, receive, send)
            raise _RefusedError

        async def counted() -> Message:
            nonlocal received, whole
            if refused:
                raise _RefusedError
            try:
                async with asyncio.timeout(None if whole else self.patience):
                    message = await receive()
            except TimeoutError:
                await refuse(refusal(408, "too_slow", "The body stopped coming; send it again."))
            if message["type"] == "http.request":
                size = len(message.get("body", b""))
                received, pool.held = received + size, pool.held + size
                whole = not message.get("more_body", False)
                if received > pool.longest:
                    await refuse(_too_large(pool))
                if pool.held > pool.together:
                    await refuse(_busy())
            return message

        async def unless_refused(message: Message) -> None:
            if not refused:
                await send(message)

        try:
            with suppress(_RefusedError):
                await self.app(scope, counted, unless_refused)
        finally:
            pool.held -= received


def _too_large(pool: _Pool) -> JSONResponse:
    most = pool.longest / 1e6
    return refusal(413, "too_large", f"The body may have {most:.3g} MB at most; send less.")


def _busy() -> JSONResponse:
    message = "Others are sending as much as fits into memory; send it again in a second."
    return refusal(429, "busy", message, {"Retry-After": "1"})
