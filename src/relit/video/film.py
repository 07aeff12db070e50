"""Relight the face in a video, in three passes: where it is, what its light becomes, and every frame.

1. *Track* the face in every frame, and find where the film is cut.
2. *Light* key frames as photos are, and take what changes to a frame that moves with the face.
3. *Render* every frame with the change of its time, encode it, and join it with the sound.

What was done is kept in a folder beside the film until it is whole; whoever starts again goes on there.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from relit._version import VERSION
from relit.errors import OptionError, OutputError
from relit.photo.atomic_files import check_free, put_in_place
from relit.runtime.opencv import one_opencv_thread
from relit.runtime.threads import available, limit, pool
from relit.video.clip import look_at, missing_end
from relit.video.encoding import Settings
from relit.video.joining import join
from relit.video.lights import Lights, Moving, Still
from relit.video.pixels import put_change, to_rgb, writable
from relit.video.rendering import relit
from relit.video.segments import confidence_of, encode
from relit.video.state import kept_state, print_of, stamp_of
from relit.video.tracked_clip import TrackedClip
from relit.video.tracking import track

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from relit.face.landmarks import Landmarks
    from relit.settings.options import TransferOptions
    from relit.video.clip import Clip

    Part = tuple[float | None, float | None]

_SEGMENT = 120  # frames after which work is kept
_AHEAD = 2  # frames that a thread has in work or waiting, so that memory is bounded


@dataclass(frozen=True)
class Progress:
    """How far a film is: the pass, and frames, or s of the clip, that are done of so many."""

    step: str
    done: float
    total: float


@dataclass(frozen=True, eq=False)
class Film:
    """What was made of a video.

    Attributes
    ----------
    frames : int
    lit : int
        Frames in which the face is relit.
    shots : int
    confidence : float
        The least of the key frames': as of `TransferResult.confidence`.
    not_kept : list of str
        What of the clip the film does not hold.
    missing_seconds : float
        By how many s the clip is shorter than it says, as a file is that was cut off; 0 for a whole one.
    """

    frames: int
    lit: int
    shots: int
    confidence: float
    not_kept: list[str]
    missing_seconds: float


@one_opencv_thread()
def relight_video(
    path: str,
    output: str,
    options: TransferOptions,
    *,
    references: Sequence[Any] = (),
    reference_landmarks: Sequence[Landmarks] = (),
    reference_video: str | None = None,
    reference_face: int = 0,
    loops: bool = False,
    part: Part = (None, None),
    face: int = 0,
    codec: str | None = None,
    crf: int | None = None,
    overwrite: bool = False,
    tell: Callable[[Progress], None] = lambda _progress: None,
) -> Film:
    """Relight the face in a video file, and write it as another.

    Parameters
    ----------
    path, output : str
        Names of the files. Size, time stamps, colour tags, depth, sound and subtitles are those of the first.
    options : TransferOptions
        How to relight.
    references, reference_landmarks : sequences, optional
        Photos, as of `relit.transfer`, and the faces in them.
    reference_video : str, optional
        A video whose light at the same time goes over, instead.
    reference_face : int
        Which face of that, as of `face`.
    loops : bool
        Whether a shorter one begins anew; else the last of its light stays.
    part : (float or None, float or None)
        From when to when, in s from the start.
    face : int
        Which face, 0 being the largest, where it is first seen in a shot.
    codec, crf : optional
        As of `encoding.Settings`.
    overwrite : bool
        Whether the second file may be replaced.
    tell : callable, optional
        Is told how far it is.

    Returns
    -------
    Film

    Raises
    ------
    ImageError, FaceNotFoundError, OptionError, OutputError
        If a file cannot be read, has no face, an option is out of range, or the film cannot be written.
    """
    _check(path, output, reference_video, part, options)
    clip = look_at(path)
    other = look_at(reference_video) if reference_video else None
    settings = Settings.of(output, clip, codec, crf)
    # A link that may be overwritten is followed at once: what is kept lies on the disk of the film.
    place = Path(output).resolve() if overwrite else Path(output)
    check_free(place, overwrite=overwrite)
    given = [VERSION, path, part, face, asdict(options), asdict(settings), reference_video]
    given += [reference_face, loops]
    given += [print_of(one) for one in (*references, *reference_landmarks)]
    given += [stamp_of(one) for one in (path, reference_video) if one]
    with kept_state(place, given) as folder:
        telling = _passing("Tracking", _length(clip, part), tell)
        tracked = TrackedClip.of(clip, part, track(clip, *part, face, folder, telling))
        source: Still | Moving = Still(list(references), list(reference_landmarks))
        if other:
            beside = folder / "reference"
            beside.mkdir(exist_ok=True)
            telling = _passing("Tracking the reference", other.seconds or 0.0, tell)
            theirs = track(other, None, None, reference_face, beside, telling)
            source = Moving(TrackedClip.of(other, (None, None), theirs), loops=loops)
        lights = Lights(tracked, source, options)
        segments = _Rendering(tracked, lights, options, settings, tell).segments(folder)
        confidence = min(map(confidence_of, segments))
        made = folder / f"film{place.suffix.lower()}"
        lost = join(made, segments, tracked, settings, place)
        put_in_place(made, place, overwrite=overwrite)
    return Film(
        frames=len(tracked.track),
        lit=int((tracked.track.shares > 0).sum()),
        shots=len(tracked.track.starts),
        confidence=confidence,
        not_kept=lost,
        missing_seconds=missing_end(clip) if part[1] is None else 0.0,
    )


class _Rendering:
    """Pass 3."""

    def __init__(
        self,
        tracked: TrackedClip,
        lights: Lights,
        options: TransferOptions,
        settings: Settings,
        tell: Callable[[Progress], None],
    ) -> None:
        self._tracked, self._lights, self._options = tracked, lights, options
        self._settings, self._tell, self._cursor = settings, tell, tracked.cursor()

    def segments(self, folder: Path) -> list[Path]:
        """Make all segments that are not there yet."""
        paths = []
        count = len(self._tracked.track)
        for first in range(0, count, _SEGMENT):
            last = min(first + _SEGMENT, count)
            paths.append(folder / f"{first:09}.segment")
            if not paths[-1].exists():
                self._lights.prepare(first, last)
                encode(
                    paths[-1],
                    self._frames(first, last),
                    self._settings,
                    self._tracked.clip,
                    self._lights.confidence,
                )
        return paths

    def _frames(self, first: int, last: int) -> Iterator[Any]:
        """Return the relit frames from one number to another, in order; several are worked on at once."""
        space, together = self._lights.space, available()

        def work(given: tuple[int, Any, Any]) -> Any:
            return self._relit(*given, space)

        with limit(1), pool(together) as run:
            for start in range(first, last, together * _AHEAD):
                numbers = range(start, min(start + together * _AHEAD, last))
                given = [(number, self._cursor(number), self._light(number)) for number in numbers]
                yield from run(work, given)
                self._tell(Progress("Relighting", numbers.stop, len(self._tracked.track)))

    def _light(self, number: int) -> Any:
        return self._lights.at(number) if self._tracked.track.shares[number] > 0 else None

    def _relit(self, number: int, picture: Any, light: Any, space: Any) -> Any:
        if light is None:
            return writable(picture)
        pixels = to_rgb(picture)
        landmarks = self._tracked.steady.landmarks(number)
        share = float(self._tracked.track.shares[number])
        after = relit(pixels, landmarks, self._tracked.frame, light, share, space, self._options)
        return put_change(picture, pixels, after)


def _check(path: str, output: str, reference: str | None, part: Part, options: TransferOptions) -> None:
    first, last = part
    if first is not None and first < 0:
        raise OptionError(f"from: expected 0 s or more, got {first:g}")
    if last is not None and last <= (first or 0):
        raise OptionError(f"to: expected more than {first or 0:g} s, where it begins, got {last:g}")
    if not options.mask:
        raise OptionError("mask: a video is relit with it; leave --no-mask out")
    for given in (path, *([reference] if reference else [])):
        if Path(output).exists() and Path(given).exists() and Path(output).samefile(given):
            raise OutputError(f"{output}: is a video that is read; choose another name")


def _passing(step: str, total: float, tell: Callable[[Progress], None]) -> Callable[[float], None]:
    return lambda seconds: tell(Progress(step, seconds, total))


def _length(clip: Clip, part: Part) -> float:
    last = clip.seconds or 0.0
    return max(min(part[1] or last, last) - (part[0] or 0.0), 0.0)
