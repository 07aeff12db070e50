"""What every request has to pass: who may ask, and what may be done with the answer."""

from __future__ import annotations

from collections.abc import Collection
from urllib.parse import urlsplit

from fastapi.responses import JSONResponse
from starlette.datastructures import Headers, MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from relit.studio.access import HEALTH
from relit.studio.addresses import plain
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
    """ASGI middleware that refuses other sites and bodies of two lengths, and says how to use the answers.

    Parameters
    ----------
    app : ASGI application
    hosts : collection of str
        Names, without a port, by which this server may be called, besides the address that a connection came
        in at. A page of another site that has its name point here (DNS rebinding) sends its own.
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

        await (self._refusal(scope) or self.app)(scope, receive, answer)

    def _refusal(self, scope: Scope) -> JSONResponse | None:
        """Return the answer to a request that is refused."""
        headers = Headers(scope=scope)
        return _framing(headers, scope.get("http_version", "1.1")) or (
            # Who asks for a server's health has no name for it, and learns nothing else.
            None if scope["path"] == HEALTH else self._host(scope, headers) or _origin(headers)
        )

    def _host(self, scope: Scope, headers: Headers) -> JSONResponse | None:
        """Refuse a name that is another's."""
        try:
            name = urlsplit(f"//{headers.get('host', '')}").hostname or ""
        except ValueError:  # half a pair of brackets
            name = ""
        address = plain(name)
        if name in self.hosts or (address and address == plain((scope.get("server") or [""])[0] or "")):
            return None
        message = (
            f"This server does not go by the name {name!r}, and answers to none but its own, so that no "
            "other site's page can reach it by having its name point here. If it is its name, start it "
            f"with relit serve --allow-host {name or 'NAME'}."
        )
        return refusal(403, "forbidden", message)


def _origin(headers: Headers) -> JSONResponse | None:
    """Refuse a page of another site, whatever it asks: a browser names it with all that the page may read."""
    host, origin = headers.get("host", ""), headers.get("origin")
    foreign = origin and origin not in (f"http://{host}", f"https://{host}")
    same_site = headers.get("sec-fetch-site", "none") in ("same-origin", "none")
    if same_site and not foreign:
        return None
    message = (
        f"A page of another site ({origin or 'not named'}) may not ask here, so that none can use this "
        "server through a visitor's browser. Open the server's own page; a proxy has to pass Host on."
    )
    return refusal(403, "forbidden", message)


def _framing(headers: Headers, version: str) -> JSONResponse | None:
    """Refuse a body that a proxy may take to end elsewhere than this server does (RFC 9112, 6.1)."""
    if "transfer-encoding" not in headers or (version != "1.0" and "content-length" not in headers):
        return None
    message = (
        "A body has a Content-Length, or in HTTP/1.1 a Transfer-Encoding, and not both; send one of them."
    )
    return refusal(400, "bad_request", message, {"Connection": "close"})
