"""Pass 1: the face in every frame, where the film is cut, and how much of a change each frame takes.

A face is looked for on a stride, after cuts and where it was lost; between, it is followed. What was found is
kept in a file, since an hour of it is 600 MB.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from relit.errors import FaceNotFoundError, ImageError
from relit.face.follow import follow, nearest_face
from relit.face.landmarks import Landmarks
from relit.video.clip import frames
from relit.video.cuts import JUMP, apart, find_cuts, signature
from relit.video.pixels import to_rgb
from relit.video.smoothing import faded, filled

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from numpy.typing import NDArray

    from relit.video.clip import Clip

_STRIDE = 1.0  # s after which a face that is followed is looked for again, so that it cannot drift
_RETRY = 0.2  # s after which one that was not found is looked for again
_LEAP = 0.6  # interocular distances from frame to frame, beyond which it is another face
_GAP = 0.15  # s that a face may be lost without being gone: a blink of the tracker
_FADE = 0.3  # s over which a change comes and goes
# Degrees that a head is turned sideways: from where on less of a change is made, and none.
_TURNED = (50.0, 70.0)
_UNSURE = (0.5, 0.8)  # presence at which nothing of a change is made, and all
_INSIDE = (0.55, 0.8)  # share of the landmarks on the picture at which nothing is made, and all
_SIDES = (234, 454)  # rows of the mesh: before the right ear, and before the left


@dataclass(frozen=True, eq=False)
class Track:
    """The face in every frame of a clip, or of a part of it.

    Attributes
    ----------
    pts : (n,) int64 array
        Time stamps, in ticks of the clip.
    times : (n,) float64 array
        The same in s from the first of them.
    points : (n, 478, 3) float32 array
        Landmarks as they were found, in px of the upright frames; those that were not are as before.
    presence : (n,) float32 array
        How sure it is that there is a face; 0 where none was found.
    yaw : (n,) float32 array
        By how many degrees the head is turned sideways, to either side.
    inside : (n,) float32 array
        Share of the landmarks that lie on the picture.
    starts : list of int
        Where shots begin.
    """

    pts: NDArray[np.int64]
    times: NDArray[np.float64]
    points: NDArray[np.float32]
    presence: NDArray[np.float32]
    yaw: NDArray[np.float32]
    inside: NDArray[np.float32]
    starts: list[int]

    def __len__(self) -> int:
        """Return the number of frames."""
        return len(self.pts)

    @cached_property
    def shots(self) -> list[slice]:
        """The frames of each shot."""
        return [slice(*ends) for ends in zip(self.starts, [*self.starts[1:], len(self)], strict=True)]

    def shot_of(self, number: int) -> slice:
        """Return the frames of the shot that a frame is in."""
        return self.shots[int(np.searchsorted(self.starts, number, "right")) - 1]

    @cached_property
    def shares(self) -> NDArray[np.float64]:
        """How much of a change a frame takes, 0 to 1: less where a face comes, goes or turns."""
        made = np.zeros(len(self))
        for shot in self.shots:
            times, presence = self.times[shot], self.presence[shot]
            seen = filled(presence > 0, times, _GAP)
            sure = np.where(presence > 0, _rising(presence, *_UNSURE), 1.0)
            turned = 1 - _rising(self.yaw[shot], *_TURNED)
            there = _rising(self.inside[shot], *_INSIDE)
            made[shot] = faded(seen * np.minimum.reduce([sure, turned, there]), times, _FADE)
        return made


def _rising(values: NDArray[Any], low: float, high: float) -> NDArray[np.float64]:
    return np.clip((np.asarray(values, np.float64) - low) / (high - low), 0, 1)


def track(
    clip: Clip,
    first: float | None,
    last: float | None,
    face: int,
    folder: Path,
    told: Callable[[float], None] = lambda _seconds: None,
) -> Track:
    """Find the face in every frame of a clip, from one time to another; or read what was found before.

    Raises
    ------
    ImageError
        If the clip cannot be decoded, or has no frame then.
    FaceNotFoundError
        If there is no face in any frame.
    """
    done, points = folder / "track.npz", folder / "points.f32"
    if not done.exists():
        _find(clip, first, last, face, folder, told)
    with np.load(done) as kept:
        found = {name: kept[name] for name in kept.files}
    shape = (len(found["pts"]), 478, 3)
    if not shape[0]:
        raise ImageError(f"{clip.path}: has no frame in the time asked for; look at --from and --to")
    if not found["presence"].any():
        which = f" {face} (counted from 0, the largest first)" if face else ""
        raise FaceNotFoundError(
            f"{clip.path}: no face{which} found in any frame; use a video with a larger, upright face turned "
            "no more than 75°"
        )
    ticks = found["pts"] - found["pts"][0]
    return Track(
        pts=found["pts"],
        times=ticks * float(clip.time_base),
        points=np.memmap(points, np.float32, "r", shape=shape),
        presence=found["presence"],
        yaw=found["yaw"],
        inside=found["inside"],
        starts=found["starts"].tolist(),
    )


def _find(
    clip: Clip,
    first: float | None,
    last: float | None,
    face: int,
    folder: Path,
    told: Callable[[float], None],
) -> None:
    """Go through the frames once, and keep what is found in a folder."""
    pts: list[int] = []
    facts: list[tuple[float, float, float]] = []
    signatures: list[NDArray[np.float16]] = []
    leaps: list[int] = []
    here: Landmarks | None = None
    before = np.zeros((478, 3), np.float32)
    looked = -np.inf
    with (folder / "points.f32").open("wb") as file:
        for number, frame in enumerate(frames(clip, first, last)):
            pixels = to_rgb(frame, small=True)
            time = float(frame.pts * clip.time_base)
            colors = signature(pixels)
            cut = bool(number) and apart(colors, signatures[-1].astype(np.float32)) > JUMP
            known = None if cut else here
            here = follow(pixels, known) if known else None
            if here and known and _leapt(known, here):
                here = None
            if cut or time - looked >= (_RETRY if here is None else _STRIDE):
                looked = time
                here = nearest_face(pixels, here or known, face) or here
                if here and known and _leapt(known, here):
                    leaps.append(number)
            if here:
                before = here.points.astype(np.float32)
            file.write(before.tobytes())
            pts.append(int(frame.pts))
            facts.append(_facts(here, pixels.shape))
            signatures.append(colors.astype(np.float16))
            told(time - float(pts[0] * clip.time_base))
    cuts = find_cuts(np.array(signatures)) if pts else []
    temporary = folder / "track.tmp.npz"
    presence, yaw, inside = np.array(facts, np.float32).reshape(-1, 3).T
    np.savez(
        temporary,
        pts=np.array(pts, np.int64),
        presence=presence,
        yaw=yaw,
        inside=inside,
        starts=np.array(sorted({0, *cuts, *leaps}) if pts else [], np.int64),
    )
    temporary.replace(folder / "track.npz")


def _facts(face: Landmarks | None, shape: tuple[int, ...]) -> tuple[float, float, float]:
    """Return how sure a face is, by how many degrees it is turned, and how much of it is on the picture."""
    if face is None:
        return 0.0, 0.0, 1.0
    across = face.points[_SIDES[1]] - face.points[_SIDES[0]]
    yaw = float(np.degrees(np.arctan2(abs(across[2]), np.hypot(*across[:2]))))
    inside = np.all((face.xy >= -0.5) & (face.xy <= np.array(shape[1::-1]) - 0.5), axis=1)
    return float(face.confidence or 0), yaw, float(inside.mean())


def _leapt(before: Landmarks, here: Landmarks) -> bool:
    """Whether a face is too far from where it was to be the same."""
    away = float(np.linalg.norm(here.xy.mean(axis=0) - before.xy.mean(axis=0)))
    ratio = here.interocular_distance / before.interocular_distance
    return away > _LEAP * before.interocular_distance or not 0.7 < ratio < 1.4
