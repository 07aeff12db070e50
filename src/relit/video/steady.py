"""Landmarks without jitter and without lag: how a face lies, and what shape it has, each smoothed over time.

Over a short time a face that moves is where it is; over a long one, a face that keeps still has less jitter.
As far as the two tell the same, but for jitter, the long one counts.
"""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from relit.face.landmarks import Landmarks
from relit.video.face_frame import IOD, inverse, moved
from relit.video.smoothing import REACH, curve_weights
from relit.warp.similarity import Similarity, fit_similarity

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from relit.video.face_frame import FaceFrame
    from relit.video.tracking import Track

# Standard deviations in s, short and long, by which it is smoothed how a face lies, and its shape; over the
# short one by parabolas, over which a fast head is not late.
_LYING, _SHAPE = (0.1, 0.3), (0.2, 0.4)
# Interocular distances that the two may lie apart by jitter, and from where on the short one counts alone: on
# a still portrait with a camera's noise (2 grey levels) they are 0.0002 apart at the median, 0.001 at most.
_JITTER, _MOTION = 0.003, 0.01
_KEPT = 256  # frames: the longest of these reach 3 s at 60 frames a second


class _Face(NamedTuple):
    linear: NDArray[np.float64]
    shift: NDArray[np.float64]
    shape: NDArray[np.float64]


class Steady:
    """The smoothed landmarks of a track."""

    def __init__(self, track: Track, frame: FaceFrame) -> None:
        self._track, self._frame = track, frame
        self._face = lru_cache(maxsize=_KEPT)(self._taken_apart)

    def landmarks(self, number: int) -> Landmarks:
        """Return those of a frame; where the face was not found, they are read off the frames around."""
        track, shot = self._track, self._track.shot_of(number)
        at, reach = float(track.times[number]), REACH * max(*_LYING, *_SHAPE)
        first = max(int(np.searchsorted(track.times, at - reach)), shot.start)
        last = min(int(np.searchsorted(track.times, at + reach, "right")), shot.stop)
        near = np.arange(first, last)
        near = near[track.presence[near] > 0]
        if not near.size:
            return Landmarks(track.points[number], "mesh478", 0.0)
        faces = [self._face(one) for one in near.tolist()]
        times, trust = track.times[near], track.presence[near].astype(np.float64)

        def over(sigma: float, values: list[NDArray[np.float64]]) -> NDArray[np.float64]:
            degree = 2 if sigma in (_LYING[0], _SHAPE[0]) else 1
            weights = curve_weights(times, at, sigma, trust, degree)
            return np.asarray(
                sum(weight * one for weight, one in zip(weights, values, strict=True) if weight)
            )

        lying = [
            Similarity(over(sigma, [one.linear for one in faces]), over(sigma, [one.shift for one in faces]))
            for sigma in _LYING
        ]
        short, long = (one(self._frame.template[:, :2]) for one in lying)
        share = _motion((short - long) / (IOD * lying[1].scale))
        smooth = Similarity(
            *(
                _mixed(share, *pair)
                for pair in ((lying[0].linear, lying[1].linear), (lying[0].shift, lying[1].shift))
            )
        )
        shapes = [over(sigma, [one.shape for one in faces]) for sigma in _SHAPE]
        shape = _mixed(_motion((shapes[0] - shapes[1])[:, :2] / IOD), *shapes)
        return Landmarks(moved(smooth, shape), "mesh478", min(float(trust.max()), 1.0))

    def _taken_apart(self, number: int) -> _Face:
        points = np.asarray(self._track.points[number], np.float64)
        lying = fit_similarity(self._frame.template[:, :2], points[:, :2])
        return _Face(lying.linear, lying.shift, moved(inverse(lying), points))


def _motion(apart: NDArray[np.float64]) -> float:
    """Return how surely points are apart by motion, and not by jitter, 0 to 1."""
    away = float(np.sqrt((apart**2).sum(axis=1).mean()))
    return float(np.clip((away - _JITTER) / (_MOTION - _JITTER), 0, 1))


def _mixed(share: float, one: NDArray[np.float64], other: NDArray[np.float64]) -> NDArray[np.float64]:
    return share * one + (1 - share) * other
