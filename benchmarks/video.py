"""How steady and how near the truth a relit video is: ``python -m benchmarks.video --heads FOLDER``.

Three clips are made, relit and compared: a portrait that keeps still under a camera's noise, a rendered head
that moves in the plane, and one whose reference is a video of a light that moves. What they are compared with
is every frame relit alone, as a photo.
"""

from __future__ import annotations

import json
import resource
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import click
import cv2
import numpy as np
from numpy.typing import NDArray

import relit
from relit.photo.color import luma
from relit.photo.profile import decode_srgb, encode_srgb
from relit.settings.options import TransferOptions
from relit.video.film import relight_video

Picture = NDArray[np.uint8]

_RATE = 30
_BLOCK = 8  # px: over blocks of so many, noise and rounding of pixels average out
_NOISE = 2.0  # grey levels
_LOSSLESS = {"crf": "0", "preset": "ultrafast"}


def write(path: Path, pictures: list[Picture], pix_fmt: str = "yuv444p", **options: str) -> None:
    """Write a clip, without loss by default."""
    import av

    with av.open(str(path), "w") as film:
        stream: Any = film.add_stream("libx264", rate=_RATE, options=options or _LOSSLESS)
        stream.height, stream.width = pictures[0].shape[:2]
        stream.pix_fmt = pix_fmt
        full = pix_fmt == "yuv444p"
        stream.codec_context.color_range, stream.codec_context.colorspace = 1 + full, 1
        span = "JPEG" if full else "MPEG"
        for picture in pictures:
            frame: Any = av.VideoFrame.from_ndarray(picture, format="rgb24")
            frame = frame.reformat(
                format=pix_fmt, dst_colorspace="ITU709", src_color_range="JPEG", dst_color_range=span
            )
            film.mux(stream.encode(frame))
        film.mux(stream.encode(None))


def read(path: Path) -> list[Picture]:
    """Return the frames of a clip."""
    from relit.video.clip import frames, look_at
    from relit.video.pixels import to_rgb

    return [to_rgb(frame) for frame in frames(look_at(str(path)))]


def moved(
    picture: NDArray[Any], number: int, fill: int = cv2.BORDER_REPLICATE, *, back: bool = False
) -> NDArray[Any]:
    """Return a picture as a head that moves shows it: to the sides, up, turned and nearer; or undo it."""
    time = number / _RATE
    height, width = picture.shape[:2]
    turn, scale = 6 * np.sin(2.1 * time), 0.9 + 0.06 * np.sin(1.3 * time)
    place = cv2.getRotationMatrix2D((width / 2, height / 2), turn, scale)
    place[:, 2] += 45 * np.sin(3.1 * time), 18 * np.sin(4.3 * time)
    how = cv2.INTER_CUBIC | (cv2.WARP_INVERSE_MAP if back else 0)
    return np.asarray(cv2.warpAffine(picture, place, (width, height), flags=how, borderMode=fill))


