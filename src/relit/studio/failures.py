"""How the API says no: every answer of 4xx and 503 has one form, described in its schema."""

from __future__ import annotations

from collections.abc import Mapping
from math import ceil

from fastapi import FastAPI, Request
from fastapi.exceptions import RequestValidationError
from fastapi.responses import JSONResponse
from starlette.exceptions import HTTPException
from starlette.requests import ClientDisconnect

from relit.errors import FaceNotFoundError, ImageError, LandmarkError, OptionError, RelitError
from relit.plain_words import in_plain_words
from relit.studio.models import Failure, Problem
from relit.studio.session import StudioError

_KINDS = (
    (FaceNotFoundError, 409, "no_face"),
    (ImageError, 400, "bad_photo"),
    (LandmarkError, 400, "bad_landmarks"),
    (OptionError, 400, "bad_option"),
    (RelitError, 400, "bad_request"),
)
_CODES = {404: "not_found", 405: "method_not_allowed"}
_UNREAD = "The body cannot be read as JSON; check its syntax, its depth and the length of its numbers."
_LONGEST = 1000  # characters of a message: it may quote what came


def refusal(status: int, code: str, message: str, headers: Mapping[str, str] | None = None) -> JSONResponse:
    """Return the answer that something cannot be done."""
    # A message may quote half of a surrogate pair, which is JSON but no text.
    message = message.encode("utf-8", "backslashreplace").decode()
    if len(message) > _LONGEST:
        message = f"{message[:_LONGEST]}..."
    failure = Failure(error=Problem(code=code, message=message))
    return JSONResponse(failure.model_dump(), status, headers)


def answer_failures(app: FastAPI) -> None:
    """Have an application answer with refusals, whatever goes wrong with a request."""

    @app.exception_handler(StudioError)
    def refuse(_request: Request, error: StudioError) -> JSONResponse:
        again = {"Retry-After": str(max(ceil(error.again), 1))} if error.again is not None else None
        return refusal(error.status, error.code, str(error), again)

    @app.exception_handler(RelitError)
    def refuse_input(_request: Request, error: RelitError) -> JSONResponse:
        status, code = next((status, code) for kind, status, code in _KINDS if isinstance(error, kind))
        return refusal(status, code, in_plain_words(str(error)).removeprefix("binary file: "))

    @app.exception_handler(ClientDisconnect)
    def forget(_request: Request, _error: ClientDisconnect) -> JSONResponse:
        return refusal(499, "gone", "The client has hung up.")

    @app.exception_handler(RequestValidationError)
    def refuse_form(_request: Request, error: RequestValidationError) -> JSONResponse:
        first = error.errors()[0]
        if first["type"] == "json_invalid":
            return refusal(400, "bad_request", _UNREAD)
        where = ".".join(str(part) for part in first["loc"])
        return refusal(422, "bad_request", f"{where}: {first['msg']}")

    @app.exception_handler(HTTPException)
    def refuse_request(request: Request, error: HTTPException) -> JSONResponse:
        headers = dict(error.headers or {})
        if error.status_code == 405:  # the framework names the methods of one route to a path, of several
            methods = app.openapi()["paths"].get(request.scope["route"].path, {})
            headers["Allow"] = ", ".join(sorted(map(str.upper, methods))) or headers["Allow"]
        code = _CODES.get(error.status_code, "bad_request")
        message = _UNREAD if error.status_code == 400 else f"{error.detail}."
        return refusal(error.status_code, code, message, headers)
