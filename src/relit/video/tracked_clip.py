"""A clip, and how the face lies in each of its frames."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from relit.video.clip import Cursor
from relit.video.face_frame import FaceFrame
from relit.video.steady import Steady

if TYPE_CHECKING:
    from relit.video.clip import Clip
    from relit.video.tracking import Track

    Part = tuple[float | None, float | None]


class TrackedClip(NamedTuple):
    """What is known of a clip after its face was tracked.

    Attributes
    ----------
    clip : Clip
    part : (float or None, float or None)
        From when to when it was tracked, in s.
    track : Track
    frame : FaceFrame
        What moves with the face.
    steady : Steady
        Its landmarks, smoothed.
    """

    clip: Clip
    part: Part
    track: Track
    frame: FaceFrame
    steady: Steady

    @classmethod
    def of(cls, clip: Clip, part: Part, track: Track) -> TrackedClip:
        """Return a clip with what follows from its track."""
        frame = FaceFrame.of(track)
        return cls(clip, part, track, frame, Steady(track, frame))

    def cursor(self) -> Cursor:
        """Return a reader of its frames, by the numbers that they have in the track."""
        return Cursor(self.clip, *self.part)
