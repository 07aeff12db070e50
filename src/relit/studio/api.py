"""The HTTP API, version 1: photos and landmarks in, previews and files out."""

from __future__ import annotations

import io
import json
from collections.abc import AsyncIterator
from typing import Annotated

from fastapi import APIRouter, Depends, Path, Query, Request, Response
from fastapi.concurrency import run_in_threadpool

from relit._version import VERSION
from relit.errors import LandmarkError
from relit.face.detect import detect_landmarks
from relit.face.landmark_files import FORMATS as LANDMARK_FORMATS
from relit.face.landmark_files import landmarks_as_bytes, landmarks_from
from relit.face.landmarks import Landmarks, check_inside
from relit.photo.samples import sample
from relit.settings.options import TransferOptions
from relit.settings_file import as_points
from relit.studio import models, needs
from relit.studio.clients import client_of
from relit.studio.computed import computed, find_face, posted, shown
from relit.studio.lights import light_headers
from relit.studio.limits import Limits
from relit.studio.pictures import (
    THUMBNAIL,
    exported,
    exported_at_hand,
    jpeg,
    lost_in_export,
    memory_of_export,
    memory_of_part,
    memory_of_preview,
    part_at,
    rendered,
    views_of,
    window_of,
)
from relit.studio.schema import EXPORTED, FILE, NAMED, VIEW_HEADERS, described, links, sends
from relit.studio.session import ROLES, Portrait, Session, StudioError
from relit.studio.sessions import Sessions
from relit.studio.work import GoOn

#: Width, height, bytes a pixel and bytes of the larger sample, rounded up.
_SAMPLE = (1000, 1200, 3, 1_000_000)

Token = Annotated[str, Path(pattern="^[A-Za-z0-9_-]{1,100}$")]
Side = Annotated[int, Query(ge=64, le=4096)]
Suffix = Annotated[models.Suffix, Query(alias="format")]
Place = Annotated[float, Query(ge=0, le=1e6)]


async def _store(request: Request) -> Sessions:
    return request.app.state.sessions  # type: ignore[no-any-return]


Store = Annotated[Sessions, Depends(_store)]


async def _session(store: Store, session: Token) -> AsyncIterator[Session]:
    with store.using(session) as found:
        yield found


ThisSession = Annotated[Session, Depends(_session)]


async def _portrait(session: ThisSession, role: models.Role) -> Portrait:
    return session.portrait(role)


ThisPortrait = Annotated[Portrait, Depends(_portrait)]

api = APIRouter(prefix="/api/v1", responses=described(403, 408, 413, 429, 503))
#: Routes within a session.
of_session = APIRouter(
    prefix="/api/v1/sessions/{session}", responses=described(403, 404, 408, 413, 422, 429, 503)
)


@api.get("/options")
def options(request: Request) -> models.Offer:
    """Describe every option of a transfer."""
    limits: Limits = request.app.state.limits
    return models.Offer(
        options=models.OPTIONS,
        landmark_formats=list(LANDMARK_FORMATS),
        lights=models.LIGHTS,
        limits=models.Limits(bytes=limits.bytes, pixels=limits.pixels),
        version=VERSION,
    )


_THEN = links(201, "$response.body#/session", "about", "samples", "put_photo", "end")


@api.post("/sessions", status_code=201, responses=_THEN)
def begin(request: Request, store: Store) -> models.Begun:
    """Begin a session."""
    return models.Begun(session=store.begin(client=client_of(request.scope)), expires_in=store.expires)


@api.delete("/sessions/{session}", status_code=204, response_model=None, responses=described(422))
def end(store: Store, session: Token) -> None:
    """End a session and forget its photos."""
    store.end(session)


@of_session.get("")
def about(session: ThisSession) -> models.Seats:
    """Describe the photos of a session, null where there is none."""
    return models.Seats.of(session.portraits)


@of_session.post("/samples", responses=links(200, "$request.path.session", "render", "export", "swap"))
async def samples(request: Request, store: Store, session: ThisSession) -> models.Pair:
    """Load the two sample photos."""

    def load(go_on: GoOn) -> None:
        for role in ROLES:
            data = io.BytesIO(sample(role).read_bytes())
            store.keep(session, role, find_face(data, role, request.app.state.limits.pixels, go_on))
        store.keep_in_gallery(session, "sample", session.portrait("reference"))

    await computed(request, session, load, needs.of_reading(*_SAMPLE))
    return models.Pair.of(session.portraits)


@of_session.put("/photos/{role}", openapi_extra=FILE, responses=described(400, 409))
async def put_photo(
    request: Request, store: Store, session: ThisSession, role: models.Role
) -> models.PhotoFacts:
    """Take a photo, as the body, and find its face."""
    portrait = await posted(request, session, role, lambda found: store.keep(session, role, found))
    return models.PhotoFacts.of(portrait, role)


@of_session.get("/photos/{role}", **sends("image/jpeg", "The photo.", {}))
async def get_photo(
    request: Request, session: ThisSession, portrait: ThisPortrait, side: Side = 1280
) -> Response:
    """Return a photo as a JPEG in sRGB."""
    return await shown(request, session, portrait, side)


@of_session.get("/landmarks/{role}")
def get_landmarks(portrait: ThisPortrait) -> models.Marks | None:
    """Return the landmarks of a photo, null where there are none."""
    return models.Marks.of(portrait)


@of_session.put("/landmarks/{role}", responses=described(400))
def put_landmarks(portrait: ThisPortrait, role: models.Role, points: models.Points) -> models.Marks | None:
    """Place the landmarks of a photo."""
    return place(portrait, role, as_points(points.model_dump(), f"{role}_landmarks"))


