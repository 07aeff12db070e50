"""What the clients of a server under load saw, and how long it took."""

from __future__ import annotations

import socket
import threading
import time
from collections import Counter, defaultdict
from collections.abc import Iterator
from contextlib import contextmanager

import httpx
import numpy as np


class Tally:
    """What the clients saw, counted by kind; how long it took, by phase and kind; and what was wrong."""

    def __init__(self) -> None:
        self.counts: Counter[str] = Counter()
        self.seconds: defaultdict[str, defaultdict[str, list[float]]] = defaultdict(lambda: defaultdict(list))
        self.phase = "warm-up"
        self.wrong: list[str] = []
        self.right: dict[str, bytes] = {}
        self._lock = threading.Lock()

    def count(self, what: str) -> None:
        """Count something."""
        with self._lock:
            self.counts[what] += 1

    @contextmanager
    def timed(self, kind: str) -> Iterator[None]:
        """Note how long something takes, in the phase in which it begins."""
        begun, phase = time.monotonic(), self.phase
        yield
        with self._lock:
            self.seconds[phase][kind].append(time.monotonic() - begun)

    def expect(self, kind: str, answer: httpx.Response, *statuses: int) -> None:
        """Count an answer, and note it if it is not as it should be."""
        self.count(f"{kind} {answer.status_code}")
        if answer.status_code not in statuses:
            self.wrong.append(f"{kind}: {answer.status_code} {answer.text[:200]}")
        elif answer.status_code >= 400 and set(answer.json()["error"]) != {"code", "message"}:
            self.wrong.append(f"{kind}: another form of failure: {answer.text[:200]}")
        elif answer.status_code in (429, 503) and not answer.headers.get("retry-after", "").isdigit():
            self.wrong.append(f"{kind}: {answer.status_code} without Retry-After")

    def same(self, kind: str, content: bytes) -> None:
        """Note an answer that is not the one which the first client got."""
        with self._lock:
            if self.right.setdefault(kind, content) != content:
                self.wrong.append(f"{kind}: another answer than the first client's")

    def times(self, phase: str, share: float) -> dict[str, float]:
        """Return, by kind, the seconds within which such a share of the answers of a phase came."""
        return {kind: float(np.quantile(took, share)) for kind, took in self.seconds[phase].items()}


def client_at(address: str, source: str) -> httpx.Client:
    """Return a client of an address of this machine, where it has more than one: Linux has 127.0.0.0/8."""
    transport = httpx.HTTPTransport(local_address=source if _is_ours(source) else None)
    return httpx.Client(base_url=address, timeout=150, transport=transport)


def _is_ours(source: str) -> bool:
    with socket.socket() as one:
        try:
            one.bind((source, 0))
        except OSError:
            return False
        return True
