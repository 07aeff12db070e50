"""What a server lets its clients take: the limits, all of which `relit serve` has options for."""

from __future__ import annotations

from dataclasses import dataclass

from relit.errors import OptionError
from relit.settings.option_fields import is_finite

#: Of the memory for photos, and of that for computations, what one client may take: what is left holds
#: another's pair of 24 million px, and takes its export.
SHARE = 0.75


@dataclass(frozen=True)
class Limits:
    """What a server lets its clients take: finite numbers of 0 or more.

    Attributes
    ----------
    bytes, pixels : int
        Of one photo that is sent.
    memory, working_memory : int
        Bytes that photos and previews of all sessions may hold, and, apart from these, what all computations
        at once may take.
    sessions, sessions_per_client : int
        How many there may be.
    live_seconds : float
        For how long after the answer to a request its session is not ended for the sake of another one.
    workers : int
        Computations at once.
    queue, queue_per_session : int
        Computations that may wait, over all sessions and of each.
    connections : int
        Connections at once, over all clients.
    header_seconds, body_seconds, compute_seconds : float
        How long the head of a request, its body, and the answer to it may take.
    """

    bytes: int = 200_000_000
    pixels: int = 100_000_000
    memory: int = 2_000_000_000
    working_memory: int = 3_000_000_000
    sessions: int = 64
    sessions_per_client: int = 16
    live_seconds: float = 300
    workers: int = 2
    queue: int = 32
    queue_per_session: int = 4
    connections: int = 256
    header_seconds: float = 10
    body_seconds: float = 120
    compute_seconds: float = 120

    def __post_init__(self) -> None:
        """Refuse what nothing can be compared with."""
        for name, limit in vars(self).items():
            if not (is_finite(limit) and limit >= 0):
                raise OptionError(f"{name}: expected a finite number of 0 or more, got {limit!r}")


#: Of one person at his own machine: what he leaves makes way for what he opens next, and an export takes what
#: `relit transfer` takes.
PERSONAL = Limits(sessions_per_client=64, live_seconds=0, working_memory=16_000_000_000)
