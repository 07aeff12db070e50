"""Frames into packets: which codec, and how good.

Encoders get a fixed number of threads, since what they write depends on it.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, get_args

from relit.errors import OptionError, OutputError
from relit.video.pixels import bits_of

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from relit.video.clip import Clip

CodecName = Literal["h264", "h265", "vp9", "prores"]
CODECS: tuple[str, ...] = get_args(CodecName)

_THREADS = 4
_ENCODERS = {"h264": "libx264", "h265": "libx265", "vp9": "libvpx-vp9", "prores": "prores_ks"}
_OF_INPUT = {"h264": "h264", "hevc": "h265", "vp9": "vp9", "prores": "prores"}
#: What each kind of file may hold, the first being what it holds if the clip's own codec is none of them.
CONTAINERS: dict[str, tuple[str, tuple[CodecName, ...]]] = {
    ".mp4": ("mp4", ("h264", "h265", "vp9")),
    ".m4v": ("mp4", ("h264", "h265")),
    ".mov": ("mov", ("h264", "h265", "prores")),
    ".mkv": ("matroska", ("h264", "h265", "vp9", "prores")),
    ".webm": ("webm", ("vp9",)),
}
# Nobody sees a difference from what was decoded at these, by eye on faces at 100 %.
_CRF = {"h264": 17, "h265": 19, "vp9": 22}
_MOST_CRF = {"h264": 51, "h265": 51, "vp9": 63}
_PROFILES = {"yuv422p10le": "3", "yuv444p10le": "4", "yuva444p10le": "4"}  # ProRes HQ and 4444


@dataclass(frozen=True)
class Settings:
    """How a film is encoded.

    Attributes
    ----------
    codec : str
        One of `CODECS`.
    crf : int or None
        The constant rate factor; None of a codec that has none.
    muxer : str
        FFmpeg's name of the kind of file.
    """

    codec: str
    crf: int | None
    muxer: str

    @classmethod
    def of(cls, output: str, clip: Clip, codec: str | None, crf: int | None) -> Settings:
        """Return the settings for a file of some name, that keep a clip's own codec where they can.

        Raises
        ------
        OutputError
            If the name ends in nothing that is known.
        OptionError
            If such a file cannot hold the codec, or the factor is out of range.
        """
        suffix = Path(output).suffix.lower()
        if suffix not in CONTAINERS:
            raise OutputError(
                f"{output}: expected a name in {', '.join(CONTAINERS)}, got {suffix or 'none'}; choose one"
            )
        muxer, held = CONTAINERS[suffix]
        if codec is None:
            own = _OF_INPUT.get(clip.codec)
            codec = own if own in held else held[0]
        if codec not in held:
            raise OptionError(
                f"codec: a {suffix} file holds {' or '.join(held)}, got {codec!r}; choose one of them"
            )
        if crf is not None and codec not in _CRF:
            raise OptionError(f"crf: {codec} has none; leave it out")
        if crf is not None and not 0 <= crf <= _MOST_CRF[codec]:
            raise OptionError(f"crf: expected 0 to {_MOST_CRF[codec]} with {codec}, got {crf}")
        return cls(codec, _CRF.get(codec) if crf is None else crf, muxer)

    @property
    def encoder(self) -> str:
        """FFmpeg's name of the encoder."""
        return _ENCODERS[self.codec]

    def stored_as(self, frame: Any) -> str:
        """Return the format of pixels that keeps most of a frame's, of those that the encoder takes."""
        import av

        known = {one.name for one in av.codec.Codec(self.encoder, "w").video_formats or ()}
        own = frame.format.name.replace("yuvj", "yuv")
        if (frame.width % 2 or frame.height % 2) and self.codec in ("h264", "h265"):
            # These take halved chroma of even sides alone.
            known = {one for one in known if "444" in one or one.startswith("gray")}
            own = own.replace("420", "444").replace("422", "444")
        if own in known:
            return str(own)
        deep = "10le" if bits_of(frame) > 8 or self.codec == "prores" else ""
        chroma = next((one for one in ("444", "422") if one in own), "420")
        alpha = (f"yuva{chroma}p{deep}",) if own.startswith("yuva") else ()
        wanted = (
            *alpha,
            f"yuv{chroma}p{deep}",
            f"yuv422p{deep}",
            f"yuv420p{deep}",
            f"yuv444p{deep}",
            "yuv420p",
            "yuv444p",
        )
        return str(next(one for one in wanted if one in known))


