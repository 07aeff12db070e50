"""The HTTP API, version 1: photos and landmarks in, previews and files out."""

from __future__ import annotations

import io
from dataclasses import fields
from typing import Annotated

import fastapi
from fastapi import APIRouter, Query, Request, Response
from fastapi.concurrency import run_in_threadpool

from relit._version import VERSION
from relit.face.detect import detect_landmarks
from relit.face.landmark_files import FORMATS as LANDMARK_FORMATS
from relit.face.landmark_files import landmarks_as_bytes
from relit.photo.samples import sample
from relit.results import TransferResult
from relit.settings.options import TransferOptions
from relit.settings_file import as_points
from relit.studio.exports import exported
from relit.studio.models import (
    Begun,
    ExportRequest,
    Limits,
    Marks,
    Offer,
    Option,
    Pair,
    PhotoFacts,
    Points,
    RenderRequest,
    Role,
    Seats,
    Suffix,
)
from relit.studio.pictures import jpeg, preview_of, rendered, views_of
from relit.studio.schema import FILE, VIEW_HEADERS, described, links, sent
from relit.studio.sessions import EXPIRES, ROLES, Sessions, StudioError
from relit.studio.work import place, place_from, take, worked

Token = Annotated[str, fastapi.Path(pattern="^[A-Za-z0-9_-]{1,100}$")]
Side = Annotated[int, Query(ge=64, le=4096)]


