"""What the API's schema says of answers, beyond what the framework reads from the code."""

from __future__ import annotations

from typing import Any

from relit.studio.models import Failure

Responses = dict[int | str, dict[str, Any]]

#: A request whose body is a file.
FILE: dict[str, Any] = {
    "requestBody": {
        "required": True,
        "content": {"application/octet-stream": {"schema": {"type": "string", "format": "binary"}}},
    }
}
#: Of a preview.
VIEW_HEADERS = {
    "X-Relit-Window": "Left, top, width and height of the view, as shares of the target's.",
    "X-Relit-Views": "Names of the views that this method has.",
    "X-Relit-Lambda-Px": "1/lambda, in px of the target: what is smaller stays the person's.",
    "X-Relit-Seconds": "How long it took.",
}
_MEANINGS = {
    400: "The photo, the landmarks or an option cannot be used; or the body is no JSON.",
    403: "The server does not go by the name in Host, or another site's page asks.",
    404: "There is no such session (`not_found`), or it has no such photo yet (`no_photo`).",
    408: "The body stopped coming.",
    409: "A photo (`no_photo`) or its landmarks (`no_face`) are missing, or a newer preview was asked for "
    "(`stale`).",
    413: "The body is longer than bodies of its kind may be.",
    422: "The request is not of the form that this schema describes.",
    429: "Others are sending as much as fits into memory: ask again after the seconds in Retry-After.",
}


def described(*statuses: int) -> Responses:
    """Return failures as a route's ``responses`` take them."""
    retry = {"Retry-After": {"description": "Seconds.", "required": True, "schema": {"type": "integer"}}}
    return {
        status: {
            "model": Failure,
            "description": _MEANINGS[status],
            **({"headers": retry} if status == 429 else {}),
        }
        for status in statuses
    }


def sent(media_type: str, what: str, *headers: str) -> Responses:
    """Return an answer that is no JSON, as a route's ``responses`` take it."""
    told = {"Content-Disposition": "A name for the file.", **VIEW_HEADERS}
    return {
        200: {
            "description": what,
            "content": {media_type: {"schema": {"type": "string", "format": "binary"}}},
            "headers": {
                name: {"description": told[name], "required": True, "schema": {"type": "string"}}
                for name in headers
            },
        }
    }


def links(status: int, token: str, *names: str) -> Responses:
    """Return, as a route's ``responses`` take them, what may be asked for next, and where the token is."""
    return {
        status: {"links": {name: {"operationId": name, "parameters": {"session": token}} for name in names}}
    }
