"""The HTTP API, version 1: photos and landmarks in, previews and files out."""

from __future__ import annotations

import io
import tempfile
import threading
import zipfile
from dataclasses import fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, TypeAlias

import numpy as np
from fastapi import APIRouter, Query, Request, Response
from fastapi.concurrency import run_in_threadpool
from pydantic import BaseModel, ConfigDict, Field

from relit._version import VERSION
from relit.detect import detect_landmarks
from relit.errors import FaceNotFoundError, ImageError, LandmarkError, OptionError
from relit.image import read_image, write_image
from relit.landmark_files import FORMATS as LANDMARK_FORMATS
from relit.landmark_files import read_landmarks, write_landmarks
from relit.landmarks import Landmarks, check_inside
from relit.options import TransferOptions
from relit.pixels import check_pixels
from relit.relighting import transfer
from relit.samples import sample
from relit.settings_file import Settings, as_json, as_points
from relit.studio.pictures import VIEWS, jpeg, preview_of, rendered, views_of
from relit.studio.sessions import EXPIRES, ROLES, Session, Sessions, Sitter, StudioError, seated

Role = Literal["target", "reference"]
if TYPE_CHECKING:
    Suffix: TypeAlias = str
    View: TypeAlias = str
else:  # what a request may say is in tables
    Suffix, View = Literal[tuple(LANDMARK_FORMATS)], Literal[tuple(VIEWS)]
Side = Annotated[int, Query(ge=64, le=4096)]

#: Computations at once, over all sessions: more would only be slower.
_AT_ONCE = threading.BoundedSemaphore(2)


class Problem(BaseModel):
    """What went wrong."""

    code: str
    message: str


class Failure(BaseModel):
    """Every answer of 4xx."""

    error: Problem


class Points(BaseModel):
    """Landmarks from a client."""

    model_config = ConfigDict(extra="forbid")
    scheme: str | None = None
    points: list[list[float]] = Field(max_length=2000)


class RenderRequest(BaseModel):
    """A preview."""

    model_config = ConfigDict(extra="forbid")
    options: dict[str, Any] = {}
    view: View = "result"
    side: int = Field(640, ge=64, le=2048)
    quick: bool = False
    sequence: int = Field(0, ge=0, le=2**53)


class ExportRequest(BaseModel):
    """Files at full resolution."""

    model_config = ConfigDict(extra="forbid")
    options: dict[str, Any] = {}
    format: Literal[".png", ".jpg", ".tif"] = ".png"


