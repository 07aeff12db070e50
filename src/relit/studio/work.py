"""What requests have done: photos and landmarks taken in, and what takes time, two at once for all."""

from __future__ import annotations

import io
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import ParamSpec, TypeVar

from relit.errors import LandmarkError
from relit.face.landmark_files import landmarks_from
from relit.face.landmarks import Landmarks, check_inside
from relit.photo.pixels import check_pixels
from relit.photo.reading import read_image
from relit.studio.models import Marks, PhotoFacts
from relit.studio.sessions import Session, Sessions, Sitter, seated

#: Computations, two at once over all sessions: more would only be slower, and the models that find faces are
#: in memory once for each thread.
_WORKERS = ThreadPoolExecutor(2, "relit")
_P = ParamSpec("_P")
_T = TypeVar("_T")


def worked(function: Callable[_P, _T], *args: _P.args, **kwargs: _P.kwargs) -> _T:
    """Call a function where computations are made, when its turn comes."""
    return _WORKERS.submit(function, *args, **kwargs).result()


def take(sessions: Sessions, session: Session, role: str, data: io.BytesIO, most_pixels: int) -> PhotoFacts:
    """Take in a photo and find its face."""

    def arrived() -> Sitter:
        data.seek(0)
        photo = read_image(data, max_pixels=most_pixels)
        check_pixels(photo.pixels, role)
        return seated(photo, role)

    sitter = worked(arrived)
    sessions.keep(session, role, sitter)
    return PhotoFacts.of(sitter)


def place(session: Session, role: str, landmarks: Landmarks) -> Marks | None:
    """Place landmarks on a photo."""
    sitter = session.sitter(role)
    check_inside(landmarks, sitter.photo.pixels.shape, f"{role}_landmarks")
    # At work or not: a hand that drags a point does not wait for the preview that it makes stale.
    sitter.landmarks, sitter.detected = landmarks, False
    return Marks.of(sitter)


def place_from(session: Session, role: str, data: bytes, suffix: str) -> Marks | None:
    """Place the landmarks that are in a file."""
    name = f"{role}{suffix}"
    try:
        landmarks = landmarks_from(data, name)
    except LandmarkError as error:
        raise LandmarkError(str(error).replace(name, "the file")) from None
    return place(session, role, landmarks)
