"""The token that a server for others asks for."""

from __future__ import annotations

import re
import secrets

from starlette.datastructures import Headers
from starlette.types import ASGIApp, Receive, Scope, Send

from relit.errors import OptionError
from relit.studio.failures import refusal

#: Answers whether the server is up, to anyone.
HEALTH = "/healthz"
#: What a token may consist of (RFC 6750, b64token), and how few characters none can guess over a network.
_TOKEN = re.compile(r"[A-Za-z0-9._~+/-]+=*")
_SHORTEST = 16


def new_token() -> str:
    """Return a token of 192 random bits."""
    return secrets.token_urlsafe(24)


def checked(token: str) -> str:
    """Return a token that someone chose.

    Raises
    ------
    OptionError
        If it is short, or cannot stand in a header. The message does not hold it.

    Examples
    --------
    >>> checked("correct-horse-battery")
    'correct-horse-battery'
    """
    if len(token) < _SHORTEST or not _TOKEN.fullmatch(token):
        wanted = f"token: expected {_SHORTEST} characters or more, of A-Z a-z 0-9 . _ ~ + / -"
        raise OptionError(
            f"{wanted}, got {len(token)}{'' if len(token) < _SHORTEST else ' with others among them'}"
            "; leave it out, and one is made where others may come in"
        )
    return token


class Access:
    """ASGI middleware that asks for a token wherever there is something to be had.

    The page itself, and whether the server is up, are for anyone: the page asks a person for the token.

    Parameters
    ----------
    app : ASGI application
    token : str
    """

    def __init__(self, app: ASGIApp, token: str) -> None:
        self.app, self._token = app, token.encode()

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass a request on, or answer it here."""
        if scope["type"] != "http" or _is_open(scope["path"]):
            await self.app(scope, receive, send)
            return
        kind, _, given = Headers(scope=scope).get("authorization", "").partition(" ")
        # Whatever came is compared in the same time; latin-1 is how headers are read.
        fits = secrets.compare_digest(given.strip().encode("latin-1", "replace"), self._token)
        if kind.lower() == "bearer" and fits:
            await self.app(scope, receive, send)
            return
        wrong = kind.lower() == "bearer"
        message = (
            "This is not the token of this server; it was given, or is printed, where the server was started."
            if wrong
            else "This server asks for its token; send it in a header, 'Authorization: Bearer TOKEN'."
        )
        challenge = 'Bearer realm="relit"' + (', error="invalid_token"' if wrong else "")
        answer = refusal(401, "unauthorized", message, {"WWW-Authenticate": challenge})
        await answer(scope, receive, send)


def _is_open(path: str) -> bool:
    return path in ("/", HEALTH) or path.startswith("/static/")
