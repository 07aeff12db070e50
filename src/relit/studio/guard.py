"""What every request has to pass: who may ask, and what may be done with the answer."""

from __future__ import annotations

from collections.abc import Collection
from urllib.parse import urlsplit

from starlette.datastructures import Headers, MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from relit.studio.failures import refusal

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
    """ASGI middleware that refuses other sites, and says how browsers may use the answers.

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

        async def answer(message: Message) -> None:
            if message["type"] == "http.response.start":
                headers = MutableHeaders(scope=message)
                for name, value in HEADERS.items():
                    headers.setdefault(name, value)
            await send(message)

        reason = self._refusal(scope["method"], Headers(scope=scope))
        app = refusal(403, "forbidden", reason) if reason else self.app
        await app(scope, receive, answer)

    def _refusal(self, method: str, headers: Headers) -> str | None:
        """Return why a request is refused, if it is."""
        host, origin = headers.get("host", ""), headers.get("origin")
        try:
            name = urlsplit(f"//{host}").hostname
        except ValueError:  # half a pair of brackets
            name = None
        if name not in self.hosts:
            return "This server does not go by that name."
        foreign = origin and origin not in (f"http://{host}", f"https://{host}")
        same_site = headers.get("sec-fetch-site", "none") in ("same-origin", "none")
        if not same_site or (foreign and method not in ("GET", "HEAD")):
            return "Another site may not ask here."
        return None
