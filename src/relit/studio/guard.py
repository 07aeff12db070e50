"""What every request has to pass: who may ask, how much may be sent, what may be done with the answer."""

from __future__ import annotations

import json
from contextlib import suppress
from typing import TYPE_CHECKING
from urllib.parse import urlsplit

if TYPE_CHECKING:
    from collections.abc import Collection

    from starlette.types import ASGIApp, Message, Receive, Scope, Send

HEADERS = {
    "content-security-policy": (
        "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob: data:; "
        "connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
    ),
    "x-content-type-options": "nosniff",
    "x-frame-options": "DENY",
    "referrer-policy": "no-referrer",
    "cross-origin-opener-policy": "same-origin",
    "cross-origin-resource-policy": "same-origin",
    "permissions-policy": "camera=(), microphone=(), geolocation=()",
    "cache-control": "no-store",
}


class _TooLargeError(Exception):
    """More came than may."""


class Guard:
    """ASGI middleware that refuses strangers and floods.

    Parameters
    ----------
    app : ASGI application
    hosts : collection of str
        Names, without a port, by which this server may be called. A page of another site that has its name
        point here (DNS rebinding) sends its own.
    most_bytes : int
        The longest body.
    """

    def __init__(self, app: ASGIApp, hosts: Collection[str], most_bytes: int) -> None:
        self.app, self.hosts, self.most_bytes = app, {host.lower() for host in hosts}, most_bytes

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass a request on, or answer it here."""
        if scope["type"] != "http":
            await self.app(scope, receive, send)
            return
        headers = {
            name.decode("latin-1").lower(): value.decode("latin-1") for name, value in scope["headers"]
        }
        flooded = False

        async def answer(message: Message) -> None:
            if message["type"] == "http.response.start":
                own = {name.lower() for name, _ in message["headers"]}
                message["headers"] = [
                    *message["headers"],
                    *((k.encode(), v.encode()) for k, v in HEADERS.items() if k.encode() not in own),
                ]
            await send(message)

        if refusal := self._refusal(scope["method"], headers):
            await _refuse(answer, 403, "forbidden", refusal)
            return
        length = headers.get("content-length", "0")
        if length.isdigit() and int(length) > self.most_bytes:
            await _refuse(answer, 413, "too_large", self._too_large())
            return
        received = 0

        async def counted() -> Message:
            nonlocal received, flooded
            message = await receive()
            if message["type"] == "http.request":
                received += len(message.get("body", b""))
                if received > self.most_bytes and not flooded:
                    flooded = True
                    await _refuse(answer, 413, "too_large", self._too_large())
                    raise _TooLargeError
            return message

        async def unless_flooded(message: Message) -> None:
            if not flooded:
                await answer(message)

        with suppress(_TooLargeError):
            await self.app(scope, counted, unless_flooded)

    def _too_large(self) -> str:
        return f"A file may have {self.most_bytes // 1_000_000} MB at most."

    def _refusal(self, method: str, headers: dict[str, str]) -> str | None:
        """Return why a request is not for us, if it is not."""
        host = urlsplit(f"//{headers.get('host', '')}").hostname
        if host not in self.hosts:
            return "This server does not go by that name."
        if headers.get("sec-fetch-site", "none") not in ("same-origin", "none"):
            return "Another site may not ask here."
        origin = headers.get("origin")
        if method not in ("GET", "HEAD") and origin and urlsplit(origin).netloc != headers.get("host"):
            return "Another site may not ask here."
        return None


async def _refuse(send: Send, status: int, code: str, message: str) -> None:
    body = json.dumps({"error": {"code": code, "message": message}}).encode()
    headers = [(b"content-type", b"application/json"), (b"content-length", str(len(body)).encode())]
    await send({"type": "http.response.start", "status": status, "headers": headers})
    await send({"type": "http.response.body", "body": body})
