"""Crops of the sample photos, each a little elsewhere, with their landmarks: as many pairs as are wanted."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from importlib.resources import files
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from PIL import Image

import relit

_ROOM = 1.5  # side of a crop over that of the landmarks' box
_APART = 0.06  # of the side, by which crops differ
_SAMPLES = {"target": "target.png", "reference": "reference.jpg"}


class Face(NamedTuple):
    """A square photo of a face."""

    pixels: NDArray[np.uint8]
    landmarks: relit.Landmarks


def crops(sample: str, count: int, size: int) -> Iterator[Face]:
    """Yield so many crops of a sample photo, ``target`` or ``reference``, of `size` px a side."""
    photo, found = _sample(sample)
    draw = np.random.default_rng(0)
    left, top = found.xy.min(axis=0)
    right, bottom = found.xy.max(axis=0)
    side = _ROOM * max(right - left, bottom - top)
    for _ in range(count):
        x, y = (np.array([left + right, top + bottom]) - side) / 2 + draw.uniform(-_APART, _APART, 2) * side
        x, y = max(x, 0.0), max(y, 0.0)
        box = (x, y, min(x + side, photo.width), min(y + side, photo.height))
        crop = photo.resize((size, size), Image.Resampling.BICUBIC, box=box)
        scale = np.array([size / (box[2] - box[0]), size / (box[3] - box[1])])
        points = found.points.copy()
        points[:, :2] = (points[:, :2] + 0.5 - box[:2]) * scale - 0.5
        points[:, 2] *= scale.mean()
        yield Face(np.asarray(crop), relit.Landmarks(points, found.scheme))


@cache
def _sample(name: str) -> tuple[Image.Image, relit.Landmarks]:
    with (files("relit.photo") / "sample_photos" / _SAMPLES[name]).open("rb") as file:
        photo = Image.open(file).convert("RGB")
    return photo, relit.detect_landmarks(np.asarray(photo))


def pair(size: int) -> tuple[Face, Face]:
    """Return a target and a reference of `size` px a side."""
    target, reference = (next(crops(name, 1, size)) for name in ("target", "reference"))
    return target, reference


def given(target: Face, reference: Face | None) -> dict[str, Any]:
    """Return the landmarks of a pair, or of a target alone, as `relit.transfer` takes them."""
    if reference is None:
        return {"target_landmarks": target.landmarks}
    return {"target_landmarks": target.landmarks, "reference_landmarks": reference.landmarks}
