"""Sessions: each browser's photos, kept apart from all others', for a while, in memory alone."""

from __future__ import annotations

import secrets
import threading
import time
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from relit.errors import FaceNotFoundError, RelitError
from relit.face.detect import detect_landmarks
from relit.runtime.lru import LRU
from relit.runtime.memo import Memo, size_of

if TYPE_CHECKING:
    from collections.abc import Sequence

    from relit.face.landmarks import Landmarks
    from relit.photo.photo import Photo

#: Seconds without a request after which a session ends.
EXPIRES = 3600

ROLES = ("target", "reference")


class StudioError(RelitError):
    """What a client did that cannot be done.

    Parameters
    ----------
    status : int
        HTTP status.
    code : str
        What kind it is, for programs.
    message : str
    """

    def __init__(self, status: int, code: str, message: str) -> None:
        super().__init__(message)
        self.status, self.code = status, code


@dataclass
class Sitter:
    """A photo of a session, and where its face is.

    Attributes
    ----------
    photo : Photo
    landmarks : Landmarks or None
        None where none was found or placed.
    detected : bool
    message : str or None
        Why there are none.
    previews : dict
        Longest side in px → the photo at that size.
    """

    photo: Photo
    landmarks: Landmarks | None
    detected: bool
    message: str | None = None
    previews: dict[int, Photo] = field(default_factory=dict)

    @property
    def size(self) -> int:
        """Bytes in memory, about."""
        return size_of((self.photo, self.previews))


def seated(photo: Photo, role: str) -> Sitter:
    """Return a photo with its face, if one is found."""
    try:
        return Sitter(photo, detect_landmarks(photo.pixels, name=role), True)
    except FaceNotFoundError:
        message = f"No face was found in the {role}; place landmarks by hand, or load a file of them."
        return Sitter(photo, None, False, message)


@dataclass
class Session:
    """What one client has.

    Attributes
    ----------
    sitters : dict
        Role → photo and face.
    newest : int
        The highest sequence number of a preview asked for: older ones are stale.
    memo : Memo
        What its last previews were made of.
    work : Lock
        Held while the session computes: one thing at a time.
    """

    sitters: dict[str, Sitter] = field(default_factory=dict)
    newest: int = -1
    memo: Memo = field(default_factory=Memo)
    touched: float = field(default_factory=time.monotonic)
    work: threading.Lock = field(default_factory=threading.Lock)

    def sitter(self, role: str) -> Sitter:
        """Return the photo of a role.

        Raises
        ------
        StudioError
            If there is none.
        """
        if role not in self.sitters:
            raise StudioError(404, "no_photo", f"There is no {role} yet; drop a photo first.")
        return self.sitters[role]

    def needed(self, role: str) -> Sitter:
        """Return the photo of a role, for work that takes it.

        Raises
        ------
        StudioError
            If there is none; with another status than where the photo itself was asked for.
        """
        try:
            return self.sitter(role)
        except StudioError as error:
            raise StudioError(409, error.code, str(error)) from None

    def ready(self, role: str) -> tuple[Sitter, Landmarks]:
        """Return the photo of a role and its landmarks, for work that takes both.

        Raises
        ------
        StudioError
            If one is missing.
        """
        sitter = self.needed(role)
        if sitter.landmarks is None:
            raise StudioError(409, "no_face", f"The {role} has no landmarks yet; place them by hand.")
        return sitter, sitter.landmarks

    @property
    def size(self) -> int:
        """Bytes in memory, about."""
        return sum(sitter.size for sitter in list(self.sitters.values())) + self.memo.size

    def forget(self) -> None:
        """Forget what can be made anew, unless it is at work."""
        if self.work.acquire(blocking=False):
            self.memo = Memo()
            for sitter in self.sitters.values():
                sitter.previews = {}
            self.work.release()


class Sessions:
    """All sessions of a server.

    Parameters
    ----------
    most : int
        How many there may be; the one that was idle longest makes room.
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

    def begin(self) -> str:
        """Begin a session and return its token, which nobody can guess."""
        with self._lock:
            self._sweep()
            while len(self._by_token) >= self._most:
                self._by_token.pop(self._by_token.items()[0][0])
            token = secrets.token_urlsafe(24)
            self._forget_previews()
            self._by_token.put(token, Session())
            return token

    def begin_with(self, photos: Sequence[Photo]) -> str:
        """Begin a session that has a target and a reference already, and return its token."""
        token = self.begin()
        session = self.get(token)
        for role, photo in zip(ROLES, photos, strict=True):
            self.keep(session, role, seated(photo, role))
        return token

    def get(self, token: str) -> Session:
        """Return a session.

        Raises
        ------
        StudioError
            If there is none of this token, or it has expired.
        """
        with self._lock:
            self._sweep()
            session = self._by_token.get(token)
            if session is None:
                raise StudioError(404, "not_found", "This session has ended; reload the page.")
            session.touched = time.monotonic()
            return session

    def end(self, token: str) -> None:
        """End a session, and forget its photos."""
        with self._lock:
            self._by_token.pop(token)

    def keep(self, session: Session, role: str, sitter: Sitter) -> None:
        """Give a session a photo; those idle longest end where memory would not do."""
        with self._lock:
            session.sitters[role] = sitter
        self.make_room(session)

    def make_room(self, session: Session) -> None:
        """Where memory would not do, have others forget their previews, and then end, the idlest first."""
        with self._lock:
            self._forget_previews(session)
            self._by_token.make_room(*(token for token, one in self._by_token.items() if one is session))

    def _forget_previews(self, spared: Session | None = None) -> None:
        for _, other in self._by_token.items():
            if other is not spared and self._by_token.excess:
                other.forget()

    def _sweep(self) -> None:
        oldest = time.monotonic() - EXPIRES
        for token, session in self._by_token.items():
            if session.touched < oldest:
                self._by_token.pop(token)
