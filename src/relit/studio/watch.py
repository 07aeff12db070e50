"""What is noted of every request: counters, a line in the log, and nothing of what it was about."""

from __future__ import annotations

import asyncio
import logging
import time
from collections.abc import Sequence

from starlette.requests import ClientDisconnect
from starlette.routing import BaseRoute, Route
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from relit.studio.failures import refusal
from relit.studio.metrics import Metrics

#: The access log: it says nothing unless someone listens to it.
LOG = logging.getLogger("relit.studio.access")

_METHODS = {"GET", "HEAD", "POST", "PUT", "DELETE", "OPTIONS", "PATCH"}
#: The status of a request whose client hung up, by nginx's custom.
_HUNG_UP = 499


class Watch:
    """ASGI middleware that notes what was asked for, by the pattern of its path, and how it was answered.

    A client that hangs up is no failure of the server, and has no traceback.

    Parameters
    ----------
    app : ASGI application
    metrics : Metrics
    routes : sequence of BaseRoute
        Those of the application, for what is refused before it has found its own.
    """

    def __init__(self, app: ASGIApp, metrics: Metrics, routes: Sequence[BaseRoute]) -> None:
        self.app, self.metrics = app, metrics
        self._patterns = [(route.path_regex, route.path) for route in routes if isinstance(route, Route)]

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass a request on, and note it."""
        if scope["type"] != "http":
            await self.app(scope, receive, send)
            return
        begun, status = time.monotonic(), 0

        async def noted(message: Message) -> None:
            nonlocal status
            if message["type"] == "http.response.start":
                status = message["status"]
            await send(message)

        try:
            await self.app(scope, receive, noted)
        except ClientDisconnect:
            status = _HUNG_UP  # not 500, which the framework tried to say
        except asyncio.CancelledError:  # the server ends, and has waited for this long enough
            if status:
                raise
            answer = refusal(503, "busy", "The server is going down; ask again later.", {"Retry-After": "10"})
            await answer(scope, receive, noted)
        except Exception:
            status = 500
            raise
        finally:
            self._note(scope, status or _HUNG_UP, time.monotonic() - begun)

    def _note(self, scope: Scope, status: int, seconds: float) -> None:
        # The pattern, as "/sessions/{session}": the path has a token, the query what the client chooses.
        route = getattr(scope.get("route"), "path", None) or self._pattern_of(scope["path"])
        method = scope["method"] if scope["method"] in _METHODS else "other"
        self.metrics.answered(method, route, status, seconds)
        LOG.info("%s %s %d %.3f s", method, route, status, seconds)

    def _pattern_of(self, path: str) -> str:
        if path.startswith("/static/"):
            return "static"
        return next((pattern for regex, pattern in self._patterns if regex.match(path)), "none")
