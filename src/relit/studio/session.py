"""A session: what one browser has, and how a request for what it has not is refused."""

from __future__ import annotations

import threading
import time
from dataclasses import dataclass, field

from relit.errors import FaceNotFoundError, RelitError
from relit.face.detect import detect_landmarks
from relit.face.landmarks import Landmarks
from relit.photo.photo import Photo
from relit.runtime.memo import Memo, size_of

ROLES = ("target", "reference")

_OF_THUMBNAILS = 30_000_000  # bytes: a look at a target of 160 px, and what twelve lights do to it


class StudioError(RelitError):
    """A request that cannot be met: with its HTTP status, and a code that tells programs why.

    Where it may be met later, it has the seconds after which to ask again.
    """

    def __init__(self, status: int, code: str, message: str, again: float | None = None) -> None:
        super().__init__(message)
        self.status, self.code, self.again = status, code, again


def busy(
    message: str = "The server has too much to do; ask again in a second.", again: float = 1
) -> StudioError:
    """Return the error of a request that may be met after so many seconds."""
    return StudioError(503, "busy", message, again)


@dataclass
class Portrait:
    """A photo of a session, and where its face is.

    Attributes
    ----------
    photo : Photo
    landmarks : Landmarks or None
        None where no face was found, and none has been placed by hand.
    detected : bool
        Whether the landmarks were found, not placed.
    previews : dict
        Longest side in px → the photo at that size.
    name : str or None
        That of its file, where the studio was started with it.
    """

    photo: Photo
    landmarks: Landmarks | None
    detected: bool
    previews: dict[int, Photo] = field(default_factory=dict)
    name: str | None = None

    def face(self, role: str) -> Landmarks:
        """Return the landmarks; raise a `StudioError` if there are none."""
        if self.landmarks is None:
            raise StudioError(409, "no_face", f"The {role} has no landmarks yet; place them by hand.")
        return self.landmarks

    @classmethod
    def of(cls, photo: Photo, role: str) -> Portrait:
        """Return a photo with its face, if one is found."""
        try:
            return cls(photo, detect_landmarks(photo.pixels, name=role), True)
        except FaceNotFoundError:
            return cls(photo, None, False)


@dataclass(eq=False)
class Session:
    """What one browser has.

    Attributes
    ----------
    client : str
        Whose it is, as of `client_of`.
    portraits : dict
        Role → photo and face. Another one takes its place when it changes: who works on it keeps what it had.
    gallery : dict
        Name → photo and face of a reference at hand.
    newest : int
        The highest sequence number of a preview asked for: older ones are stale.
    memo, small : Memo
        What its last previews were made of, and its last thumbnails: many of them do not push out what a
        preview needs.
    used : float
        When it was last asked for, or got its answer, by the monotonic clock.
    requests : int
        How many of its requests have no answer yet.
    lock : Lock
        Held while the session computes.
    """

    client: str = ""
    portraits: dict[str, Portrait] = field(default_factory=dict)
    gallery: dict[str, Portrait] = field(default_factory=dict)
    newest: int = -1
    memo: Memo = field(default_factory=Memo)
    small: Memo = field(default_factory=lambda: Memo(_OF_THUMBNAILS))
    used: float = field(default_factory=time.monotonic)
    requests: int = 0
    lock: threading.Lock = field(default_factory=threading.Lock)

    def portrait(self, role: str, *, needed: bool = False) -> Portrait:
        """Return the photo of a role.

        Raises
        ------
        StudioError
            If there is none: 404 where it is asked for itself, 409 where it is `needed` for something else.
        """
        if role not in self.portraits:
            message = f"There is no {role} yet; give it a photo first."
            raise StudioError(409 if needed else 404, "no_photo", message)
        return self.portraits[role]

    def in_gallery(self, name: str, *, needed: bool = False) -> Portrait:
        """Return a reference at hand; raise a `StudioError` as `portrait` does."""
        if (portrait := self.gallery.get(name)) is None:
            raise StudioError(409 if needed else 404, "no_photo", f"There is no reference {name!r} at hand.")
        return portrait

    def ready(self, role: str, name: str | None = None) -> tuple[Portrait, Landmarks]:
        """Return the photo of a role and its landmarks; raise a `StudioError` if one is missing.

        With a name, it is that reference at hand.
        """
        if name is not None and role == "reference":
            portrait = self.in_gallery(name, needed=True)
        else:
            portrait = self.portrait(role, needed=True)
        return portrait, portrait.face(role)

    @property
    def photos(self) -> list[Portrait]:
        """All photos, those of the gallery too."""
        return [*self.portraits.values(), *self.gallery.values()]

    @property
    def size(self) -> int:
        """Bytes in memory, about."""
        held = [(portrait.photo, portrait.previews) for portrait in self.photos]
        return size_of(held) + self.memo.size + self.small.size

    @property
    def photo_size(self) -> int:
        """Bytes that its photos take, without what can be made again."""
        return size_of([portrait.photo for portrait in self.photos])

    def forget(self) -> None:
        """Forget what can be made again, unless the session is computing."""
        if self.lock.acquire(blocking=False):
            self.memo, self.small = Memo(), Memo(_OF_THUMBNAILS)
            for portrait in self.photos:
                portrait.previews = {}
            self.lock.release()