def set_up(context: Any, settings: Settings, clip: Clip, frame: Any) -> None:
    """Give an encoder what the clip has: size, rate, ticks, shape of pixels and tags of colours."""
    context.width, context.height = clip.width, clip.height
    context.pix_fmt = settings.stored_as(frame)
    context.time_base, context.framerate = clip.time_base, clip.rate
    if clip.pixel_aspect:
        context.sample_aspect_ratio = clip.pixel_aspect
    context.color_primaries, context.color_trc = int(frame.color_primaries), int(frame.color_trc)
    context.colorspace = int(frame.colorspace)
    context.color_range = _range_of(frame)
    context.thread_count = _THREADS
    # The factor 0 by itself is without loss in H.264 of 8 bits alone.
    lossless = settings.crf == 0
    options: dict[str, str] = {}
    if settings.crf is not None:
        options |= {"qp": "0"} if lossless and settings.codec == "h264" else {"crf": str(settings.crf)}
    if settings.codec in ("h264", "h265"):
        options["preset"] = "fast"
    if settings.codec == "h264":
        # Its macroblock tree reads memory that it never wrote: the same frames would give other bytes.
        options["x264-params"] = "mbtree=0"
    if settings.codec == "h265":
        options["x265-params"] = f"log-level=error:frame-threads=2:pools={_THREADS}:lossless={lossless:d}"
        context.codec_tag = "hvc1" if settings.muxer in ("mp4", "mov") else context.codec_tag
    if settings.codec == "vp9":
        options |= {"b": "0", "row-mt": "0", "cpu-used": "3", "deadline": "good"}
        options |= {"lossless": "1"} if lossless else {}
    if settings.codec == "prores":
        options["profile"] = _PROFILES.get(context.pix_fmt, "3")
    context.options = options


def _range_of(frame: Any) -> int:
    return 2 if frame.format.name.startswith("yuvj") else int(frame.color_range)


def as_stored(frame: Any, settings: Settings) -> Any:
    """Return a frame in the format that the encoder takes; most are as they are."""
    wanted = settings.stored_as(frame)
    if frame.format.name == wanted:
        return frame
    span = "JPEG" if _range_of(frame) == 2 else "MPEG"
    made = frame.reformat(format=wanted, src_color_range=span, dst_color_range=span, threads=1)
    made.pts = frame.pts
    return made


def encoded(pictures: Iterable[Any], settings: Settings, clip: Clip) -> Iterator[Any]:
    """Encode frames, one or more, such as `writable` returns, into packets that can be decoded alone."""
    import av

    context: Any = None
    for frame in pictures:
        stored = as_stored(frame, settings)
        if context is None:
            context = av.CodecContext.create(settings.encoder, "w")
            set_up(context, settings, clip, frame)
            context.flags |= 1 << 22  # parameter sets beside the packets, as files of these kinds have them
        stored.pict_type = 0
        yield from context.encode(stored)
    yield from context.encode(None)


def decode_times(pts: list[int]) -> list[int]:
    """Return when packets are to be decoded, by when they are to be shown: in order, and none too late.

    Examples
    --------
    >>> decode_times([0, 3, 1, 2])
    [-1, 0, 1, 2]
    """
    order = sorted(pts)
    # Ticks are unlike in length where frames come unevenly; so places are moved, and not times.
    places = {tick: place for place, tick in enumerate(order)}
    lag = max((place - places[tick] for place, tick in enumerate(pts)), default=0)
    step = order[1] - order[0] if len(order) > 1 else 1
    before = [order[0] - step * k for k in range(lag, 0, -1)] if order else []
    return (before + order)[: len(order)]
