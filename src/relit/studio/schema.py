"""What the API's schema says of answers, beyond what the framework reads from the code."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from fastapi import Response

from relit.studio.models import Failure

Responses = dict[int | str, dict[str, Any]]

_BINARY = {"schema": {"type": "string", "format": "binary"}}
#: A request whose body is a file.
FILE: dict[str, Any] = {"requestBody": {"required": True, "content": {"application/octet-stream": _BINARY}}}
#: Headers of a file, and of a preview.
NAMED = {"Content-Disposition": "A name for the file."}
EXPORTED = NAMED | {
    "X-Relit-Not-Kept": "What the photo holds beside its colours that the format cannot, as JSON: words."
}
VIEW_HEADERS = {
    "X-Relit-Window": "Left, top, width and height of the view, as shares of the target's.",
    "X-Relit-Views": "Names of the views that this method has.",
    "X-Relit-Lambda-Px": "1/lambda, in px of the target: what is smaller stays the person's.",
    "X-Relit-Seconds": "How long it took.",
    "X-Relit-Lamps": "The new light without its fill, as JSON: [azimuth, elevation, power, '#rrggbb'] of "
    "each lamp in degrees, the strongest first and its power 1; [] of a method that finds none.",
    "X-Relit-Fill": "Its light from everywhere, as a share of what falls on what looks into it; or empty.",
    "X-Relit-Confidence": "How far it can be trusted that this is the reference's light, 0 to 1.",
}
_MEANINGS = {
    400: "The photo, the landmarks or an option cannot be used; or the body is no JSON.",
    401: "The server asks for its token, or this is not the one (`unauthorized`).",
    403: "The server does not go by the name in Host, or another site's page asks.",
    404: "There is no such session (`not_found`), or it has no such photo (`no_photo`).",
    408: "The body stopped coming.",
    409: "A photo (`no_photo`) or its landmarks (`no_face`) are missing, a newer preview was asked for "
    "(`stale`), or there are as many photos as there may be (`full`).",
    413: "The body is longer than bodies of its kind may be.",
    422: "The request is not of the form that this schema describes.",
    429: "As much is being sent as fits into memory: ask again after the seconds in Retry-After.",
    503: "Too much is to be done, or all sessions or all memory for photos are in use (`busy`); or the "
    "answer takes too long (`too_long`). Ask again after the seconds in Retry-After.",
}


def described(*statuses: int) -> Responses:
    """Return descriptions of failures, for the ``responses`` of a route."""
    failures: Responses = {
        status: {"model": Failure, "description": _MEANINGS[status]} for status in statuses
    }
    if 401 in failures:
        failures[401]["headers"] = {"WWW-Authenticate": _header("Bearer.", "string")}
    for status in {429, 503} & failures.keys():
        failures[status]["headers"] = {"Retry-After": _header("Seconds.", "integer")}
    return failures


def sends(media_type: str, what: str, headers: Mapping[str, str], *failures: int) -> dict[str, Any]:
    """Return the keywords of a route whose answer is no JSON, with its headers and how it may fail."""
    answer = {
        "description": what,
        "content": {media_type: _BINARY},
        "headers": {name: _header(meaning, "string") for name, meaning in headers.items()},
    }
    return {"response_class": Response, "responses": {200: answer, **described(*failures)}}


def _header(meaning: str, kind: str) -> dict[str, Any]:
    return {"description": meaning, "required": True, "schema": {"type": kind}}


def links(status: int, token: str, *names: str) -> Responses:
    """Return links to what may be asked for next, and where its token is, for a route's ``responses``."""
    return {
        status: {"links": {name: {"operationId": name, "parameters": {"session": token}} for name in names}}
    }
