"""The studio as an ASGI application, and the server that runs it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from importlib import resources
from socket import socket

import uvicorn
from fastapi import FastAPI
from fastapi.responses import FileResponse
from fastapi.staticfiles import StaticFiles
from starlette.types import ASGIApp

from relit._version import VERSION
from relit.studio import api
from relit.studio.failures import answer_failures
from relit.studio.gallery import gallery
from relit.studio.guard import Guard
from relit.studio.intake import Intake
from relit.studio.limits import PERSONAL as PERSONAL
from relit.studio.limits import Limits
from relit.studio.sessions import Sessions
from relit.studio.work import Work

#: Names by which a browser on this machine calls it.
LOCAL = ("127.0.0.1", "localhost", "::1")


def create_app(
    *,
    hosts: Sequence[str] = LOCAL,
    page: bool = True,
    limits: Limits = Limits(),
    sessions: Sessions | None = None,
) -> ASGIApp:
    """Return the application.

    Parameters
    ----------
    hosts : sequence of str
        Names, without a port, that it may be called by.
    page : bool
        Whether it shows the page, or is the API alone.
    limits : Limits
        What its clients may take.
    sessions : Sessions, optional
        Where photos are kept; by default a new store.

    Returns
    -------
    ASGI application
    """
    app = FastAPI(
        title="relit studio",
        version=VERSION,
        description="Carry the light of one face photo to another.",
        docs_url=None,  # their pages load scripts from elsewhere
        redoc_url=None,
        openapi_url="/api/v1/openapi.json",
        generate_unique_id_function=lambda route: route.name,
    )
    app.state.sessions = Sessions(limits) if sessions is None else sessions
    app.state.limits = limits
    app.state.work = Work(limits)
    app.include_router(api.api)
    app.include_router(api.of_session)
    app.include_router(gallery)
    answer_failures(app)
    if page:
        static = str(resources.files("relit.studio") / "static")
        app.mount("/static", StaticFiles(directory=static), name="static")

        @app.get("/", include_in_schema=False)
        def index() -> FileResponse:
            return FileResponse(f"{static}/index.html", media_type="text/html")

    return Guard(Intake(app, limits), hosts)


class Server(uvicorn.Server):
    """A server that tells `ready` the address of the page once it can be opened; port 0 is any that is free.

    `run` returns when the process is interrupted, or `should_exit` is set.
    """

    def __init__(self, app: ASGIApp, host: str, port: int, ready: Callable[[str], None]) -> None:
        settings = {"log_level": "warning", "server_header": False, "lifespan": "off"}
        super().__init__(uvicorn.Config(app, host, port, **settings))  # type: ignore[arg-type]
        self._ready = ready

    async def startup(self, sockets: list[socket] | None = None) -> None:
        """Begin to listen."""
        await super().startup(sockets)
        if self.started:
            host, port = self.servers[0].sockets[0].getsockname()[:2]
            name = {"0.0.0.0": "127.0.0.1", "::": "[::1]", "::1": "[::1]"}.get(host, host)
            self._ready(f"http://{name}:{port}/")
