"""Sessions: each browser's photos, kept apart from all others', for a while, in memory alone."""

from __future__ import annotations

import secrets
import threading
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field

from relit.errors import FaceNotFoundError, RelitError
from relit.face.detect import detect_landmarks
from relit.face.landmarks import Landmarks
from relit.photo.photo import Photo
from relit.runtime.lru import LRU
from relit.runtime.memo import Memo, size_of

#: Seconds without a request after which a session ends.
EXPIRES = 3600

ROLES = ("target", "reference")

#: References that a session may have at hand.
MOST_REFERENCES = 24

_OF_THUMBNAILS = 30_000_000  # bytes: a look at a target of 160 px, and what twelve lights do to it


class StudioError(RelitError):
    """A request that cannot be met: with its HTTP status, and a code that tells programs why."""

    def __init__(self, status: int, code: str, message: str) -> None:
        super().__init__(message)
        self.status, self.code = status, code


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
    """

    photo: Photo
    landmarks: Landmarks | None
    detected: bool
    previews: dict[int, Photo] = field(default_factory=dict)

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


@dataclass
class Session:
    """What one client has.

    Attributes
    ----------
    portraits : dict
        Role → photo and face.
    gallery : dict
        Name → photo and face of a reference at hand.
    newest : int
        The highest sequence number of a preview asked for: older ones are stale.
    memo, small : Memo
        What its last previews were made of, and its last thumbnails: many of them do not push out what a
        preview needs.
    used : float
        When it was last asked for, by the monotonic clock.
    lock : Lock
        Held while the session computes: one thing at a time.
    """

    portraits: dict[str, Portrait] = field(default_factory=dict)
    gallery: dict[str, Portrait] = field(default_factory=dict)
    newest: int = -1
    memo: Memo = field(default_factory=Memo)
    small: Memo = field(default_factory=lambda: Memo(_OF_THUMBNAILS))
    used: float = field(default_factory=time.monotonic)
    lock: threading.Lock = field(default_factory=threading.Lock)

    def portrait(self, role: str, *, needed: bool = False) -> Portrait:
        """Return the photo of a role.

        Raises
        ------
        StudioError
            If there is none: 404 where it is asked for itself, 409 where it is `needed` for something else.
        """
        if role not in self.portraits:
            message = f"There is no {role} yet; drop a photo first."
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

    def forget(self) -> None:
        """Forget what can be made again, unless the session is computing."""
        if self.lock.acquire(blocking=False):
            self.memo, self.small = Memo(), Memo(_OF_THUMBNAILS)
            for portrait in self.photos:
                portrait.previews = {}
            self.lock.release()


class Sessions:
    """All sessions of a server.

    Parameters
    ----------
    most : int
        How many there may be; a new one replaces the one unused longest.
    most_bytes : int
        How much their photos and previews may hold together.
    """

    def __init__(self, most: int = 64, most_bytes: int = 2_000_000_000) -> None:
        self._most = most
        self._by_token: LRU[str, Session] = LRU(most_bytes, lambda session: {id(session): session.size})
        self._lock = threading.Lock()

    def __len__(self) -> int:
        """Return how many there are."""
        return len(self._by_token)

    @property
    def size(self) -> int:
        """Bytes that their photos and previews hold."""
        return self._by_token.size

    def begin(self, photos: Sequence[Photo] = ()) -> str:
        """Begin a session, with a target and a reference if given; return its token, which none can guess."""
        token, session = secrets.token_urlsafe(24), Session()
        with self._lock:
            self._end_expired()
            while len(self._by_token) >= self._most:
                self._by_token.pop(self._by_token.items()[0][0])
            self._forget_previews()
            self._by_token.put(token, session)
        for photo, role in zip(photos, ROLES, strict=False):
            self.keep(session, role, Portrait.of(photo, role))
        return token

    def get(self, token: str) -> Session:
        """Return a session.

        Raises
        ------
        StudioError
            If there is none of this token, or it has expired.
        """
        with self._lock:
            self._end_expired()
            session = self._by_token.get(token)
            if session is None:
                raise StudioError(404, "not_found", "This session has ended; reload the page.")
            session.used = time.monotonic()
            return session

    def end(self, token: str) -> None:
        """End a session, and forget its photos."""
        with self._lock:
            self._by_token.pop(token)

    def keep(self, session: Session, role: str, portrait: Portrait) -> None:
        """Give a session a photo; sessions unused for longest end where memory would not do."""
        with self._lock:
            session.portraits[role] = portrait
        self.make_room(session)

    def keep_in_gallery(self, session: Session, name: str, portrait: Portrait) -> None:
        """Give a session a reference at hand, in place of one of that name; as `keep` does.

        Raises
        ------
        StudioError
            If it has as many others as it may have.
        """
        with self._lock:
            if name not in session.gallery and len(session.gallery) >= MOST_REFERENCES:
                message = f"There are {MOST_REFERENCES} references at hand; delete one of them first."
                raise StudioError(409, "full", message)
            session.gallery[name] = portrait
        self.make_room(session)

    @contextmanager
    def computing(self, session: Session) -> Iterator[None]:
        """Let a session compute, alone; then make room for what it has made."""
        with session.lock:
            yield
        self.make_room(session)

    def make_room(self, session: Session) -> None:
        """Where memory runs out, have others forget their previews, then end, the longest unused first."""
        with self._lock:
            self._forget_previews(session)
            self._by_token.make_room(*(token for token, one in self._by_token.items() if one is session))

    def _forget_previews(self, spared: Session | None = None) -> None:
        for _, other in self._by_token.items():
            if other is not spared and self._by_token.excess:
                other.forget()

    def _end_expired(self) -> None:
        oldest = time.monotonic() - EXPIRES
        for token, session in self._by_token.items():
            if session.used < oldest:
                self._by_token.pop(token)