def routes(sessions: Sessions, most_pixels: int, most_bytes: int) -> APIRouter:
    """Return the API on a store of sessions."""
    api = APIRouter(prefix="/api/v1", responses=described(403, 408, 413, 429))

    @api.get("/options")
    def options() -> Offer:
        """Describe every option of a transfer."""
        return Offer(
            options=[Option.of(option) for option in fields(TransferOptions)],
            landmark_formats=list(LANDMARK_FORMATS),
            limits=Limits(bytes=most_bytes, pixels=most_pixels),
            version=VERSION,
        )

    @api.post(
        "/sessions",
        status_code=201,
        responses=links(201, "$response.body#/session", "about", "samples", "put_photo", "end"),
    )
    def begin() -> Begun:
        """Begin a session."""
        return Begun(session=sessions.begin(), expires_in=EXPIRES)

    @api.delete("/sessions/{session}", status_code=204, responses=described(422))
    def end(session: Token) -> Response:
        """End a session and forget its photos."""
        sessions.end(session)
        return Response(status_code=204)

    @api.post(
        "/sessions/{session}/samples",
        responses=links(200, "$request.path.session", "render", "export", "swap") | described(404, 422),
    )
    def samples(session: Token) -> Pair:
        """Load the two sample photos."""
        one = sessions.get(session)
        target, reference = (
            take(sessions, one, role, io.BytesIO(sample(role).read_bytes()), most_pixels) for role in ROLES
        )
        return Pair(target=target, reference=reference)

    @api.put("/sessions/{session}/photos/{role}", openapi_extra=FILE, responses=described(400, 404, 422))
    async def put_photo(session: Token, role: Role, request: Request) -> PhotoFacts:
        """Take a photo, as the body, and find its face."""
        one = sessions.get(session)
        # Not request.body(), which holds it twice for a while; and freed even where a traceback lives on.
        with io.BytesIO() as data:
            async for part in request.stream():
                data.write(part)
            return await run_in_threadpool(take, sessions, one, role, data, most_pixels)

    @api.get("/sessions/{session}", responses=described(404, 422))
    def about(session: Token) -> Seats:
        """Describe the photos of a session, null where there is none."""
        sitters = sessions.get(session).sitters
        target, reference = (PhotoFacts.of(sitters[role]) if role in sitters else None for role in ROLES)
        return Seats(target=target, reference=reference)

    @api.get(
        "/sessions/{session}/photos/{role}",
        response_class=Response,
        responses=sent("image/jpeg", "The photo.") | described(404, 422),
    )
    def get_photo(session: Token, role: Role, side: Side = 1280) -> Response:
        """Return a photo as a JPEG in sRGB."""
        one = sessions.get(session)
        with one.work:
            picture = worked(preview_of, one.sitter(role), side)
        sessions.make_room(one)
        return Response(jpeg(picture.pixels), media_type="image/jpeg")

    @api.get("/sessions/{session}/landmarks/{role}", responses=described(404, 422))
    def get_landmarks(session: Token, role: Role) -> Marks | None:
        """Return the landmarks of a photo, null where there are none."""
        return Marks.of(sessions.get(session).sitter(role))

    @api.put("/sessions/{session}/landmarks/{role}", responses=described(400, 404, 422))
    def put_landmarks(session: Token, role: Role, points: Points) -> Marks | None:
        """Place the landmarks of a photo."""
        return place(sessions.get(session), role, as_points(points.model_dump(), f"{role}_landmarks"))

    @api.post("/sessions/{session}/landmarks/{role}/detect", responses=described(404, 409, 422))
    def detect(session: Token, role: Role) -> Marks | None:
        """Find the landmarks of a photo anew."""
        sitter = sessions.get(session).sitter(role)
        sitter.landmarks = worked(detect_landmarks, sitter.photo.pixels, name=role)
        sitter.detected = True
        return Marks.of(sitter)

    @api.get(
        "/sessions/{session}/landmarks/{role}/file",
        response_class=Response,
        responses=sent("application/octet-stream", "The file.", "Content-Disposition")
        | described(404, 409, 422),
    )
    def get_file(session: Token, role: Role, format: Suffix) -> Response:  # noqa: A002
        """Return the landmarks of a photo as a file."""
        one = sessions.get(session)
        one.sitter(role)
        _, landmarks = one.ready(role)
        name = f"{role}{format}"
        return _attached(landmarks_as_bytes(name, landmarks), name, "application/octet-stream")

    @api.put(
        "/sessions/{session}/landmarks/{role}/file",
        openapi_extra=FILE,
        responses=described(400, 404, 409, 422),
    )
    async def put_file(session: Token, role: Role, format: Suffix, request: Request) -> Marks | None:  # noqa: A002
        """Take the landmarks of a photo from a file, the body."""
        one = sessions.get(session)
        one.sitter(role)
        data = await request.body()
        return await run_in_threadpool(place_from, one, role, data, format)

    @api.post("/sessions/{session}/swap", responses=described(404, 409, 422))
    def swap(session: Token) -> Pair:
        """Swap the roles of the two photos."""
        one = sessions.get(session)
        with one.work:
            target, reference = (one.needed(role) for role in ROLES)
            one.sitters = {"target": reference, "reference": target}
        return Pair(target=PhotoFacts.of(reference), reference=PhotoFacts.of(target))

    @api.post(
        "/sessions/{session}/render",
        response_class=Response,
        responses=sent("image/jpeg", "The view.", *VIEW_HEADERS) | described(400, 404, 409, 422),
    )
    def render(session: Token, wanted: RenderRequest) -> Response:
        """Return a preview as a JPEG; a request that a newer one has overtaken is stale."""
        one = sessions.get(session)
        settings = TransferOptions().changed(**wanted.options)
        one.newest = max(one.newest, wanted.sequence)

        def go_on() -> None:
            if wanted.sequence < one.newest:
                raise StudioError(409, "stale", "A newer preview was asked for.")

        def newest() -> tuple[TransferResult, int]:
            go_on()
            with one.memo.open(go_on):
                return rendered(one, settings, wanted.side, quick=wanted.quick)

        with one.work:
            result, factor = worked(newest)
        sessions.make_room(one)
        views = views_of(result)
        if wanted.view not in views:
            raise StudioError(400, "bad_option", f"method {settings.method} has no view {wanted.view}.")
        height, width = result.target.shape[:2]
        rows, columns = result.window
        window = (columns.start, rows.start, columns.stop - columns.start, rows.stop - rows.start)
        if wanted.view in ("result", "difference"):
            window = (0, 0, width, height)
        parts = [part / whole for part, whole in zip(window, (width, height, width, height), strict=True)]
        headers = {
            "X-Relit-Window": ",".join(f"{part:.6f}" for part in parts),
            "X-Relit-Views": ",".join(views),
            "X-Relit-Lambda-Px": f"{result.view.factor * factor / result.lam:.2f}",
            "X-Relit-Seconds": f"{sum(result.seconds.values()):.3f}",
        }
        return Response(jpeg(views[wanted.view]), media_type="image/jpeg", headers=headers)

    @api.post(
        "/sessions/{session}/export",
        response_class=Response,
        responses=sent("application/zip", "The files.", "Content-Disposition")
        | described(400, 404, 409, 422),
    )
    def export(session: Token, wanted: ExportRequest) -> Response:
        """Return the relit photo at full resolution, its landmarks and settings, in a ZIP file."""
        one = sessions.get(session)
        settings = TransferOptions().changed(**wanted.options)
        with one.work:
            data = worked(exported, one, settings, wanted.format)
        return _attached(data, "relit.zip", "application/zip")

    return api


def _attached(data: bytes, name: str, media_type: str) -> Response:
    return Response(
        data, media_type=media_type, headers={"Content-Disposition": f'attachment; filename="{name}"'}
    )