def place(portrait: Portrait, role: str, landmarks: Landmarks) -> models.Marks | None:
    """Place the landmarks of a photo, and describe them."""
    check_inside(landmarks, portrait.photo.pixels.shape, f"{role}_landmarks")
    # At once: a hand that drags a point does not wait for the preview that it makes stale.
    portrait.landmarks, portrait.detected = landmarks, False
    return models.Marks.of(portrait)


@of_session.post("/landmarks/{role}/detect", responses=described(409))
async def detect(
    request: Request, session: ThisSession, portrait: ThisPortrait, role: models.Role
) -> models.Marks | None:
    """Detect the landmarks of a photo again."""

    def find(_: GoOn) -> None:
        portrait.landmarks, portrait.detected = detect_landmarks(portrait.photo.pixels, name=role), True

    await computed(request, session, find, needs.of_detecting(portrait.photo))
    return models.Marks.of(portrait)


@of_session.get("/part", responses=described(400, 409))
async def part(request: Request, session: ThisSession, x: Place, y: Place) -> models.Part:
    """Tell which part of the target's face is at a place of the photo, in px."""
    portrait = session.portrait("target", needed=True)
    memory = memory_of_part(portrait)
    return models.Part(part=await computed(request, session, lambda _: part_at(portrait, x, y), memory))


@of_session.get("/landmarks/{role}/file", **sends("application/octet-stream", "The file.", NAMED, 409))
def get_file(portrait: ThisPortrait, role: models.Role, suffix: Suffix) -> Response:
    """Return the landmarks of a photo as a file."""
    name = f"{role}{suffix}"
    data = landmarks_as_bytes(name, portrait.face(role))
    return _attached(data, name, "application/octet-stream")


@of_session.put("/landmarks/{role}/file", openapi_extra=FILE, responses=described(400, 409))
async def put_file(
    request: Request, session: ThisSession, portrait: ThisPortrait, role: models.Role, suffix: Suffix
) -> models.Marks | None:
    """Take the landmarks of a photo from a file, the body."""
    name, data = f"{role}{suffix}", await request.body()
    try:
        landmarks = await computed(
            request, session, lambda _: landmarks_from(data, name), needs.of_parsing(len(data))
        )
    except LandmarkError as error:
        raise LandmarkError(str(error).replace(name, "the file")) from None
    return place(portrait, role, landmarks)


@of_session.post("/swap", responses=described(409))
def swap(store: Store, session: ThisSession) -> models.Swapped:
    """Swap the roles of the two photos; the former target is a reference at hand then."""
    name = store.swap(session)
    return models.Swapped.of(session.portraits, id=name)


@of_session.post("/render", **sends("image/jpeg", "The view.", VIEW_HEADERS, 400, 409))
async def render(request: Request, session: ThisSession, wanted: models.RenderRequest) -> Response:
    """Return a preview as a JPEG; a request that a newer one has overtaken is stale.

    Thumbnails, of 256 px at most, are no part of that sequence. With `reference`, that one of those at hand
    gives the light.
    """
    settings = await run_in_threadpool(TransferOptions().changed, **wanted.options)
    thumbnail = wanted.side <= THUMBNAIL
    if not thumbnail:
        session.newest = max(session.newest, wanted.sequence)

    def still_wanted() -> None:
        if not thumbnail and wanted.sequence < session.newest:
            raise StudioError(409, "stale", "A newer preview was asked for.")

    def view(go_on: GoOn) -> Response:
        result, factor, alpha = rendered(session, settings, wanted, go_on)
        views = views_of(result)
        if wanted.view not in views:
            raise StudioError(400, "bad_option", f"method {settings.method} has no view {wanted.view}.")
        headers = {
            "X-Relit-Window": ",".join(f"{share:.6f}" for share in window_of(result, wanted.view)),
            "X-Relit-Views": ",".join(views),
            "X-Relit-Lambda-Px": f"{result.view.factor * factor / result.lam:.2f}",
            "X-Relit-Seconds": f"{sum(result.seconds.values()):.3f}",
        } | light_headers(result)
        seen = jpeg(views[wanted.view](), alpha if wanted.view == "result" else None)
        return Response(seen, media_type="image/jpeg", headers=headers)

    still_wanted()
    return await computed(request, session, view, memory_of_preview(session, settings, wanted), still_wanted)


@of_session.post("/export", **sends("application/zip", "The files.", EXPORTED, 400, 409))
async def export(request: Request, session: ThisSession, wanted: models.ExportRequest) -> Response:
    """Return the relit photo at full resolution, its landmarks and settings, in a ZIP file.

    With the name of a photo at hand as `target`, that one is relit, and its file alone is returned. With
    `reference`, that one of those at hand gives the light.
    """
    settings = await run_in_threadpool(TransferOptions().changed, **wanted.options)
    target, suffix = wanted.target, wanted.format

    def files(go_on: GoOn) -> Response:
        if target is None:
            made = _attached(exported(session, settings, wanted, go_on), "relit.zip", "application/zip")
        else:
            data = exported_at_hand(session, settings, wanted, go_on)
            made = _attached(data, f"relit{suffix}", "application/octet-stream")
        made.headers["X-Relit-Not-Kept"] = json.dumps(lost_in_export(session, suffix, target))
        return made

    memory = memory_of_export(session, settings, wanted)
    return await computed(request, session, files, memory)


def _attached(data: bytes, name: str, media_type: str) -> Response:
    headers = {"Content-Disposition": f'attachment; filename="{name}"'}
    return Response(data, media_type=media_type, headers=headers)