def routes(sessions: Sessions, most_pixels: int, most_bytes: int) -> APIRouter:
    """Return the API on a store of sessions."""
    failures: Any = {status: {"model": Failure} for status in (400, 403, 404, 409, 413, 422)}
    api = APIRouter(prefix="/api/v1", responses=failures)

    @api.get("/options")
    def options() -> dict[str, Any]:
        """Describe every option of a transfer."""
        return {
            "options": [_declared(option) for option in fields(TransferOptions)],
            "landmark_formats": list(LANDMARK_FORMATS),
            "limits": {"bytes": most_bytes, "pixels": most_pixels},
            "version": VERSION,
        }

    @api.post("/sessions", status_code=201)
    def begin() -> dict[str, Any]:
        """Begin a session."""
        return {"session": sessions.begin(), "expires_in": EXPIRES}

    @api.delete("/sessions/{session}", status_code=204)
    def end(session: str) -> Response:
        """End a session and forget its photos."""
        sessions.end(session)
        return Response(status_code=204)

    @api.post("/sessions/{session}/samples")
    def samples(session: str) -> dict[str, Any]:
        """Load the two sample photos."""
        one = sessions.get(session)
        return {role: _take(sessions, one, role, sample(role).read_bytes(), most_pixels) for role in ROLES}

    @api.put("/sessions/{session}/photos/{role}")
    async def put_photo(session: str, role: Role, request: Request) -> dict[str, Any]:
        """Take a photo, as the body, and find its face."""
        one = sessions.get(session)
        data = await request.body()
        return await run_in_threadpool(_take, sessions, one, role, data, most_pixels)

    @api.get("/sessions/{session}")
    def about(session: str) -> dict[str, Any]:
        """Describe the photos of a session, None where there is none."""
        sitters = sessions.get(session).sitters
        return {role: _about(sitters[role]) if role in sitters else None for role in ROLES}

    @api.get("/sessions/{session}/photos/{role}", response_class=Response)
    def get_photo(session: str, role: Role, side: Side = 1280) -> Response:
        """Return a photo as a JPEG in sRGB."""
        one = sessions.get(session)
        with one.work:
            picture = preview_of(one.sitter(role), side)
        return Response(jpeg(picture.pixels), media_type="image/jpeg")

    @api.get("/sessions/{session}/landmarks/{role}")
    def get_landmarks(session: str, role: Role) -> dict[str, Any] | None:
        """Return the landmarks of a photo."""
        return _shown(sessions.get(session).sitter(role))

    @api.put("/sessions/{session}/landmarks/{role}")
    def put_landmarks(session: str, role: Role, points: Points) -> dict[str, Any] | None:
        """Place the landmarks of a photo."""
        return _place(sessions.get(session), role, as_points(points.model_dump(), f"{role}_landmarks"))

    @api.post("/sessions/{session}/landmarks/{role}/detect")
    def detect(session: str, role: Role) -> dict[str, Any] | None:
        """Find the landmarks of a photo anew."""
        sitter = sessions.get(session).sitter(role)
        with _AT_ONCE:
            sitter.landmarks = detect_landmarks(sitter.photo.pixels, name=role)
        sitter.detected = True
        return _shown(sitter)

    @api.get("/sessions/{session}/landmarks/{role}/file", response_class=Response)
    def get_file(session: str, role: Role, format: Suffix) -> Response:  # noqa: A002
        """Return the landmarks of a photo as a file."""
        landmarks = sessions.get(session).sitter(role).landmarks
        if landmarks is None:
            raise StudioError(409, "no_face", f"The {role} has no landmarks yet; place them by hand.")
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder, f"{role}{format}")
            write_landmarks(path, landmarks)
            return _attached(path.read_bytes(), path.name, "application/octet-stream")

    @api.put("/sessions/{session}/landmarks/{role}/file")
    async def put_file(session: str, role: Role, format: Suffix, request: Request) -> dict[str, Any] | None:  # noqa: A002
        """Take the landmarks of a photo from a file, the body."""
        one = sessions.get(session)
        one.sitter(role)
        data = await request.body()
        return await run_in_threadpool(_place, one, role, None, data, format)

    @api.post("/sessions/{session}/swap")
    def swap(session: str) -> dict[str, Any]:
        """Swap the roles of the two photos."""
        one = sessions.get(session)
        with one.work:
            target, reference = (one.sitter(role) for role in ROLES)
            one.sitters = {"target": reference, "reference": target}
        return {role: _about(one.sitters[role]) for role in ROLES}

    @api.post("/sessions/{session}/render", response_class=Response)
    def render(session: str, wanted: RenderRequest) -> Response:
        """Return a preview as a JPEG; a request that a newer one has overtaken is stale."""
        one = sessions.get(session)
        settings = TransferOptions().changed(**wanted.options)
        one.newest = max(one.newest, wanted.sequence)

        def go_on() -> None:
            if wanted.sequence < one.newest:
                raise StudioError(409, "stale", "A newer preview was asked for.")

        with one.work, _AT_ONCE, sessions.memo_of(one).open(go_on):
            go_on()
            result, factor = rendered(one, settings, wanted.side, quick=wanted.quick)
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

    @api.post("/sessions/{session}/export", response_class=Response)
    def export(session: str, wanted: ExportRequest) -> Response:
        """Return the relit photo at full resolution, its landmarks and settings, in a ZIP file."""
        one = sessions.get(session)
        settings = TransferOptions().changed(**wanted.options)
        with one.work, _AT_ONCE:
            data = _exported(one, settings, wanted.format)
        return _attached(data, "relit.zip", "application/zip")

    return api


def _declared(option: Any) -> dict[str, Any]:
    known = option.metadata
    kind = "choice" if known["choices"] else "text" if known["text"] else "number"
    return {
        "name": option.name,
        "flag": known["flag"],
        "help": known["help"],
        "default": option.default,
        "kind": "switch" if isinstance(option.default, bool) else kind,
        **{key: known[key] for key in ("choices", "words", "at_least", "at_most", "above")},
    }


