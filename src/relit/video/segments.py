"""A segment of a film, in a file of its own.

It can be decoded alone, and segments of the same settings are joined as they are: so a film that is half made
goes on where it was left.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from relit.errors import OutputError
from relit.video.encoding import encoded

if TYPE_CHECKING:
    from collections.abc import Iterable
    from pathlib import Path

    from relit.video.clip import Clip
    from relit.video.encoding import Settings


class Encoded(NamedTuple):
    """A packet of a segment."""

    pts: int
    is_key: bool
    data: bytes


def encode(path: Path, pictures: Iterable[Any], settings: Settings, clip: Clip, confidence: float) -> None:
    """Encode frames, one or more, into a segment, with how sure their light is.

    The frames are such as `writable` returns. The segment gets its name when it is whole.

    Raises
    ------
    OutputError
        If they cannot be encoded.
    """
    import av

    try:
        packets = [Encoded(one.pts, one.is_keyframe, bytes(one)) for one in encoded(pictures, settings, clip)]
    except av.FFmpegError as error:
        raise OutputError(
            f"{clip.path}: {settings.codec} cannot hold its frames ({error.strerror}); choose another codec"
        ) from error
    temporary = path.with_suffix(".tmp")
    with temporary.open("wb") as file:
        np.savez(
            file,
            confidence=confidence,
            pts=np.array([one.pts for one in packets], np.int64),
            keys=np.array([one.is_key for one in packets], bool),
            sizes=np.array([len(one.data) for one in packets], np.int64),
            data=np.frombuffer(b"".join(one.data for one in packets), np.uint8),
        )
    temporary.replace(path)


def confidence_of(path: Path) -> float:
    """Return how sure the light of a segment is."""
    with np.load(path) as kept:
        return float(kept["confidence"])


def read_segment(path: Path) -> list[Encoded]:
    """Return the packets of a segment, in the order in which they are decoded."""
    with np.load(path) as kept:
        pts, keys, ends, data = kept["pts"], kept["keys"], np.cumsum(kept["sizes"]), kept["data"].tobytes()
    starts = np.r_[0, ends[:-1]]
    return [
        Encoded(int(tick), bool(key), data[first:last])
        for tick, key, first, last in zip(pts, keys, starts.tolist(), ends.tolist(), strict=True)
    ]