def flicker(before: list[Picture], after: list[Picture], where: NDArray[np.bool_]) -> NDArray[np.float64]:
    """Return the standard deviation over time of what a block is multiplied with, in grey levels of it."""

    def blocks(pictures: list[Picture]) -> NDArray[np.float64]:
        size = [side // _BLOCK for side in pictures[0].shape[1::-1]]
        crop = np.s_[: size[1] * _BLOCK, : size[0] * _BLOCK]
        means = [cv2.resize(luma(one / 255.0)[crop], size, interpolation=cv2.INTER_AREA) for one in pictures]
        return np.asarray(255 * np.stack(means), np.float64)

    one, other = blocks(before), blocks(after)
    ratio = other / np.maximum(one, 1.0)
    inside = cv2.resize(where.astype(np.float32), one.shape[:0:-1], interpolation=cv2.INTER_AREA) > 0.99
    return np.asarray((ratio.std(axis=0) * other.mean(axis=0) / np.maximum(ratio.mean(axis=0), 1e-3))[inside])


def error(got: NDArray[Any], truth: NDArray[Any], where: NDArray[np.bool_]) -> float:
    """Return the mean absolute error of luma after the one gain that fits best, in % of the range."""
    one, other = (luma(picture / 255.0)[where] for picture in (got, truth))
    return float(100 * np.abs(one * (one @ other) / (one @ one) - other).mean())


def still(folder: Path, portrait: Path, count: int) -> dict[str, float]:
    """Relight a portrait that keeps still under a camera's noise."""
    photo = cv2.resize(relit.read_image(portrait).pixels, (720, 720), interpolation=cv2.INTER_AREA)
    photo = cv2.copyMakeBorder(photo, 0, 0, 280, 280, cv2.BORDER_REPLICATE)
    noise = np.random.default_rng(0)
    clean = [photo.astype(np.float32) + noise.normal(0, _NOISE, photo.shape) for _ in range(count)]
    clip = [np.clip(one.round(), 0, 255).astype(np.uint8) for one in clean]
    write(folder / "still.mp4", clip)
    face = relit.detect_landmarks(photo)
    where = cv2.fillConvexPoly(
        np.zeros(photo.shape[:2], np.uint8), cv2.convexHull(face.xy.round().astype(np.int32)), (1,)
    )
    measured = {}
    before = read(folder / "still.mp4")
    begun, spent = time.monotonic(), time.process_time()
    film(folder, "still.mp4", light="rembrandt")
    measured["s a frame"] = (time.monotonic() - begun) / count
    measured["CPU s a frame"] = (time.process_time() - spent) / count
    after = read(folder / "relit.mp4")
    for name, area in (("face", where > 0), ("all", np.ones_like(where) > 0)):
        values = flicker(before, after, area)
        measured |= {
            f"flicker, {name}": values.mean(),
            f"flicker, {name}, 99th of 100": np.quantile(values, 0.99),
        }
    alone = [relit.transfer(one, light="rembrandt").image for one in before[:30]]
    values = flicker(before[:30], alone, where > 0)
    return measured | {
        "alone, face": values.mean(),
        "alone, face, 99th of 100": np.quantile(values, 0.99),
    }


def film(folder: Path, name: str, reference: Any = None, other: str | None = None, **options: Any) -> None:
    """Relight a clip of a folder, without loss."""
    photo = [] if reference is None else [reference]
    relight_video(
        str(folder / name),
        str(folder / "relit.mp4"),
        TransferOptions(**options),
        references=photo,
        reference_landmarks=[relit.detect_landmarks(one) for one in photo],
        reference_video=other and str(folder / other),
        crf=0,
        overwrite=True,
    )


def head(folder: Path, heads: Path, row: list[str], count: int, *, moving: bool) -> dict[str, float]:
    """Relight a rendered head that moves, by a photo, or by a video whose light goes from one to another."""
    person, light, other, wanted = row

    def photo(who: str, lit: str) -> Picture:
        return np.asarray(relit.read_image(heads / who / f"{lit}.png").pixels)

    def between(who: str, number: int) -> Picture:
        if not moving:
            return photo(who, wanted)
        share = 0.5 - 0.5 * np.cos(np.pi * number / _RATE)
        one, two = (decode_srgb(photo(who, lit) / 255.0) for lit in (wanted, _OTHER.get(wanted, "front")))
        return np.asarray((255 * encode_srgb((1 - share) * one + share * two)).round(), np.uint8)

    face = photo(person, "mask_face") > 127
    clip = [np.asarray(moved(photo(person, light), number), np.uint8) for number in range(count)]
    truth = [moved(between(person, number), number) for number in range(count)]
    where = [moved(face.astype(np.uint8), number, cv2.BORDER_CONSTANT) > 0 for number in range(count)]
    write(folder / "pan.mp4", clip)
    clip = read(folder / "pan.mp4")
    if moving:
        write(folder / "light.mp4", [between(other, number) for number in range(count)])
        film(folder, "pan.mp4", other="light.mp4")
    else:
        film(folder, "pan.mp4", photo(other, wanted))
    made = read(folder / "relit.mp4")
    some = range(0, count, 5)
    alone = [relit.transfer(clip[number], between(other, number)).image for number in some]
    errors = [error(*one) for one in zip(made, truth, where, strict=True)]
    inside = cv2.erode(face.astype(np.uint8), np.ones((15, 15), np.uint8)) > 0

    def flickers(pictures: list[Picture]) -> float:
        """Return how much a face flickers that is brought back to where it was."""
        one, other = (
            [moved(picture, number, back=True) for picture, number in zip(of, some, strict=True)]
            for of in ([clip[number] for number in some], pictures)
        )
        return float(flicker(one, other, inside).mean())

    return {
        "error, video": float(np.mean([errors[number] for number in some])),
        "error, frames alone": float(
            np.mean([error(one, truth[n], where[n]) for one, n in zip(alone, some, strict=True)])
        ),
        "error, worst frame": max(errors),
        **(
            {}
            if moving
            else {
                "flicker, video": flickers([made[n] for n in some]),
                "flicker, frames alone": flickers(alone),
            }
        ),
    }


_OTHER = {"keyleft": "keyright", "rim": "env", "below": "front", "split": "splitright"}
_ROWS = [
    ["127", "front", "172", "split"],
    ["099", "front", "126", "keyright"],
    ["005", "window", "172", "keyleft"],
    ["064", "env", "008", "rembrandt"],
    ["135", "butterfly", "027", "below"],
    ["042", "front", "125", "sun"],
]


@click.command(help=__doc__)
@click.option("--heads", type=click.Path(path_type=Path), required=True, help="A folder of rendered heads.")
@click.option(
    "--portrait", type=click.Path(path_type=Path), required=True, help="A portrait that keeps still."
)
@click.option("--frames", default=60, show_default=True)
@click.option("--only", type=click.Choice(["still", "pan", "light"]), multiple=True)
def main(heads: Path, portrait: Path, frames: int, only: tuple[str, ...]) -> None:
    """Measure, and print it as JSON lines."""
    cases: dict[str, Callable[[Path], dict[str, float]]] = {}
    cases["still"] = lambda folder: still(folder, portrait, frames)
    for row in _ROWS:
        cases[f"pan {' '.join(row)}"] = lambda folder, row=row: head(folder, heads, row, frames, moving=False)  # type: ignore[misc]
    for row in (_ROWS[0], _ROWS[2], _ROWS[4]):
        cases[f"light {' '.join(row)}"] = lambda folder, row=row: head(
            folder, heads, row, frames, moving=True
        )  # type: ignore[misc]
    for name, measure in cases.items():
        if only and name.split()[0] not in only:
            continue
        with tempfile.TemporaryDirectory() as folder:
            told = {what: round(float(value), 3) for what, value in measure(Path(folder)).items()}
        print(json.dumps({"case": name, **told}), flush=True)
    print(json.dumps({"most memory, MB": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3}))


if __name__ == "__main__":
    main()