def _take(sessions: Sessions, session: Session, role: str, data: bytes, most_pixels: int) -> dict[str, Any]:
    with _AT_ONCE:
        photo = read_image(io.BytesIO(data), max_pixels=most_pixels)
        check_pixels(photo.pixels, role)
        sitter = seated(photo, role)
    sessions.keep(session, role, sitter)
    return _about(sitter)


def _place(
    session: Session, role: str, landmarks: Landmarks | None, data: bytes = b"", suffix: str = ""
) -> dict[str, Any] | None:
    sitter = session.sitter(role)
    if landmarks is None:
        with tempfile.TemporaryDirectory() as folder:
            # The name is ours: what a client calls a file never reaches the disk.
            path = Path(folder, f"{role}{suffix}")
            path.write_bytes(data)
            try:
                landmarks = read_landmarks(path)
            except LandmarkError as error:
                raise LandmarkError(str(error).replace(str(path), "the file")) from None
    check_inside(landmarks, sitter.photo.pixels.shape, f"{role}_landmarks")
    with session.work:
        sitter.landmarks, sitter.detected = landmarks, False
    return _shown(sitter)


def _exported(session: Session, settings: TransferOptions, suffix: str) -> bytes:
    """Return what ``relit transfer --config settings.json`` makes of the same photos, and what it takes."""
    target = session.sitter("target")
    lit_by = [] if settings.light is not None else [session.sitter("reference")]
    for role, sitter in zip(ROLES, (target, *lit_by), strict=False):
        if sitter.landmarks is None:
            raise StudioError(409, "no_face", f"The {role} has no landmarks yet; place them by hand.")
    result = transfer(
        target.photo,
        [sitter.photo for sitter in lit_by] or None,
        target_landmarks=target.landmarks,
        reference_landmarks=[sitter.landmarks for sitter in lit_by] or None,
        options=settings,
    )
    marks = {role: one.landmarks for role, one in zip(ROLES, (target, *lit_by), strict=False)}
    record = as_json(Settings(settings, **marks))
    packed = io.BytesIO()
    with tempfile.TemporaryDirectory() as folder, zipfile.ZipFile(packed, "w") as archive:
        names = [f"relit{suffix}"]
        like = replace(target.photo, alpha=None) if suffix == ".jpg" else target.photo
        write_image(Path(folder, names[0]), result.image, like=like)
        for role, landmarks in marks.items():
            names.append(f"{role}.json")
            if landmarks is not None:
                write_landmarks(Path(folder, names[-1]), landmarks)
        for name in names:
            archive.write(Path(folder, name), name)
        archive.writestr("settings.json", record)
    return packed.getvalue()


def _about(sitter: Sitter) -> dict[str, Any]:
    height, width = sitter.photo.pixels.shape[:2]
    return {
        "width": width,
        "height": height,
        "format": sitter.photo.format,
        "depth": str(sitter.photo.pixels.dtype),
        "grey": sitter.photo.pixels.ndim == 2,
        "landmarks": _shown(sitter),
        "message": sitter.message if sitter.landmarks is None else None,
    }


def _shown(sitter: Sitter) -> dict[str, Any] | None:
    found = sitter.landmarks
    if found is None:
        return None
    return {
        "scheme": found.scheme,
        "points": np.asarray(found.points).tolist(),
        "groups": {name: list(rows) for name, rows in found.groups.items()},
        "detected": sitter.detected,
        "interocular_distance": found.interocular_distance,
    }


def _attached(data: bytes, name: str, media_type: str) -> Response:
    return Response(
        data, media_type=media_type, headers={"Content-Disposition": f'attachment; filename="{name}"'}
    )


def failure_of(error: Exception) -> tuple[int, Problem]:
    """Return the status and the answer that an error of ours stands for."""
    if isinstance(error, StudioError):
        return error.status, Problem(code=error.code, message=str(error))
    kinds = (
        (FaceNotFoundError, 409, "no_face"),
        (ImageError, 400, "bad_photo"),
        (LandmarkError, 400, "bad_landmarks"),
        (OptionError, 400, "bad_option"),
    )
    for kind, status, code in kinds:
        if isinstance(error, kind):
            return status, Problem(code=code, message=str(error).removeprefix("binary file: "))
    return 400, Problem(code="bad_request", message=str(error))
