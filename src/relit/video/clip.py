"""A video file: what it holds, and its frames one after the other."""

from __future__ import annotations

from contextlib import contextmanager
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, Any

from relit.errors import ImageError, OptionError

if TYPE_CHECKING:
    from collections.abc import Iterator

    import av
    from av.container import InputContainer

#: Names by which files are taken for videos; all else is a photo.
SUFFIXES = (".mp4", ".m4v", ".mov", ".mkv", ".webm", ".avi", ".mxf", ".mpg", ".mpeg", ".ts", ".m2ts", ".ogv")

_WIDE = {16: "PQ", 18: "HLG"}  # transfer characteristics of ITU-T H.273 that no photo has
_SHORT = (
    0.5  # s by which whole files may be shorter than they say: packets that do not tell how long they last
)
_LEAST = 16  # px
#: A picture of a cover lies in a file as a video of one frame, of this disposition.
COVER = 0x400


def is_video(path: str) -> bool:
    """Return whether a file is taken for a video, by its name.

    Examples
    --------
    >>> is_video("holiday.MOV"), is_video("holiday.jpg")
    (True, False)
    """
    return Path(path).suffix.lower() in SUFFIXES


@dataclass(frozen=True)
class Clip:
    """What a video file holds.

    Attributes
    ----------
    path : str
    codec : str
        FFmpeg's name of the codec.
    width, height : int
        As stored, before it is turned.
    pix_fmt : str
        FFmpeg's name of how pixels are stored.
    rate : Fraction
        Frames a second, on average.
    time_base : Fraction
        Seconds of a tick of its time stamps.
    seconds : float or None
        How long it is, if the file says.
    pixel_aspect : Fraction or None
        How wide a pixel is for its height.
    start : float
        The file's first time stamp in seconds: what its times are told from.
    """

    path: str
    codec: str
    width: int
    height: int
    pix_fmt: str
    rate: Fraction
    time_base: Fraction
    seconds: float | None
    pixel_aspect: Fraction | None
    start: float


def need_av() -> None:
    """Refuse to go on without PyAV."""
    try:
        import av  # noqa: F401
    except ImportError:
        raise OptionError("video: PyAV is not installed; run pip install 'relit[video]'") from None


@contextmanager
def opened(path: str) -> Iterator[InputContainer]:
    """Open a video file, and close it again; what FFmpeg says of it comes as an `ImageError`."""
    import av

    try:
        container = av.open(path, metadata_errors="replace")
    except (OSError, av.FFmpegError, ValueError) as error:
        raise ImageError(f"{path}: {_reason(path, error)}") from None
    try:
        yield container
    except av.FFmpegError as error:
        raise ImageError(
            f"{path}: cannot be decoded ({error.strerror}); mend the file, or take part of it by --from and "
            "--to"
        ) from None
    finally:
        container.close()


def _reason(path: str, error: Exception) -> str:
    if not Path(path).exists():
        return "there is no such file; check the name"
    if Path(path).is_dir():
        return "is a folder; give a video file"
    told = getattr(error, "strerror", None) or error
    return f"is no video that can be read, or is cut off ({told}); give a whole video file"


def video_stream(container: InputContainer, path: str) -> av.VideoStream:
    """Return the stream of a file that is its film."""
    streams = [one for one in container.streams.video if not int(one.disposition) & COVER]
    if not streams:
        raise ImageError(f"{path}: holds no video; give a video file")
    stream = streams[0]
    stream.thread_type = "AUTO"
    return stream


