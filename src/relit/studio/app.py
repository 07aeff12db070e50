"""The studio as an ASGI application."""

from __future__ import annotations

from collections.abc import Sequence
from importlib import resources

from fastapi import Depends, FastAPI, Response
from fastapi.responses import FileResponse
from fastapi.security import HTTPBearer
from fastapi.staticfiles import StaticFiles
from starlette.types import ASGIApp

from relit._version import VERSION
from relit.studio import api
from relit.studio.access import HEALTH, Access
from relit.studio.failures import answer_failures
from relit.studio.gallery import gallery
from relit.studio.guard import Guard
from relit.studio.intake import Intake
from relit.studio.limits import PERSONAL as PERSONAL
from relit.studio.limits import Limits
from relit.studio.metrics import MEDIA_TYPE, Metrics
from relit.studio.schema import described
from relit.studio.sessions import EXPIRES_AT_HOME as EXPIRES_AT_HOME
from relit.studio.sessions import Sessions
from relit.studio.watch import Watch
from relit.studio.work import Work

#: Names by which a browser on this machine calls it.
LOCAL = ("127.0.0.1", "localhost", "::1")
#: How monitors and balancers ask whether it is up.
_LOOKS = ["GET", "HEAD"]


def create_app(
    *,
    hosts: Sequence[str] = LOCAL,
    token: str | None = None,
    page: bool = True,
    limits: Limits = Limits(),
    sessions: Sessions | None = None,
    metrics: Metrics | None = None,
) -> ASGIApp:
    """Return the application.

    Parameters
    ----------
    hosts : sequence of str
        Names, without a port, that it may be called by, besides the address that it is reached at.
    token : str, optional
        What clients have to send; by default nothing.
    page : bool
        Whether it shows the page, or is the API alone.
    limits : Limits
        What its clients may take.
    sessions : Sessions, optional
        Where photos are kept; by default a new store.
    metrics : Metrics, optional
        What it is counted in; by default new ones.

    Returns
    -------
    ASGI application
    """
    sessions = Sessions(limits) if sessions is None else sessions
    metrics = metrics or Metrics()
    app = FastAPI(
        title="relit studio",
        version=VERSION,
        description="Carry the light of one face photo to another.",
        docs_url=None,  # their pages load scripts from elsewhere
        redoc_url=None,
        openapi_url="/api/v1/openapi.json",
        generate_unique_id_function=lambda route: route.name,
        # For the schema: what asks for it comes before all routes, and their bodies.
        dependencies=[Depends(HTTPBearer(auto_error=False))] if token else [],
    )
    app.state.sessions, app.state.limits, app.state.metrics = sessions, limits, metrics
    app.state.work = Work(limits)
    routers = (api.api, api.of_session, gallery)
    for router in routers:
        app.include_router(router, responses=described(401) if token else None)
    answer_failures(app)
    _tell_state(app)
    if page:
        static = str(resources.files("relit.studio") / "static")
        app.mount("/static", StaticFiles(directory=static), name="static")

        @app.api_route("/", methods=_LOOKS, include_in_schema=False)
        def index() -> FileResponse:
            return FileResponse(f"{static}/index.html", media_type="text/html")

    taken = Intake(app, limits)
    routes = [route for holder in (app.router, *routers) for route in holder.routes]
    return Watch(Guard(Access(taken, token) if token else taken, hosts), metrics, routes)


def _tell_state(app: FastAPI) -> None:
    """Have it say that it is up, and what it has counted: both at once, whatever the threads are at."""
    sessions, metrics = app.state.sessions, app.state.metrics
    metrics.gauge("relit_sessions", "Sessions that there are.", lambda: len(sessions))
    metrics.gauge("relit_session_bytes", "Bytes that their photos and previews hold.", lambda: sessions.size)
    work: Work = app.state.work
    metrics.gauge(
        "relit_computations_waiting", "Computations that wait for their turn.", lambda: work.waiting
    )
    metrics.gauge("relit_computations_running", "Computations that run.", lambda: work.running)

    @app.api_route(HEALTH, methods=_LOOKS, include_in_schema=False)
    async def health() -> dict[str, str]:
        return {"status": "ok"}

    @app.get("/metrics", include_in_schema=False)
    async def count() -> Response:
        return Response(metrics.text(), media_type=MEDIA_TYPE)
