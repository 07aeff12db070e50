"""Make the pictures of the docs' sliders: ``python -m examples sliders --heads FOLDER``.

Only photos that may be shown anywhere are used: the samples, in the public domain, and rendered heads, under
CC BY 4.0.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from PIL import Image

from relit import TransferResult, detect_landmarks, normalize, read_image, sample, transfer
from relit.evaluate.color_difference import ciede2000, lab, linear_light
from relit.evaluate.heads import Heads

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

SIDE = 512  # px of a picture
HEAD = 5.2  # interocular distances of a photo that a picture shows: head and collar
QUALITY = 82  # of WebP: no blocks are seen on skin
WARM_AND_BLUE = "-40,20:size=25:color=#ffd9a0+120,10:power=0.6:color=#4060ff"


@dataclass(frozen=True)
class Sample:
    """A slider of sample photos: a target, and by what it is relit."""

    target: str
    reference: str | None = None
    options: dict[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Head:
    """A slider of rendered heads: a target, a reference, and how; its truth is known."""

    target: tuple[str, str]
    reference: tuple[str, str]
    options: dict[str, Any] = field(default_factory=dict)


SAMPLES = {
    "photo": Sample("target", "reference"),
    "rembrandt": Sample("target", options={"light": "rembrandt"}),
    "split": Sample("target", options={"light": "split"}),
    "two-lamps": Sample("target", options={"light": WARM_AND_BLUE}),
    "president": Sample("reference", options={"light": "-55,25"}),
    "coloured": Sample("grey_target", "reference"),
    "paper": Sample("target", "reference", {"method": "ltv"}),
}
#: Of the protocol's sets `across` and `coloured` the first row; of every other row of `harsh`, by CIEDE2000,
#: the best, the median and the worst.
HEADS = {
    "across": Head(("099", "butterfly"), ("135", "rim")),
    "sunset": Head(("127", "env"), ("042", "sunset"), {"tint": "take"}),
    "best": Head(("064", "rembrandt"), ("135", "window")),
    "median": Head(("099", "rembrandt"), ("135", "window")),
    "worst": Head(("126", "rembrandt"), ("027", "env")),
}
NORMALIZED = "even"


@cache
def photo(name: str) -> NDArray[np.uint8]:
    """Return a sample's pixels."""
    return np.asarray(read_image(sample(name)).pixels)


def of_sample(one: Sample) -> tuple[NDArray[Any], NDArray[Any]]:
    """Return a sample before and after, cut to the head."""
    reference = photo(one.reference) if one.reference else None
    after = transfer(photo(one.target), reference, **one.options).image
    return head_of(photo(one.target), one.target), head_of(after, one.target)


def head_of(image: NDArray[Any], name: str) -> NDArray[np.uint8]:
    """Return the part of a sample, or of what was made of it, that shows the head."""
    landmarks = detect_landmarks(photo(name))
    side = HEAD * landmarks.interocular_distance
    left, top = np.maximum(landmarks.xy.mean(axis=0) - side / 2, 0)
    cut = left, top, left + side, top + side
    return np.asarray(Image.fromarray(image).resize((SIDE, SIDE), Image.Resampling.LANCZOS, box=cut))


def of_head(one: Head, heads: Heads) -> tuple[TransferResult, NDArray[Any], float, float]:
    """Return a head's result, the truth, and how far from it result and target are on the face."""
    result = transfer(
        heads.photo(*one.target),
        heads.photo(*one.reference),
        target_landmarks=heads.landmarks(*one.target),
        reference_landmarks=heads.landmarks(*one.reference),
        **one.options,
    )
    truth = heads.photo(one.target[0], one.reference[1])
    face = heads.mask(one.target[0], "face")
    off = difference(result.image[face], truth[face])
    return result, truth, off, difference(heads.photo(*one.target)[face], truth[face])


def difference(image: NDArray[Any], truth: NDArray[Any]) -> float:
    """Return the mean CIEDE2000 of two lists of colours after the one gain in linear light that fits best."""
    ours, theirs = linear_light(image / 255), linear_light(truth / 255)
    gain = (ours * theirs).sum() / (ours * ours).sum()
    return float(ciede2000(lab(gain * ours), lab(theirs)).mean())


def pictures(heads: Heads | None) -> Iterator[tuple[str, NDArray[Any]]]:
    """Make every picture, with its name; those of heads where their folder is at hand."""
    for name, one in SAMPLES.items():
        before, after = of_sample(one)
        yield f"{name}-before", before
        yield f"{name}-after", after
    size = detect_landmarks(photo("target")).interocular_distance
    person = normalize(photo("target"), interocular_distance=size)
    yield f"{NORMALIZED}-before", head_of(photo("target"), "target")
    yield f"{NORMALIZED}-after", head_of(np.asarray(np.rint(person * 255), np.uint8), "target")
    if heads is None:
        return
    for name, head in HEADS.items():
        result, truth, off, own = of_head(head, heads)
        print(f"{name}: {off:.1f} off the truth, its target {own:.1f}")
        yield f"{name}-target", result.target
        yield f"{name}-reference", heads.photo(*head.reference)
        yield f"{name}-result", result.image
        yield f"{name}-truth", truth


def main(arguments: list[str]) -> None:
    """Read the arguments, make the pictures, write them."""
    parser = argparse.ArgumentParser(prog="python -m examples sliders", description=__doc__)
    parser.add_argument("--heads", type=Path, help="rendered heads; without them, only the samples' are made")
    parser.add_argument("-o", "--output", type=Path, default=Path("docs/gallery"), help="folder to write to")
    given = parser.parse_args(arguments)
    given.output.mkdir(parents=True, exist_ok=True)
    for name, picture in pictures(Heads(given.heads) if given.heads else None):
        Image.fromarray(picture).save(given.output / f"{name}.webp", quality=QUALITY, method=6)
