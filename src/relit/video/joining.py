"""Segments into a film, with the sound, subtitles, chapters and metadata of the clip, copied bit for bit."""

from __future__ import annotations

import errno
import itertools
from fractions import Fraction
from typing import TYPE_CHECKING, Any

from relit.errors import OutputError
from relit.video.clip import COVER, frames, opened, video_stream
from relit.video.encoding import decode_times, set_up
from relit.video.pixels import has_alpha, writable
from relit.video.segments import read_segment

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator
    from pathlib import Path

    from relit.video.clip import Clip
    from relit.video.encoding import Settings
    from relit.video.tracked_clip import TrackedClip

# What a file says of itself, and not of the film.
_OWN = {"major_brand", "minor_version", "compatible_brands", "encoder", "duration", "alpha_mode"}
_BITEXACT = 0x400  # of a container: no times and numbers at random, so that the same film has the same bytes


def join(
    path: Path, segments: Iterable[Path], tracked: TrackedClip, settings: Settings, named: Path
) -> list[str]:
    """Write segments, and what goes with them, as one file; return what of the clip it does not hold.

    Parameters
    ----------
    path : Path
    segments : paths
        Of all frames that were tracked.
    tracked : TrackedClip
        Where only a part of it is, the film begins with 0.
    settings : Settings
    named : Path
        What messages call the film.
    """
    import av

    clip, part, pts = tracked.clip, tracked.part, tracked.track.pts.tolist()
    with opened(clip.path) as source:
        lost: list[str] = []
        shift = Fraction(pts[0]) * clip.time_base if part[0] else Fraction(0)
        try:
            with av.open(str(path), "w", format=settings.muxer, options=_options(settings)) as film:
                film.flags |= _BITEXACT
                original = next(iter(frames(clip, *part)))
                first = writable(original)
                video: Any = film.add_stream(settings.encoder, rate=clip.rate)
                set_up(video.codec_context, settings, clip, first)
                video.time_base = clip.time_base
                theirs = video_stream(source, clip.path)
                video.metadata.update(_of(theirs.metadata))
                video.disposition = theirs.disposition
                if original.rotation:
                    video.set_display_rotation(original.rotation)
                if _loses_alpha(first, settings) or theirs.metadata.get("alpha_mode") == "1":
                    lost.append("transparency")
                copies = _copied_streams(source, film, theirs, lost)
                film.metadata.update(_of(source.metadata))
                film.set_chapters(_chapters(source, shift, part, clip))  # type: ignore[arg-type]
                film.start_encoding()
                shown = _video_packets(segments, pts, video, clip, original, shift)
                others = _other_packets(source, copies, shift, part, clip)
                for packet in _in_order(shown, others):
                    film.mux_one(packet)
        except (av.FFmpegError, OSError) as error:
            full = error.errno in (errno.ENOSPC, errno.EFBIG, errno.EDQUOT, errno.EIO)
            how = "a place with more room" if full else "a name in .mkv, which holds most"
            raise OutputError(
                f"{named}: cannot be written ({error.strerror or error}); choose {how}"
            ) from error
    return lost


def _loses_alpha(frame: Any, settings: Settings) -> bool:
    return has_alpha(frame) and "yuva" not in settings.stored_as(frame)


def _options(settings: Settings) -> dict[str, str]:
    return {"movflags": "+faststart"} if settings.muxer in ("mp4", "mov") else {}


def _of(metadata: dict[str, str]) -> dict[str, str]:
    return {name: told for name, told in metadata.items() if name.lower() not in _OWN}