def look_at(path: str) -> Clip:
    """Return what a video file holds.

    Raises
    ------
    ImageError
        If it cannot be read, holds no video, or one that is too small or in a wide dynamic range.
    """
    need_av()
    with opened(path) as container:
        if container.format.name.endswith(("_pipe", "image2")):
            raise ImageError(f"{path}: is a photo; relight it by relit transfer")
        stream = video_stream(container, path)
        context = stream.codec_context
        if context.pix_fmt is None or min(context.width, context.height) < _LEAST:
            raise ImageError(
                f"{path}: expected a video of {_LEAST} px a side or more, found "
                f"{context.width}x{context.height}; give a larger one"
            )
        if (curve := _WIDE.get(int(context.color_trc))) is not None:
            raise ImageError(
                f"{path}: is in a high dynamic range ({curve}), whose values are no brightness that a photo "
                "has; convert it to SDR first"
            )
        seconds = container.duration / 1e6 if container.duration else None
        start = stream.start_time or 0
        return Clip(
            path=path,
            codec=context.name,
            width=context.width,
            height=context.height,
            pix_fmt=context.pix_fmt,
            rate=stream.average_rate or stream.guessed_rate or Fraction(25),
            time_base=Fraction(stream.time_base or Fraction(1, 1000)),
            seconds=seconds,
            pixel_aspect=stream.sample_aspect_ratio or None,
            start=float(start * (stream.time_base or 0)),
        )


def frames(clip: Clip, first: float | None = None, last: float | None = None) -> Iterator[Any]:
    """Decode the frames of a clip from one time, in s from its start, to another.

    Raises
    ------
    ImageError
        If a frame cannot be decoded, has another size than the first, is interlaced, or is not later than the
        one before.
    """
    before: int | None = None
    for frame in _decoded(clip, first):
        if frame.pts is None:
            raise ImageError(f"{clip.path}: has frames without a time; mend the file by remuxing it")
        time = _time_of(frame, clip)
        if first and time < first - 1e-6:
            continue
        if last is not None and time >= last - 1e-6:
            return
        if before is not None and frame.pts <= before:
            raise ImageError(
                f"{clip.path}: its times run backward at {time:.2f} s, as those of H.264 in AVI do; convert "
                "it to MP4 first"
            )
        before = frame.pts
        if (frame.width, frame.height) != (clip.width, clip.height):
            raise ImageError(
                f"{clip.path}: its frames turn from {clip.width}x{clip.height} to "
                f"{frame.width}x{frame.height} px at {time:.2f} s; take the parts one by one, by --from and "
                "--to"
            )
        if frame.interlaced_frame:
            raise ImageError(f"{clip.path}: is interlaced; deinterlace it first")
        yield frame


def _time_of(frame: Any, clip: Clip) -> float:
    return float(frame.pts * clip.time_base) - clip.start


def _decoded(clip: Clip, first: float | None) -> Iterator[Any]:
    """Decode the frames from a time on, and some before it."""
    for seeks in (True, False) if first else (False,):
        with opened(clip.path) as container:
            stream = video_stream(container, clip.path)
            if first and seeks:
                container.seek(int((first + clip.start) / clip.time_base), stream=stream, backward=True)
            found = container.decode(stream)
            begin = next(found, None)
            # Formats without an index, as MPEG-TS, may end up later than they were sent: then all is decoded.
            if first and seeks and (begin is None or begin.pts is None or _time_of(begin, clip) > first):
                continue
            if begin is not None:
                yield begin
                yield from found
            return


def missing_end(clip: Clip) -> float:
    """Return by how many s a clip is shorter than its head says, as where its file is cut off; or 0.

    Formats whose head says nothing, as MPEG-TS, are as long as what is there.
    """
    if clip.seconds is None:
        return 0.0
    end = 0.0
    with opened(clip.path) as container:
        begin = (container.start_time or 0) / 1e6
        for packet in container.demux():
            if packet.pts is not None and packet.time_base:
                end = max(end, float((packet.pts + (packet.duration or 0)) * packet.time_base) - begin)
    short = clip.seconds - end
    return short if short > _SHORT else 0.0


class Cursor:
    """A reader of single frames by their number, which are asked for mostly in their order."""

    def __init__(self, clip: Clip, first: float | None, last: float | None) -> None:
        self._given = clip, first, last
        self._restart()

    def _restart(self) -> None:
        self._frames, self._next = frames(*self._given), 0

    def __call__(self, number: int) -> Any:
        """Return a frame."""
        if number < self._next:
            self._restart()
        for frame in self._frames:
            self._next += 1
            if self._next == number + 1:
                return frame
        raise ImageError(f"{self._given[0].path}: ends before its frame {number}; was it changed meanwhile?")
