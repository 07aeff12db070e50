"""Sessions: each browser's photos, kept apart from all others', for a while, in memory alone."""

from __future__ import annotations

import secrets
import threading
import time
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from relit.detect import detect_landmarks
from relit.errors import FaceNotFoundError, RelitError
from relit.memo import Memo

if TYPE_CHECKING:
    from collections.abc import Sequence

    from relit.image import Photo
    from relit.landmarks import Landmarks

#: Seconds without a request after which a session ends.
EXPIRES = 3600

#: Sessions that keep what their previews were made of: some 100 MB each.
_MEMOS = 4

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
        return int(self.photo.pixels.nbytes)


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
    memo : Memo or None
        What its last previews were made of, if there were any lately.
    work : Lock
        Held while the session computes: one thing at a time.
    """

    sitters: dict[str, Sitter] = field(default_factory=dict)
    newest: int = -1
    memo: Memo | None = None
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
            raise StudioError(404, "not_found", f"There is no {role} yet; drop a photo first.")
        return self.sitters[role]


class Sessions:
    """All sessions of a server.

    Parameters
    ----------
    most : int
        How many there may be; the one that was idle longest makes room.
    most_bytes : int
        How much their photos may hold together.
    """

    def __init__(self, most: int = 64, most_bytes: int = 2_000_000_000) -> None:
        self._most, self._most_bytes = most, most_bytes
        self._by_token: dict[str, Session] = {}
        self._at_work: list[Session] = []
        self._lock = threading.Lock()

    def __len__(self) -> int:
        """Return how many there are."""
        return len(self._by_token)

    def begin(self) -> str:
        """Begin a session and return its token, which nobody can guess."""
        with self._lock:
            self._sweep()
            while len(self._by_token) >= self._most:
                self._end_idlest()
            token = secrets.token_urlsafe(24)
            self._by_token[token] = Session()
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

    def memo_of(self, session: Session) -> Memo:
        """Return the memo of a session; only those that were at work last have one."""
        with self._lock:
            self._at_work = [one for one in self._at_work if one is not session] + [session]
            for idle in self._at_work[:-_MEMOS]:
                idle.memo = None
            self._at_work = self._at_work[-_MEMOS:]
            session.memo = session.memo or Memo()
            return session.memo

    def end(self, token: str) -> None:
        """End a session, and forget its photos."""
        with self._lock:
            ended = self._by_token.pop(token, None)
            self._at_work = [one for one in self._at_work if one is not ended]

    def keep(self, session: Session, role: str, sitter: Sitter) -> None:
        """Give a session a photo; those idle longest end where memory would not do."""
        with self._lock:
            session.sitters[role] = sitter
            while self._bytes() > self._most_bytes and len(self._by_token) > 1:
                self._end_idlest(but=session)

    def _bytes(self) -> int:
        return sum(sitter.size for one in self._by_token.values() for sitter in one.sitters.values())

    def _sweep(self) -> None:
        oldest = time.monotonic() - EXPIRES
        for token in [token for token, one in self._by_token.items() if one.touched < oldest]:
            del self._by_token[token]

    def _end_idlest(self, but: Session | None = None) -> None:
        others = {token: one for token, one in self._by_token.items() if one is not but}
        del self._by_token[min(others, key=lambda token: others[token].touched)]
