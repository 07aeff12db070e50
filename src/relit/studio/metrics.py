"""What is counted, for Prometheus: no photo, session, token or client has a label."""

from __future__ import annotations

from collections.abc import Callable

from prometheus_client import (
    CONTENT_TYPE_LATEST,
    CollectorRegistry,
    Counter,
    Gauge,
    Histogram,
    generate_latest,
)

MEDIA_TYPE = CONTENT_TYPE_LATEST
#: Seconds: what a lookup takes, a preview, a photo of 24 megapixels, and what has waited.
_BUCKETS = (0.01, 0.03, 0.1, 0.3, 1, 3, 10, 30, 100)


class Metrics:
    """Counters of one server.

    Examples
    --------
    >>> metrics = Metrics()
    >>> metrics.gauge("relit_sessions", "Sessions that there are.", lambda: 3)
    >>> b"relit_sessions 3.0" in metrics.text()
    True
    """

    def __init__(self) -> None:
        self._registry = CollectorRegistry()
        kinds = ["method", "route", "status"]
        self._requests = Counter(
            "relit_requests", "Requests answered; 499: the client hung up.", kinds, registry=self._registry
        )
        self._seconds = Histogram(
            "relit_request_seconds",
            "Seconds from the head of a request to the end of its answer.",
            ["method", "route"],
            buckets=_BUCKETS,
            registry=self._registry,
        )
        self._refused = Counter(
            "relit_connections_refused",
            "Connections closed before a request of theirs was read.",
            ["reason"],
            registry=self._registry,
        )

    def gauge(self, name: str, meaning: str, read: Callable[[], float]) -> None:
        """Tell, whenever asked, what a function returns: it has to be quick, and no request's work."""
        Gauge(name, meaning, registry=self._registry).set_function(read)

    def answered(self, method: str, route: str, status: int, seconds: float) -> None:
        """Count a request."""
        self._requests.labels(method, route, str(status)).inc()
        self._seconds.labels(method, route).observe(seconds)

    def refused(self, reason: str) -> None:
        """Count a connection that was closed."""
        self._refused.labels(reason).inc()

    def text(self) -> bytes:
        """Return all of it in Prometheus' text format."""
        return generate_latest(self._registry)
