"""Tiny clips, made by PyAV: a face that moves, with a tone, subtitles and chapters."""

from fractions import Fraction

import av
import cv2
import numpy as np

from relit.photo.reading import read_image
from relit.photo.samples import sample

TAGS = {"color_primaries": 1, "color_trc": 1, "colorspace": 1, "color_range": 1}


def face(side=128):
    """A photo of a face, upright."""
    pixels = read_image(sample("target")).pixels[30:230, 130:330]
    return cv2.resize(pixels, (side, side), interpolation=cv2.INTER_AREA)


def moving(count=12, side=128, step=1.0):
    """The face, going to the right by so many px a frame."""
    return [
        cv2.warpAffine(
            face(side),
            np.float32([[1, 0, step * k], [0, 1, 0]]),
            (side, side),
            borderMode=cv2.BORDER_REPLICATE,
        )
        for k in range(count)
    ]


def make(
    path,
    pictures,
    codec="libx264",
    pix_fmt="yuv420p",
    times=None,
    tick=Fraction(1, 12800),
    sound=None,
    subtitles=None,
    tags=TAGS,
    aspect=None,
    turned=0,
    chapters=(),
    options=None,
    muxer=None,
):
    """Write pictures as a clip; `times` are in ticks, and by default 25 a second."""
    times = times or [512 * k for k in range(len(pictures))]
    with av.open(str(path), "w", format=muxer) as film:
        stream = film.add_stream(codec, rate=25, options=options or {})
        stream.height, stream.width = pictures[0].shape[:2]
        stream.pix_fmt, stream.time_base, stream.codec_context.time_base = pix_fmt, tick, tick
        for name, value in tags.items():
            setattr(stream.codec_context, name, value)
        if aspect:
            stream.codec_context.sample_aspect_ratio = aspect
        if turned:
            stream.set_display_rotation(turned)
        tone = film.add_stream(sound, rate=48000) if sound else None
        words = film.add_mux_stream(subtitles) if subtitles else None
        film.metadata["title"] = "A face"
        if chapters:
            film.set_chapters(list(chapters))
        for picture, time in zip(pictures, times, strict=True):
            frame = av.VideoFrame.from_ndarray(picture, format="rgb24").reformat(
                format=pix_fmt,
                dst_colorspace="ITU709",
                src_color_range="JPEG",
                dst_color_range="MPEG" if tags.get("color_range") != 2 else "JPEG",
            )
            frame.pts, frame.time_base = time, tick
            for name, value in tags.items():
                setattr(frame, name, value)
            film.mux(stream.encode(frame))
        film.mux(stream.encode(None))
        if tone:
            wave = (0.2 * np.sin(np.arange(1024 * 20) * 0.06)).astype(np.float32)
            for k in range(20):
                part = av.AudioFrame.from_ndarray(wave[None, 1024 * k : 1024 * (k + 1)], "fltp", "mono")
                part.sample_rate, part.pts, part.time_base = 48000, 1024 * k, Fraction(1, 48000)
                film.mux(tone.encode(part))
            film.mux(tone.encode(None))
        if words:
            packet = av.Packet(b"hello")
            packet.pts = packet.dts = 100
            packet.duration, packet.time_base, packet.stream = 200, Fraction(1, 1000), words
            film.mux(packet)
    return path


def packets(path, kind):
    """What a file holds of a kind of stream: (time in s, bytes) of every packet."""
    with av.open(str(path)) as film:
        streams = [stream for stream in film.streams if stream.type == kind]
        return [(Fraction(one.pts * one.time_base), bytes(one)) for one in film.demux(*streams) if one.size]


def frames(path):
    """The frames of a file."""
    with av.open(str(path)) as film:
        return list(film.decode(video=0))
