"""Sessions: each browser's photos, kept apart from all others', for a while, in memory alone.

A session that was used lately, or is being asked for something, is live: no stranger ends it. Whoever would
take more than there is, is told.
"""

from __future__ import annotations

import secrets
import threading
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from math import ceil

from relit.photo.photo import Photo
from relit.studio.limits import SHARE, Limits
from relit.studio.session import ROLES, Portrait, Session, StudioError, busy

#: Seconds without a request after which a session ends.
EXPIRES = 3600
#: The same at one's own machine, where a page may be left open over a holiday.
EXPIRES_AT_HOME = 30 * 24 * 3600

#: References that a session may have at hand.
MOST_REFERENCES = 24
#: Beside them it may have a photo of this name, which is to be relit next.
ASIDE = "film"


class Sessions:
    """All sessions of a server.

    Parameters
    ----------
    limits : Limits
        Of them, `sessions`, `sessions_per_client`, `live_seconds` and `memory`. Where there are as many
        sessions as there may be, the one unused longest makes way for a new one, unless it is live.
    expires : int
        Seconds without a request after which a session ends.
    """

    def __init__(self, limits: Limits = Limits(), expires: int = EXPIRES) -> None:
        self._limits, self.expires = limits, expires
        self._by_token: dict[str, Session] = {}  # the one unused longest first
        self._lock = threading.Lock()

    def __len__(self) -> int:
        """Return how many there are."""
        return len(self._by_token)

    @property
    def size(self) -> int:
        """Bytes that their photos and previews hold."""
        return sum(one.size for one in list(self._by_token.values()))

    def begin(self, photos: Sequence[tuple[str, Photo]] = (), client: str = "") -> str:
        """Begin a session, with a target and a reference if given; return its token, which none can guess.

        Photos are given with the names of their files.

        Raises
        ------
        StudioError
            If the client, or all together, have as many live sessions as they may have.
        """
        token, session = secrets.token_urlsafe(24), Session(client, used=time.monotonic())
        with self._lock:
            self._end_expired()
            if len(self._of(client)) >= self._limits.sessions_per_client:
                self._end_idle(self._of(client), "You have")
            if len(self._by_token) >= self._limits.sessions:
                self._end_idle(list(self._by_token), "There are")
            self._by_token[token] = session
        for (name, photo), role in zip(photos, ROLES, strict=False):
            self.keep(session, role, replace(Portrait.of(photo, role), name=name))
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
            session = self._by_token.pop(token, None)
            if session is None:
                raise StudioError(404, "not_found", "This session has ended; begin another one.")
            self._by_token[token] = session
            session.used = time.monotonic()
            return session

    @contextmanager
    def using(self, token: str) -> Iterator[Session]:
        """Lend a session to a request: for as long as that takes, nobody else ends it.

        Raises
        ------
        StudioError
            As `get` does.
        """
        session = self.get(token)
        with self._lock:
            session.requests += 1
        try:
            yield session
        finally:
            with self._lock:
                session.requests -= 1
                session.used = time.monotonic()
                if self._by_token.pop(token, None):  # unless its own client has ended it
                    self._by_token[token] = session

    def end(self, token: str) -> None:
        """End a session, and forget its photos."""
        with self._lock:
            self._by_token.pop(token, None)

    def keep(self, session: Session, role: str, portrait: Portrait) -> None:
        """Give a session a photo.

        Raises
        ------
        StudioError
            If there is no room for it, since the client's photos, or others' that are live, take it.
        """
        with self._lock:
            before, session.portraits = session.portraits, session.portraits | {role: portrait}
            try:
                self._make_room(session)
            except StudioError:
                session.portraits = before
                raise

    def swap(self, session: Session) -> str:
        """Swap the roles of a session's photos; return the name by which the new reference is at hand.

        Raises
        ------
        StudioError
            If one is missing, or if there are as many references at hand as there may be.
        """
        with self._lock:
            target, reference = (session.portrait(role, needed=True) for role in ROLES)
            name = next((name for name, one in session.gallery.items() if one is target), None)
            if name is None:
                name = secrets.token_urlsafe(12)
                _check_room(session)
                session.gallery = session.gallery | {name: target}
            session.portraits = {"target": reference, "reference": target}
            return name

    def keep_in_gallery(self, session: Session, name: str, portrait: Portrait) -> None:
        """Give a session a reference at hand, in place of one of that name; as `keep` does.

        Raises
        ------
        StudioError
            If it has as many others as it may have, or there is no room for it.
        """
        with self._lock:
            if name not in session.gallery and name != ASIDE:
                _check_room(session)
            before, session.gallery = session.gallery, session.gallery | {name: portrait}
            try:
                self._make_room(session)
            except StudioError:
                session.gallery = before
                raise

    def drop_from_gallery(self, session: Session, name: str) -> None:
        """Take a reference at hand from a session; raise a `StudioError` if there is none of that name."""
        with self._lock:
            session.in_gallery(name)
            session.gallery = {other: one for other, one in session.gallery.items() if other != name}

    @contextmanager
    def computing(self, session: Session) -> Iterator[None]:
        """Let a session compute, alone; then make room for what it has made."""
        try:
            with session.lock:
                yield
        finally:  # what was called off has made something too
            with self._lock:
                self._forget_previews(session)

    def _of(self, client: str) -> list[str]:
        """Return the tokens of a client's sessions, the one unused longest first."""
        return [token for token, session in self._by_token.items() if session.client == client]

    def _end_idle(self, tokens: list[str], whose: str) -> None:
        """End the one of some sessions that is unused longest, or refuse another one if it is live."""
        idle = [token for token in tokens if not self._by_token[token].requests]
        left = self._limits.live_seconds
        if idle:
            left += self._by_token[idle[0]].used - time.monotonic()
        if left > 0 or not idle:
            told = (
                f"{whose} as many sessions in use as there may be; end one, or come back in {ceil(left)} s."
            )
            raise busy(told, left)
        del self._by_token[idle[0]]

    def _make_room(self, session: Session) -> None:
        """Make room for the photos of a session: previews go first, then idle sessions; or refuse them."""
        most, idle_since = SHARE * self._limits.memory, time.monotonic() - self._limits.live_seconds
        idle = {
            token: one
            for token, one in self._by_token.items()
            if one is not session and one.used < idle_since and not one.requests
        }
        own = [one for one in self._by_token.values() if one.client == session.client]
        for token in [token for token, one in idle.items() if one.client == session.client]:
            if sum(one.photo_size for one in own) <= most:
                break
            own.remove(idle.pop(token))
            del self._by_token[token]
        if sum(one.photo_size for one in own) > most:
            told = (
                f"Your photos take more than {most / 1e9:.3g} GB, which one client's may; delete some first."
            )
            raise StudioError(409, "full", told)
        self._forget_previews(session)
        for token in idle:
            if not self._excess:
                return
            del self._by_token[token]
        if self._excess:
            session.forget()
        if self._excess:
            raise busy(
                "Photos in use take all memory that there is for them; send yours again in a minute.", 60
            )

    @property
    def _excess(self) -> int:
        """Bytes that photos and previews take beyond what they may."""
        return max(sum(one.size for one in self._by_token.values()) - self._limits.memory, 0)

    def _forget_previews(self, spared: Session) -> None:
        """Where memory runs out, have sessions forget what they can make again: first those of the client."""
        others = [one for one in self._by_token.values() if one is not spared]
        for other in sorted(others, key=lambda one: one.client != spared.client):
            if not self._excess:
                return
            other.forget()

    def _end_expired(self) -> None:
        oldest = time.monotonic() - self.expires
        for token, session in list(self._by_token.items()):
            if session.used < oldest and not session.requests:
                del self._by_token[token]


def _check_room(session: Session) -> None:
    if len(session.gallery.keys() - {ASIDE}) >= MOST_REFERENCES:
        message = f"There are {MOST_REFERENCES} references at hand; delete one of them first."
        raise StudioError(409, "full", message)
