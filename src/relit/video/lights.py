"""Pass 2: the change of light at key frames, in the frame of the face, and at any time between them.

What a photo's transfer makes of a key frame is taken to the frame that moves with the face. There it is
smoothed over the key frames around, by lines, and goes over evenly from one to the next: so it does not
flicker, and what changes evenly, as a sun that sets, is not late.
"""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

import numpy as np

from relit.inputs import as_photo
from relit.photo.planes import PlaneSpace, plane_space
from relit.relighting import transfer
from relit.runtime.threads import available, limit, pool
from relit.settings.studio_lights import studio_light
from relit.video.pixels import to_rgb
from relit.video.smoothing import REACH, curve_weights

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from relit.face.landmarks import Landmarks
    from relit.settings.options import TransferOptions
    from relit.video.tracked_clip import TrackedClip
    from relit.video.tracking import Track

    Plane = NDArray[np.float32]

# Seconds between key frames, and the standard deviation by which they are smoothed.
_STILL, _MOVING = (0.4, 0.5), (0.2, 0.15)
_LEAST_TRUST = 0.05  # of a key frame whose face is all but gone


class Reference(NamedTuple):
    """What lights a key frame: pixels or photos, and their faces."""

    images: list[Any]
    landmarks: list[Landmarks]

    @property
    def is_grey(self) -> bool:
        """Whether it has no colours."""
        return bool(self.images) and as_photo(self.images[0], "reference").is_grey


class Source(Protocol):
    """What gives the light at a time."""

    moving: bool

    def at(self, time: float) -> Reference:
        """Return the reference of a time, in s from the first frame."""
        ...


class Still:
    """A light that does not change: photos, or none where the options name a light."""

    moving = False

    def __init__(self, images: list[Any], landmarks: list[Landmarks]) -> None:
        self._reference = Reference(images, landmarks)

    def at(self, _time: float) -> Reference:
        """Return the photos."""
        return self._reference


class Moving:
    """A light that is that of a video at the same time; after its end, the last of it, or it begins anew."""

    moving = True

    def __init__(self, tracked: TrackedClip, *, loops: bool) -> None:
        self._track, self._steady, self._loops = tracked.track, tracked.steady, loops
        self._cursor = tracked.cursor()
        # Where the reference's face is gone, the light stays what it was.
        self._known = np.flatnonzero(self._track.shares > 0.5)
        if not self._known.size:
            self._known = np.flatnonzero(self._track.presence > 0)

    def at(self, time: float) -> Reference:
        """Return the frame of a time."""
        times = self._track.times
        step = times[-1] / (len(times) - 1) if len(times) > 1 else 0.0
        length = float(times[-1]) + step
        if self._loops and length > 0:
            time %= length
        number = int(self._known[np.argmin(np.abs(times[self._known] - time))])
        face = self._steady.landmarks(number)
        return Reference([to_rgb(self._cursor(number))], [face])


class Lights:
    """The changes of light of a clip.

    Parameters
    ----------
    tracked : TrackedClip
    source : Source
    options : TransferOptions
    """

    def __init__(self, tracked: TrackedClip, source: Source, options: TransferOptions) -> None:
        self._track, self._frame, self._steady = tracked.track, tracked.frame, tracked.steady
        self._source, self._options = source, options
        self._every, self._sigma = _MOVING if source.moving else _STILL
        self.keys = _key_frames(self._track, self._every)
        self._cursor = tracked.cursor()
        self._made: dict[int, Plane] = {}
        self.confidence = 1.0
        self._smooth = lru_cache(maxsize=4)(self._smoothed)

    @property
    def space(self) -> PlaneSpace:
        """The planes that are relit."""
        light = self._options.light
        grey = self._source.at(0.0).is_grey if light is None else not studio_light(light).colored
        return plane_space(False, grey, self._options.color_space, self._options.lit_channels)

    def prepare(self, first: int, last: int) -> None:
        """Work out what the frames from one number to another need, and forget what none of them does."""
        wanted = sorted({key for end in self._ends(first, last) for key in self._around(end).tolist()})
        self._made = {key: made for key, made in self._made.items() if key in wanted}
        missing = [key for key in wanted if key not in self._made]
        together = available()
        for start in range(0, len(missing), together):
            some = missing[start : start + together]
            given = [
                (key, to_rgb(self._cursor(key)), self._source.at(float(self._track.times[key])))
                for key in some
            ]
            with limit(1), pool(together) as run:
                for key, (made, confidence) in zip(some, run(self._relit, given), strict=True):
                    self._made[key] = made
                    self.confidence = min(self.confidence, confidence)

    def at(self, number: int) -> Plane:
        """Return the change of light of a frame that was prepared, in the frame of its face."""
        (before, after), times = self._between(number), self._track.times
        if before == after:
            return self._smooth(before)
        share = np.float32((times[number] - times[before]) / (times[after] - times[before]))
        return np.asarray((1 - share) * self._smooth(before) + share * self._smooth(after))

    def _between(self, number: int) -> tuple[int, int]:
        """Return the key frames between which a frame is."""
        place = int(np.searchsorted(self.keys, number))
        after = int(self.keys[min(place, len(self.keys) - 1)])
        before = after if after == number or place == 0 else int(self.keys[place - 1])
        return before, after

    def _ends(self, first: int, last: int) -> set[int]:
        lit = np.flatnonzero(self._track.shares[first:last] > 0) + first
        return {key for number in lit.tolist() for key in self._between(number)}

    def _around(self, key: int) -> NDArray[np.intp]:
        """Return the key frames of the same shot that count for one."""
        shot, times = self._track.shot_of(key), self._track.times
        near = (self.keys >= shot.start) & (self.keys < shot.stop)
        wanted: NDArray[np.intp] = self.keys[
            near & (np.abs(times[self.keys] - times[key]) <= REACH * self._sigma)
        ]
        return wanted

    def _smoothed(self, key: int) -> Plane:
        near, times = self._around(key), self._track.times
        trust = np.maximum(self._track.shares[near], _LEAST_TRUST)
        weights = curve_weights(times[near], float(times[key]), self._sigma, trust).astype(np.float32)
        made = np.zeros_like(self._made[key])
        for weight, one in zip(weights, near.tolist(), strict=True):
            made += weight * self._made[one]
        return made

    def _relit(self, given: tuple[int, NDArray[Any], Reference]) -> tuple[Plane, float]:
        """Return the change of light of a key frame in the frame of the face, and how sure the light is."""
        key, pixels, (images, faces) = given
        landmarks = self._steady.landmarks(key)
        result = transfer(
            pixels,
            images or None,
            target_landmarks=landmarks,
            reference_landmarks=faces or None,
            options=self._options,
            detail=self._options.record.preview_iod,
        )
        rows, columns = result.window
        placed = self._frame.placed(landmarks.points)
        made = placed.taken(result.change, result.view.factor, (columns.start, rows.start))
        return made, result.confidence


def _key_frames(track: Track, every: float) -> NDArray[np.intp]:
    """Return the first and last frame of each time that a face is relit, and some between."""
    keys: list[int] = []
    for shot in track.shots:
        lit = track.shares[shot] > 0
        edges = np.flatnonzero(np.diff(np.r_[False, lit, False].astype(int))) + shot.start
        for first, end in edges.reshape(-1, 2).tolist():
            times = track.times[first:end]
            count = max(int(np.ceil((times[-1] - times[0]) / every)), 1)
            wanted = np.linspace(times[0], times[-1], count + 1)
            keys += (np.unique(np.abs(times[:, None] - wanted).argmin(axis=0)) + first).tolist()
    return np.array(keys, np.intp)
