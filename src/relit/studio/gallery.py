"""References at hand: photos of a session beside its pair, each by a name that the client chooses."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Depends, Path, Request, Response

from relit.settings_file import as_points
from relit.studio import models
from relit.studio.api import Side, Store, ThisSession, place
from relit.studio.computed import posted, shown
from relit.studio.schema import FILE, described, sends
from relit.studio.session import Portrait

Name = Annotated[str, Path(alias="id", pattern=models.REFERENCE_ID)]

gallery = APIRouter(
    prefix="/api/v1/sessions/{session}/references", responses=described(403, 404, 408, 413, 422, 429, 503)
)


async def _portrait(session: ThisSession, name: Name) -> Portrait:
    return session.in_gallery(name)


ThisPortrait = Annotated[Portrait, Depends(_portrait)]


@gallery.get("")
def list_references(session: ThisSession) -> dict[str, models.PhotoFacts]:
    """Describe all references at hand."""
    return {name: models.PhotoFacts.of(one, "reference") for name, one in session.gallery.items()}


@gallery.put("/{id}", openapi_extra=FILE, responses=described(400, 409))
async def put_reference(
    request: Request, store: Store, session: ThisSession, name: Name
) -> models.PhotoFacts:
    """Take a reference, as the body, and find its face; another one of this name is forgotten."""
    portrait = await posted(
        request, session, "reference", lambda found: store.keep_in_gallery(session, name, found)
    )
    return models.PhotoFacts.of(portrait, "reference")


@gallery.delete("/{id}", status_code=204, response_model=None)
def delete_reference(store: Store, session: ThisSession, name: Name) -> None:
    """Forget a reference."""
    store.drop_from_gallery(session, name)


@gallery.get("/{id}/photo", **sends("image/jpeg", "The photo.", {}))
async def get_reference(
    request: Request, session: ThisSession, portrait: ThisPortrait, side: Side = 1280
) -> Response:
    """Return a reference as a JPEG in sRGB."""
    return await shown(request, session, portrait, side)


@gallery.put("/{id}/landmarks", responses=described(400))
def put_reference_landmarks(portrait: ThisPortrait, points: models.Points) -> models.Marks | None:
    """Place the landmarks of a reference."""
    return place(portrait, "reference", as_points(points.model_dump(), "reference_landmarks"))


@gallery.post("/{id}/choose", responses=described(409))
def choose(store: Store, session: ThisSession, portrait: ThisPortrait) -> models.Seats:
    """Make a reference the session's own; it stays at hand."""
    store.keep(session, "reference", portrait)
    return models.Seats.of(session.portraits)
