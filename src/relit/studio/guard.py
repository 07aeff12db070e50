"""What every request has to pass: who may ask, and what may be done with the answer."""

from __future__ import annotations

from typing import TYPE_CHECKING
from urllib.parse import urlsplit

from relit.studio.failures import refusal

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


class Guard:
    """ASGI middleware that refuses strangers, and says how browsers may use the answers.

    Parameters
    ----------
    app : ASGI application
    hosts : collection of str
        Names, without a port, by which this server may be called. A page of another site that has its name
        point here (DNS rebinding) sends its own.
    """

    def __init__(self, app: ASGIApp, hosts: Collection[str]) -> None:
        self.app, self.hosts = app, {host.lower() for host in hosts}

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass a request on, or answer it here."""
        if scope["type"] != "http":
            await self.app(scope, receive, send)
            return
        headers = {
            name.decode("latin-1").lower(): value.decode("latin-1") for name, value in scope["headers"]
        }

        async def answer(message: Message) -> None:
            if message["type"] == "http.response.start":
                own = {name.lower() for name, _ in message["headers"]}
                message["headers"] = [
                    *message["headers"],
                    *((k.encode(), v.encode()) for k, v in HEADERS.items() if k.encode() not in own),
                ]
            await send(message)

        reason = self._refusal(scope["method"], headers)
        app = refusal(403, "forbidden", reason) if reason else self.app
        await app(scope, receive, answer)

    def _refusal(self, method: str, headers: dict[str, str]) -> str | None:
        """Return why a request is not for us, if it is not."""
        if _split(f"//{headers.get('host', '')}")[0] not in self.hosts:
            return "This server does not go by that name."
        if headers.get("sec-fetch-site", "none") not in ("same-origin", "none"):
            return "Another site may not ask here."
        origin = headers.get("origin")
        if method not in ("GET", "HEAD") and origin and _split(origin)[1] != headers.get("host"):
            return "Another site may not ask here."
        return None


def _split(address: str) -> tuple[str | None, str]:
    """Return the name and the name with its port; neither, where it is no address."""
    try:
        parts = urlsplit(address)
    except ValueError:  # half a pair of brackets
        return None, ""
    return parts.hostname, parts.netloc