def _copied_streams(source: Any, film: Any, video: Any, lost: list[str]) -> dict[int, Any]:
    """Add streams like those of the source that the film's kind of file can hold: their numbers → streams."""
    copies, chapters = {}, len(source.chapters())
    for stream in source.streams:
        if stream.index == video.index:
            continue
        if stream.type == "attachment" and film.format.name == "matroska":
            film.add_attachment(stream.name, stream.mimetype, stream.data)
            continue
        if stream.type == "data" and chapters and stream.frames == chapters:
            continue  # the titles of chapters, which MP4 also keeps as a track
        name = stream.codec_context.name if stream.codec_context else "unknown"
        codec = getattr(getattr(stream.codec_context, "codec", None), "canonical_name", name)
        if stream.type not in ("audio", "subtitle") or codec not in film.supported_codecs:
            cover = stream.type == "video" and int(stream.disposition) & COVER
            lost.append(f"the cover ({name})" if cover else f"a stream of {stream.type} ({name})")
            continue
        copies[stream.index] = film.add_stream_from_template(stream)
        copies[stream.index].metadata.update(_of(stream.metadata))
        copies[stream.index].disposition = stream.disposition
    return copies


def _chapters(
    source: Any, shift: Fraction, part: tuple[float | None, float | None], clip: Clip
) -> list[dict[str, Any]]:
    kept = []
    end = None if part[1] is None else Fraction(part[1] + clip.start)
    for chapter in source.chapters():
        base = chapter["time_base"]
        first, last = (chapter[name] * base for name in ("start", "end"))
        last = last if end is None else min(last, end)
        if max(first, shift) < last:
            times = {"start": int((max(first, shift) - shift) / base), "end": int((last - shift) / base)}
            kept.append({**chapter, **times})
    return kept


def _video_packets(
    segments: Iterable[Path], pts: list[int], stream: Any, clip: Clip, first: Any, shift: Fraction
) -> Iterator[Any]:
    import av

    order = [one.pts for path in segments for one in read_segment(path)]
    times = decode_times(order)
    lasts = {tick: after - tick for tick, after in itertools.pairwise(pts)}
    usual = int(first.duration or round(1 / (clip.rate * clip.time_base)))
    away, place = int(shift / clip.time_base), 0
    for path in segments:
        for one in read_segment(path):
            packet = av.Packet(one.data)
            packet.pts, packet.dts = one.pts - away, times[place] - away
            packet.duration = lasts.get(one.pts, usual)
            packet.time_base, packet.is_keyframe, packet.stream = clip.time_base, one.is_key, stream
            place += 1
            yield packet


def _other_packets(
    source: Any,
    copies: dict[int, Any],
    shift: Fraction,
    part: tuple[float | None, float | None],
    clip: Clip,
) -> Iterator[Any]:
    streams = [source.streams[number] for number in copies]
    if not streams:
        return
    end = None if part[1] is None else Fraction(part[1] + clip.start)
    for packet in source.demux(*streams):
        time = packet.pts if packet.pts is not None else packet.dts
        if packet.size == 0 or time is None:
            continue
        if packet.stream.type == "subtitle" and packet.pts is not None and packet.duration:
            _cut(packet, shift if part[0] else None, end)
            time = packet.pts
        seconds = time * packet.time_base
        if part[0] and seconds < shift:
            continue
        if end is not None and seconds >= end:
            continue
        away = int(shift / packet.time_base)
        packet.pts = None if packet.pts is None else packet.pts - away
        packet.dts = None if packet.dts is None else packet.dts - away
        packet.stream = copies[packet.stream_index]
        yield packet


def _cut(packet: Any, start: Fraction | None, end: Fraction | None) -> None:
    """Show words that are on the screen at an end of the film no longer than it."""
    first, last = packet.pts, packet.pts + packet.duration
    if start is not None and first < (begin := round(start / packet.time_base)) < last:
        first = begin
    if end is not None and first < (stop := round(end / packet.time_base)) < last:
        last = stop
    packet.pts = packet.dts = first
    packet.duration = last - first


def _in_order(one: Iterator[Any], other: Iterator[Any]) -> Iterator[Any]:
    """Return the packets of two, by when they are decoded."""

    def when(packet: Any) -> Fraction:
        time = packet.dts if packet.dts is not None else packet.pts
        return Fraction(time * packet.time_base)

    here, there = next(one, None), next(other, None)
    while here is not None or there is not None:
        if there is None or (here is not None and when(here) <= when(there)):
            yield here
            here = next(one, None)
        else:
            yield there
            there = next(other, None)
