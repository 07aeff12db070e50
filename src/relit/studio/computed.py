"""Requests that take computing: they wait for their turn, and end with whoever asked."""

from __future__ import annotations

import io
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from typing import TypeVar

from anyio import CapacityLimiter
from anyio.to_thread import run_sync
from fastapi import Request, Response

from relit.photo.pixels import check_pixels
from relit.photo.reading import claimed_size, read_image
from relit.studio import needs
from relit.studio.clients import client_of
from relit.studio.pictures import jpeg, preview_of
from relit.studio.session import Portrait, Session
from relit.studio.sessions import Sessions
from relit.studio.work import GoOn, Work

#: Photos whose heads are looked at, at once.
_HEADS = CapacityLimiter(2)

Made = TypeVar("Made")


async def computed(
    request: Request,
    session: Session,
    task: Callable[[GoOn], Made],
    memory: int,
    wanted: GoOn = lambda: None,
) -> Made:
    """Return what a task returns, once it has had its turn; see `Work.do`."""
    work: Work = request.app.state.work
    store: Sessions = request.app.state.sessions

    def alone(go_on: GoOn) -> Made:
        with store.computing(session):
            return task(go_on)

    return await work.do(
        alone,
        session=session,
        client=client_of(request.scope),
        wanted=wanted,
        memory=memory,
        gone=_hung_up(request),
    )


async def _hung_up(request: Request) -> None:
    """Return once the client has."""
    with suppress(Exception):  # one that is refused meanwhile may as well have
        while (await request.receive())["type"] != "http.disconnect":
            pass


async def posted(request: Request, session: Session, role: str, keep: Callable[[Portrait], None]) -> Portrait:
    """Keep the photo that is the body of a request, with its face, and return it."""
    pixels = request.app.state.limits.pixels
    # Not request.body(), which holds it twice for a while; and freed even where a traceback lives on.
    with io.BytesIO() as data:
        async for part in request.stream():
            data.write(part)
        length = data.tell()
        data.seek(0)
        size = await run_sync(partial(claimed_size, data, max_pixels=pixels), limiter=_HEADS)
        data.seek(0)

        def find(go_on: GoOn) -> Portrait:
            portrait = find_face(data, role, pixels, go_on)
            go_on()  # whoever has called it off meanwhile has another photo in mind
            keep(portrait)
            return portrait

        return await computed(request, session, find, needs.of_reading(*size, length))


def find_face(data: io.BytesIO, role: str, most_pixels: int, go_on: GoOn) -> Portrait:
    """Return a photo of a role, with its face if one is found."""
    photo = read_image(data, max_pixels=most_pixels)
    check_pixels(photo.pixels, role)
    go_on()
    return Portrait.of(photo, role)


async def shown(request: Request, session: Session, portrait: Portrait, side: int) -> Response:
    """Answer with a photo of a session, at most so many px long."""
    memory = needs.of_showing(side, side)

    def picture(_: GoOn) -> bytes:
        small = preview_of(portrait, side)
        return jpeg(small.pixels, small.alpha)

    data = await computed(request, session, picture, memory)
    return Response(data, media_type="image/jpeg")
